/* Elements in parallel with the plays, which follow one curve C from each turn of their input on:
   z/width, in the direction of the input, changes as C does over the distance moved. Called by
   compensator/chain/moving_plays.c. */
#ifndef HYSTGEN_BOUC_WEN_ELEMENTS_C
#define HYSTGEN_BOUC_WEN_ELEMENTS_C
#include "compensator/chain/model.h"
#ifdef HYSTGEN_FIXED
#include "arithmetic/factors.c"
#endif

#ifdef HYSTGEN_HAS_ELEMENTS
#ifdef HYSTGEN_FIXED
/* Numbers of pieces and elements: places and z/width have 44 bits, mean slopes HYSTGEN_SLOPE bits,
   shares of a piece over shares of its rise HYSTGEN_BACK bits, and slopes HYSTGEN_STEEP bits less
   than mean slopes. */
#define HYSTGEN_CURVE_DEGREE 5u
#define HYSTGEN_SLOPE 27u
#define HYSTGEN_BACK 28u
#define HYSTGEN_STEEP 3u

/* x times a slope. */
static int64_t hystgen_by_slope(int64_t x, int32_t slope) {
    hystgen_factor_t f;
    f.mantissa = slope;
    f.shift = HYSTGEN_SLOPE;
    return hystgen_times(x, &f);
}

/* y times h = 0 .. 1, in units of 2^-31. */
static inline int32_t hystgen_piece_part(int32_t y, int32_t h) {
    return (int32_t)(((int64_t)y * h + ((int64_t)1 << 30)) >> 31);
}

/* c_0 + h (c_1 + h (c_2 + ..)), h = 0 .. 1 in units of 2^-31. */
static int32_t hystgen_mean_slope(const int32_t *c, int32_t h) {
    int32_t slope = c[HYSTGEN_CURVE_DEGREE - 1u];
    unsigned int k;
    for (k = HYSTGEN_CURVE_DEGREE - 1u; k > 0; --k) {
        slope = c[k - 1u] + hystgen_piece_part(slope, h);
    }
    return slope;
}

/* The same, the mean slope of C from the begin of a piece on. Sets the slope of C. */
static int32_t hystgen_slopes(const int32_t *c, int32_t h, int32_t *slope) {
    int32_t mean = c[HYSTGEN_CURVE_DEGREE - 1u];
    int32_t steep = mean >> HYSTGEN_STEEP;
    unsigned int k;
    for (k = HYSTGEN_CURVE_DEGREE - 1u; k > 0; --k) {
        mean = c[k - 1u] + hystgen_piece_part(mean, h);
        steep = hystgen_piece_part(steep, h) + (mean >> HYSTGEN_STEEP);
    }
    *slope = steep;
    return mean;
}

/* A distance x >= 0 from the begin of a piece, over its length, in units of 2^-31. */
static int32_t hystgen_piece_share(int64_t x, uint8_t scale) {
    const int64_t h = x >> scale;
    return h > 0x7fffffff ? 0x7fffffff : (int32_t)h;
}

/* The piece of the curve C in which a place lies or, with `level`, a value of C. */
static unsigned int hystgen_piece_at(bool level, int64_t x) {
    unsigned int low = 0;
    unsigned int high = HYSTGEN_PIECES;
    while (high - low > 1u) {
        const unsigned int middle = (low + high) / 2;
        const hystgen_piece_t *piece = &hystgen_piece[middle];
        const bool before = x < (level ? piece->level : piece->begin);
        low = before ? low : middle;
        high = before ? middle : high;
    }
    return low;
}

/* A move of the input in widths of element j. Beyond a largest move, C is level. */
static int64_t hystgen_element_distance(unsigned int j, int64_t way) {
    const hystgen_element_table_t *t = &hystgen_element_table[j];
    int64_t inside = way;
    if (way > t->far) {
        inside = t->far;
    } else if (way < -t->far) {
        inside = -t->far;
    }
    return hystgen_times(inside * ((int64_t)1 << t->distance_lift), &t->distance);
}

/* z/width of an element at the distance x since its last turn. Sets the slope of C. Backwards,
   where a search may try inputs, the curve goes on straight. */
static int64_t hystgen_element_at(const hystgen_element_t *e, int64_t x, int32_t *slope) {
    if (x < 0) {
        *slope = e->c[0] >> HYSTGEN_STEEP;
        return e->s + hystgen_by_slope(x, e->c[0]);
    }
    if (x < e->until) {
        const int32_t h = hystgen_piece_share(x, e->scale);
        return e->s + hystgen_by_slope(x, hystgen_slopes(e->c, h, slope));
    }
    const unsigned int i = hystgen_piece_at(false, e->place + x);
    const hystgen_piece_t *piece = &hystgen_piece[i];
    int64_t value = piece->level;
    *slope = 0;
    if (i + 1u < HYSTGEN_PIECES) {
        const int64_t on = e->place + x - piece->begin;
        const int32_t h = hystgen_piece_share(on, piece->scale);
        value += hystgen_by_slope(on, hystgen_slopes(piece->up, h, slope));
    }
    return e->s + (value - e->level);
}

