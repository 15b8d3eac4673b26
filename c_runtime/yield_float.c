#include "hystgen_runtime.h"

/* The part of a stretch x >= 0 that a play with a nonlinear dashpot gains in a step: a table, cubic
   between its knots. */
static hystgen_real_t hystgen_yield(hystgen_real_t x) {
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
    return ((c[4] * on + c[3]) * on + c[2]) * on + c[1];
}

/* How far into the step `way` the input counts as standing still. */
static inline hystgen_real_t hystgen_seen(hystgen_real_t way) {
    return way * HYSTGEN_SEEN;
}

/* The move of a play for a yield, and the reverse. */
static inline hystgen_real_t hystgen_moved_by(hystgen_real_t yield) {
    return yield;
}

static inline hystgen_real_t hystgen_yield_of(hystgen_real_t moved) {
    return moved;
}
