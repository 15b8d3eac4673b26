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
#define HYSTGEN_WIDTH ((int64_t)1 << 44)

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

/* c_0 + h (c_1 + h (c_2 + ..)), h = 0 .. 1 in units of 2^-31: the mean slope of C from the begin of
   a piece on. Sets the slope of C. */
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

/* The distance from the begin of a piece at which C is s. Sets the share of its length, in units of
   2^-31. */
static int64_t hystgen_piece_back(const hystgen_piece_t *piece, int64_t s, int32_t *share) {
    const int64_t u = (s - piece->level) * ((int64_t)1 << piece->lift);
    const int64_t whole = hystgen_times(u, &piece->share);
    const int32_t g = whole > 0x7fffffff ? 0x7fffffff : (int32_t)whole;
    int32_t steep;
    const int64_t slope = hystgen_slopes(piece->back, g, &steep);
    const int64_t h = (slope * g + ((int64_t)1 << (HYSTGEN_BACK - 1u))) >> HYSTGEN_BACK;
    const int64_t inside = h > 0x7fffffff ? 0x7fffffff : h;
    *share = inside < 0 ? 0 : (int32_t)inside;
    return (int64_t)*share * ((int64_t)1 << piece->scale);
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
#else
/* Degree of the polynomials of C and of its inverse, and one width. */
#define HYSTGEN_CURVE_DEGREE 7u
#define HYSTGEN_WIDTH 1

/* x times a slope. */
static inline hystgen_real_t hystgen_by_slope(hystgen_real_t x, hystgen_real_t slope) {
    return x * slope;
}

/* y times h. */
static inline hystgen_real_t hystgen_piece_part(hystgen_real_t y, hystgen_real_t h) {
    return y * h;
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

/* The distance h from the begin of a piece at which C is s. */
static hystgen_real_t hystgen_piece_back(const hystgen_piece_t *piece, hystgen_real_t s,
                                         hystgen_real_t *h) {
    hystgen_real_t slope;
    *h = hystgen_polynomial(piece->back, s - piece->level, &slope);
    return *h;
}

/* A move of the input in widths of element j. */
static inline hystgen_real_t hystgen_element_distance(unsigned int j, hystgen_real_t way) {
    return way * hystgen_element_inverse_width[j];
}
#endif

/* The piece of the curve C in which a place lies or, with `level`, a value of C. */
static unsigned int hystgen_piece_at(bool level, hystgen_sum_t x) {
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

/* Puts an element where C is s, with the polynomial of C from there on. */
static void hystgen_element_put(hystgen_element_t *e, hystgen_sum_t s) {
    const unsigned int i = hystgen_piece_at(true, s);
    const hystgen_piece_t *piece = &hystgen_piece[i];
    hystgen_narrow_t h;
    const hystgen_sum_t x = hystgen_piece_back(piece, s, &h);
    unsigned int first;
    unsigned int k;
    e->c[HYSTGEN_CURVE_DEGREE - 1u] = piece->up[HYSTGEN_CURVE_DEGREE - 1u];
    for (k = HYSTGEN_CURVE_DEGREE - 1u; k > 0; --k) {
        e->c[k - 1u] = piece->up[k - 1u] + hystgen_piece_part(e->c[k], h);
    }
    e->level = piece->level + hystgen_by_slope(x, e->c[0]);
    for (first = 1; first < HYSTGEN_CURVE_DEGREE; ++first) {
        for (k = HYSTGEN_CURVE_DEGREE - 1u; k >= first; --k) {
            e->c[k - 1u] = e->c[k - 1u] + hystgen_piece_part(e->c[k], h);
        }
    }
    e->place = piece->begin + x;
    e->until = i + 1u < HYSTGEN_PIECES ? hystgen_piece[i + 1u].begin - e->place : 0;
#ifdef HYSTGEN_FIXED
    e->scale = piece->scale;
#endif
#ifdef HYSTGEN_HAS_TILT
    e->c[0] = e->c[0] + e->lean;
#endif
}

/* Puts element j on C for a move from the input w: where C is its z/width, or with a tilted drive
   as far from the limit there, over the largest limit. */
static void hystgen_element_depart(unsigned int j, hystgen_element_t *e, hystgen_play_t w) {
#ifdef HYSTGEN_HAS_TILT
    const hystgen_sum_t x = hystgen_element_distance(j, (hystgen_sum_t)w - hystgen_tilt[j].top);
    hystgen_element_put(e, e->s - hystgen_by_slope(x, hystgen_tilt[j].lean));
#else
    (void)j;
    (void)w;
    hystgen_element_put(e, e->s);
#endif
}

/* Brings element j to rest at the input w, with z = 0. */
static void hystgen_element_unload(unsigned int j, hystgen_element_t *e, hystgen_play_t w) {
    e->s = 0;
#ifndef HYSTGEN_FIXED
    e->low = 0;
#endif
#ifdef HYSTGEN_HAS_TILT
    e->lean = hystgen_tilt[j].lean;
    e->s = hystgen_by_slope(HYSTGEN_WIDTH, e->lean);
#endif
    hystgen_element_depart(j, e, w);
}

#ifdef HYSTGEN_FIXED
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
    const int64_t on = e->place + x - piece->begin;
    const int32_t h = hystgen_piece_share(on, piece->scale);
    const int64_t value = piece->level + hystgen_by_slope(on, hystgen_slopes(piece->up, h, slope));
#ifdef HYSTGEN_HAS_TILT
    *slope += e->lean >> HYSTGEN_STEEP;
    return e->s + (value - e->level) + hystgen_by_slope(x, e->lean);
#else
    return e->s + (value - e->level);
#endif
}

/* The slope of the sum that results from a slope of C. */
static inline int64_t hystgen_element_slope(unsigned int j, int32_t slope) {
    const hystgen_element_table_t *t = &hystgen_element_table[j];
    return hystgen_short_times(slope, &t->weight) * ((int64_t)1 << t->weight_lift);
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
    const unsigned int i = hystgen_piece_at(false, e->place + x);
    const hystgen_piece_t *piece = &hystgen_piece[i];
    const hystgen_real_t h = e->place + x - piece->begin;
    const hystgen_real_t value = piece->level + hystgen_polynomial(piece->up, h, slope) - e->level;
#ifdef HYSTGEN_HAS_TILT
    *slope = *slope + e->lean;
    return value + e->lean * x;
#else
    return value;
#endif
}

/* z/width of an element at the distance x since its last turn. Sets its slope. */
static inline hystgen_real_t hystgen_element_at(const hystgen_element_t *e, hystgen_real_t x,
                                                hystgen_real_t *slope) {
    const hystgen_real_t more = hystgen_gained(e, x, slope);
    return e->s + more + e->low;
}
#endif

/* Turns element j at the input w, at the distance x since its last turn: z/width changes its sign,
   exactly, in floating point with a rounding remainder. */
static void hystgen_element_turn(unsigned int j, hystgen_element_t *e, hystgen_sum_t x,
                                 hystgen_play_t w) {
    const unsigned int end = HYSTGEN_PIECES - 1u;
    const hystgen_sum_t last = hystgen_piece[end].level;
    hystgen_narrow_t slope;
#ifdef HYSTGEN_FIXED
    const hystgen_sum_t whole = hystgen_element_at(e, x, &slope);
#else
    const hystgen_real_t more = hystgen_gained(e, x, &slope);
    const hystgen_real_t high = e->s + more;
    const hystgen_real_t part = high - e->s;
    const hystgen_real_t low = e->low + ((e->s - (high - part)) + (more - part));
    const hystgen_real_t whole = high + low;
    e->low = whole > last || whole < -last ? 0 : whole - high - low;
#endif
    e->s = -whole;
    if (whole > last || whole < -last) {
        e->s = whole > last ? -last : last;
    }
#ifdef HYSTGEN_HAS_TILT
    e->lean = -e->lean;
#endif
    hystgen_element_depart(j, e, w);
}
#endif

#endif
