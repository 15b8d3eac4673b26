#include "hystgen_runtime.h"

/* Input of the plays, with HYSTGEN_FINE bits below a drive code, so that thresholds are exact. */
static inline hystgen_play_t hystgen_front_forward(hystgen_real_t v) {
    return (hystgen_play_t)v * ((hystgen_play_t)1 << HYSTGEN_FINE);
}

/* The nearest drive code for an input of the plays. */
static inline hystgen_reach_t hystgen_front_inverse(hystgen_reach_t w) {
    return (w + ((hystgen_reach_t)1 << (HYSTGEN_FINE - 1u)) - (w < 0 ? 1 : 0)) >> HYSTGEN_FINE;
}
