/* The memoryless part in fixed point: piecewise polynomials, and rounding to the nearest integer.
   Called by front.c and by the curves of effects. */
#include "arithmetic/fixed.h"
#include "hystgen_runtime.h"

/* x / 2^bits to the nearest integer, ties away from zero. */
HYSTGEN_API int64_t hystgen_nearest(int64_t x, unsigned int bits) {
    if (bits == 0) {
        return x;
    }
    return (x + ((int64_t)1 << (bits - 1u)) - (x < 0 ? 1 : 0)) >> bits;
}

/* y times h = 0 .. 1, in units of 2^-31. */
static inline int64_t hystgen_part_of(int32_t y, int32_t h) {
    return ((int64_t)y * h + ((int64_t)1 << 30)) >> 31;
}

/* Value at x of a piecewise polynomial c_0 + c_1 h + c_2 h^2 + ..., h = 0 .. 1 along each piece.
   Arguments: the starts of the pieces, the left shifts that scale their lengths to 2^31, and their
   coefficients from degree 0; all but c_0 together fit in a word. */
HYSTGEN_API int64_t hystgen_curve(const int32_t *knot, const uint8_t *scale,
                                  const int32_t *coefficient, unsigned int pieces,
                                  unsigned int degree, int32_t x) {
    unsigned int low = 0;
    unsigned int high = pieces - 1u;
    unsigned int i;
    while (low < high) {
        const unsigned int middle = (low + high + 1u) / 2u;
        if (x >= knot[middle]) {
            low = middle;
        } else {
            high = middle - 1u;
        }
    }
    const uint32_t on = ((uint32_t)x - (uint32_t)knot[low]) << scale[low];
    const int32_t h = (int32_t)(on & 0x7fffffffu);
    const unsigned int first = low * (degree + 1u);
    coefficient = &coefficient[first];
    int32_t y = coefficient[degree];
    for (i = degree - 1u; i > 0; --i) {
        y = coefficient[i] + (int32_t)hystgen_part_of(y, h);
    }
    return coefficient[0] + hystgen_part_of(y, h);
}

/* Drive code for an input w of the plays outside the image of the drive range: the end of the
   range, and one code more if w is off by more than rounding. Sets `limited` if no envelope reaches
   w. */
HYSTGEN_API hystgen_reach_t hystgen_beyond(const hystgen_ends_t *e, hystgen_reach_t w,
                                           int32_t drive_min, int32_t drive_max, bool *limited) {
    if (w > e->last) {
        *limited = w > e->most && w > e->envelope_most;
        return (hystgen_reach_t)drive_max + (w > e->most ? 1 : 0);
    }
    *limited = w < e->least && w < e->envelope_least;
    return (hystgen_reach_t)drive_min - (w < e->least ? 1 : 0);
}
