/* The part of its stretch that a play with a nonlinear dashpot gains in a step, as a table. Called
   by dashpot.c. */
#ifndef HYSTGEN_RATE_DEPENDENCE_YIELD_C
#define HYSTGEN_RATE_DEPENDENCE_YIELD_C
#include "compensator/chain/model.h"
#ifdef HYSTGEN_FIXED
#include "arithmetic/factors.c"
#endif

#ifdef HYSTGEN_FIXED
/* The move of a play for a yield, and the reverse. */
static inline int64_t hystgen_moved_by(int64_t yield) {
    return hystgen_nearest(yield, HYSTGEN_YIELD_BITS);
}

static inline int64_t hystgen_yield_of(int64_t moved) {
    return moved * ((int64_t)1 << HYSTGEN_YIELD_BITS);
}

/* The part of a stretch x >= 0 that a play with a nonlinear dashpot gains in a step, with
   HYSTGEN_YIELD_BITS bits below a step of the plays' input: a piecewise cubic as in hystgen_curve,
   each piece with the bits that its values leave out; never more than x. */
static int64_t hystgen_yield(int64_t x) {
    const uint32_t whole = (uint32_t)x;
    const uint32_t inside = whole > HYSTGEN_STRETCH ? (uint32_t)HYSTGEN_STRETCH : whole;
    unsigned int low = 0;
    unsigned int high = HYSTGEN_YIELDS;
    int64_t y = 0;
    unsigned int k;
    while (high - low > 1u) {
        const unsigned int middle = (low + high) / 2;
        const bool before = inside < hystgen_yields[middle].begin;
        low = before ? low : middle;
        high = before ? middle : high;
    }
    const hystgen_yield_t *piece = &hystgen_yields[low];
    const uint32_t h = (inside - piece->begin) << piece->scale;
    for (k = 4; k > 0; --k) {
        y = piece->c[k - 1u] + ((y * (int64_t)h + ((int64_t)1 << 30)) >> 31);
    }
    y = y * ((int64_t)1 << piece->lift);
    return y > hystgen_yield_of(whole) ? hystgen_yield_of(whole) : y;
}

/* The part of a step `way` after which the input is taken as standing still. */
static inline int64_t hystgen_standing_way(int64_t way) {
    return hystgen_short_times(way, &hystgen_standing_share);
}
#else
/* The part of a stretch x >= 0 that a play with a nonlinear dashpot gains in a step: a table, cubic
   between its knots. Sets `slope` to its change with x. */
static hystgen_real_t hystgen_yield(hystgen_real_t x, hystgen_real_t *slope) {
    unsigned int low = 0;
    unsigned int high = HYSTGEN_YIELDS;
    while (high - low > 1u) {
        const unsigned int middle = (low + high) / 2;
        const bool before = x < hystgen_yields[middle][0];
        low = before ? low : middle;
        high = before ? middle : high;
    }
    const hystgen_real_t *c = hystgen_yields[low];
    const hystgen_real_t on = x - c[0];
    const hystgen_real_t bend = c[4] * on;
    *slope = (bend + bend + bend + c[3] + c[3]) * on + c[2];
    return ((bend + c[3]) * on + c[2]) * on + c[1];
}

/* The part of a step `way` after which the input is taken as standing still. */
static inline hystgen_real_t hystgen_standing_way(hystgen_real_t way) {
    return way * HYSTGEN_STANDING_SHARE;
}

/* The move of a play for a yield, and the reverse. */
static inline hystgen_real_t hystgen_moved_by(hystgen_real_t yield) {
    return yield;
}

static inline hystgen_real_t hystgen_yield_of(hystgen_real_t moved) {
    return moved;
}
#endif

#endif