/* The share of its length at which C is s, on a piece, in units of 2^-31. */
static int32_t hystgen_piece_back(const hystgen_piece_t *piece, int64_t s) {
    const int64_t u = (s - piece->level) * ((int64_t)1 << piece->lift);
    const int64_t whole = hystgen_times(u, &piece->share);
    const int32_t g = whole > 0x7fffffff ? 0x7fffffff : (int32_t)whole;
    const int64_t slope = hystgen_mean_slope(piece->back, g);
    const int64_t h = (slope * g + ((int64_t)1 << (HYSTGEN_BACK - 1u))) >> HYSTGEN_BACK;
    if (h < 0) {
        return 0;
    }
    return h > 0x7fffffff ? 0x7fffffff : (int32_t)h;
}

/* Puts an element where C is its s, with the polynomial of C from there on. */
static void hystgen_element_put(hystgen_element_t *e) {
    const unsigned int i = hystgen_piece_at(true, e->s);
    const hystgen_piece_t *piece = &hystgen_piece[i];
    const int32_t h = hystgen_piece_back(piece, e->s);
    const int64_t x = (int64_t)h * ((int64_t)1 << piece->scale);
    unsigned int first;
    unsigned int k;
    e->c[HYSTGEN_CURVE_DEGREE - 1u] = piece->up[HYSTGEN_CURVE_DEGREE - 1u];
    for (k = HYSTGEN_CURVE_DEGREE - 1u; k > 0; --k) {
        e->c[k - 1u] = piece->up[k - 1u] + hystgen_piece_part(e->c[k], h);
    }
    e->level = piece->level + hystgen_by_slope(x, e->c[0]);
    for (first = 1; first < HYSTGEN_CURVE_DEGREE; ++first) {
        for (k = HYSTGEN_CURVE_DEGREE - 1u; k >= first; --k) {
            e->c[k - 1u] += hystgen_piece_part(e->c[k], h);
        }
    }
    e->place = piece->begin + x;
    e->scale = piece->scale;
    e->until = i + 1u < HYSTGEN_PIECES ? hystgen_piece[i + 1u].begin - e->place : 0;
}

/* Brings an element to rest, with z = 0. */
static void hystgen_element_unload(hystgen_element_t *e) {
    e->s = 0;
    hystgen_element_put(e);
}

/* Turns an element at the distance x since its last turn: z/width changes its sign. */
static void hystgen_element_turn(hystgen_element_t *e, int64_t x) {
    const unsigned int end = HYSTGEN_PIECES - 1u;
    const int64_t last = hystgen_piece[end].level;
    int32_t slope;
    const int64_t s = hystgen_element_at(e, x, &slope);
    e->s = -s;
    if (s > last) {
        e->s = -last;
    } else if (s < -last) {
        e->s = last;
    }
    hystgen_element_put(e);
}

/* The slope of the sum that results from a slope of C. */
static inline int64_t hystgen_element_slope(unsigned int j, int32_t slope) {
    const hystgen_element_table_t *t = &hystgen_element_table[j];
    return hystgen_short_times(slope, &t->weight) * ((int64_t)1 << t->weight_lift);
}

/* The same right after a turn. */
static inline int64_t hystgen_element_turned(unsigned int j, const hystgen_element_t *e) {
    return hystgen_element_slope(j, e->c[0] >> HYSTGEN_STEEP);
}

/* Contribution of element j to the sum at the distance x since its last turn. Adds to the sum's
   slope. */
static inline int64_t hystgen_element_part(unsigned int j, const hystgen_element_t *e, int64_t x,
                                           int64_t *slope) {
    const hystgen_element_table_t *t = &hystgen_element_table[j];
    int32_t steep;
    const int64_t s = hystgen_element_at(e, x, &steep);
    *slope += hystgen_element_slope(j, steep);
    return hystgen_times(s, &t->amplitude) * ((int64_t)1 << t->amplitude_lift);
}
#else
/* Degree of the polynomials of C and of its inverse. */
#define HYSTGEN_CURVE_DEGREE 7u

/* The piece of the curve in which a place (column 0) or a value of C (column 1) lies. */
static unsigned int hystgen_piece_at(unsigned int column, hystgen_real_t x) {
    unsigned int low = 0;
    unsigned int high = HYSTGEN_PIECES;
    while (high - low > 1u) {
        const unsigned int middle = (low + high) / 2;
        const bool before = x < hystgen_piece[middle][column];
        low = before ? low : middle;
        high = before ? middle : high;
    }
    return low;
}

