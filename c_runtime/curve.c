#include "hystgen_runtime.h"

/* x / 2^bits to the nearest whole number, ties away from zero. */
HYSTGEN_API int64_t hystgen_nearest(int64_t x, unsigned int bits)
{
    if (bits == 0) {
        return x;
    }
    return (x + ((int64_t)1 << (bits - 1u)) - (x < 0 ? 1 : 0)) >> bits;
}

/* Value at x of the function that the pieces describe, in parts as small as its coefficients'. */
HYSTGEN_API int64_t hystgen_curve(const hystgen_curve_t *c, int32_t x)
{
    unsigned int low = 0;
    unsigned int high = c->pieces - 1u;
    const int32_t *coefficient;
    int64_t y = 0;
    uint32_t h;
    unsigned int i;
    while (low < high) {
        const unsigned int middle = (low + high + 1u) / 2u;
        if (x >= c->knot[middle]) {
            low = middle;
        } else {
            high = middle - 1u;
        }
    }
    h = ((uint32_t)x - (uint32_t)c->knot[low]) << c->scale[low];
    coefficient = &c->coefficient[low * (c->degree + 1u)];
    for (i = c->degree + 1u; i > 0; --i) {
        y = coefficient[i - 1u] + ((y * (int64_t)h + ((int64_t)1 << 30)) >> 31);
    }
    return y;
}

/* Drive code for the input w of the plays, one code beyond the range where w lies beyond what the range gives; tells
   whether w is more than an envelope can take. */
HYSTGEN_API hystgen_reach_t hystgen_back(const hystgen_back_t *b, hystgen_reach_t w, int32_t drive_min,
                                         int32_t drive_max, bool *limited)
{
    *limited = false;
    if (w > b->last) {
        *limited = w > b->most && w > b->envelope_most;
        return (hystgen_reach_t)drive_max + (w > b->most ? 1 : 0);
    }
    if (w < b->first) {
        *limited = w < b->least && w < b->envelope_least;
        return (hystgen_reach_t)drive_min - (w < b->least ? 1 : 0);
    }
    return (hystgen_reach_t)hystgen_nearest(hystgen_curve(&b->curve, (int32_t)w), b->below);
}