/* x (c_0 + x (c_1 + ..)). Sets its slope. */
static hystgen_real_t hystgen_polynomial(const hystgen_real_t *c, hystgen_real_t x,
                                         hystgen_real_t *slope) {
    hystgen_real_t value = c[HYSTGEN_CURVE_DEGREE - 1u];
    hystgen_real_t steep = value;
    unsigned int k;
    for (k = HYSTGEN_CURVE_DEGREE - 1u; k > 0; --k) {
        value = value * x + c[k - 1u];
        steep = steep * x + value;
    }
    *slope = steep;
    return value * x;
}

/* Change of z/width of an element over the distance x since its last turn, in widths. Sets its
   slope. Backwards, where a search may try inputs, the curve goes on straight. */
static hystgen_real_t hystgen_gained(const hystgen_element_t *e, hystgen_real_t x,
                                     hystgen_real_t *slope) {
    if (x < 0) {
        *slope = e->c[0];
        return e->c[0] * x;
    }
    if (x < e->until) {
        return hystgen_polynomial(e->c, x, slope);
    }
    const unsigned int i = hystgen_piece_at(0, e->place + x);
    const hystgen_real_t *piece = hystgen_piece[i];
    const hystgen_real_t h = e->place + x - piece[0];
    return piece[1] + hystgen_polynomial(&piece[2], h, slope) - e->level;
}

/* Puts an element where C is s, with the polynomial of C from there on. */
static void hystgen_element_put(hystgen_element_t *e, hystgen_real_t s) {
    const unsigned int i = hystgen_piece_at(1, s);
    const hystgen_real_t *piece = hystgen_piece[i];
    const hystgen_real_t u = s - piece[1];
    hystgen_real_t h = piece[2u * HYSTGEN_CURVE_DEGREE + 1u];
    unsigned int first;
    unsigned int k;
    for (k = 2u * HYSTGEN_CURVE_DEGREE; k > HYSTGEN_CURVE_DEGREE + 1u; --k) {
        h = h * u + piece[k];
    }
    h = h * u;
    e->c[HYSTGEN_CURVE_DEGREE - 1u] = piece[HYSTGEN_CURVE_DEGREE + 1u];
    for (k = HYSTGEN_CURVE_DEGREE - 1u; k > 0; --k) {
        e->c[k - 1u] = piece[k + 1u] + h * e->c[k];
    }
    e->level = piece[1] + h * e->c[0];
    for (first = 1; first < HYSTGEN_CURVE_DEGREE; ++first) {
        for (k = HYSTGEN_CURVE_DEGREE - 1u; k >= first; --k) {
            e->c[k - 1u] = e->c[k - 1u] + h * e->c[k];
        }
    }
    e->place = piece[0] + h;
    e->until = i + 1u < HYSTGEN_PIECES ? hystgen_piece[i + 1u][0] - e->place : 0;
}

/* Brings an element to rest, with z = 0. */
static void hystgen_element_unload(hystgen_element_t *e) {
    e->high = 0;
    e->low = 0;
    hystgen_element_put(e, 0);
}

/* Turns an element at the distance x since its last turn: z/width changes its sign, exactly, with a
   rounding remainder. */
static void hystgen_element_turn(hystgen_element_t *e, hystgen_real_t x) {
    const unsigned int end = HYSTGEN_PIECES - 1u;
    const hystgen_real_t last = hystgen_piece[end][1];
    hystgen_real_t slope;
    const hystgen_real_t more = hystgen_gained(e, x, &slope);
    const hystgen_real_t high = e->high + more;
    const hystgen_real_t part = high - e->high;
    const hystgen_real_t low = e->low + ((e->high - (high - part)) + (more - part));
    const hystgen_real_t whole = high + low;
    e->low = whole - high - low;
    e->high = -whole;
    if (whole > last || whole < -last) {
        e->high = whole > last ? -last : last;
        e->low = 0;
    }
    hystgen_element_put(e, e->high);
}

/* z/width of an element at the distance x since its last turn. Sets its slope. */
static inline hystgen_real_t hystgen_element_at(const hystgen_element_t *e, hystgen_real_t x,
                                                hystgen_real_t *slope) {
    const hystgen_real_t more = hystgen_gained(e, x, slope);
    return e->high + more + e->low;
}

/* A move of the input in widths of element j. */
static inline hystgen_real_t hystgen_element_distance(unsigned int j, hystgen_real_t way) {
    return way * hystgen_element_inverse_width[j];
}
#endif
#endif

#endif
