#include "hystgen_runtime.h"

/* A drive at a limited rate, in fixed point. What rounding to a code takes from it is kept beside
   it: no number of steps adds it up, and a step may be smaller than a code. */

/* Bits below a code of what is kept: the sum of two and a half fits 32 bits. */
#define HYSTGEN_REST_BITS 30

/* The drive `before`, of which rounding has left `rest`, one step of `move` and `more` later. */
static hystgen_ramp_t hystgen_ramp(hystgen_reach_t before, hystgen_play_t rest,
                                   hystgen_reach_t move, hystgen_play_t more) {
    const hystgen_play_t left = rest + more;
    const hystgen_play_t whole =
        (left + ((hystgen_play_t)1 << (HYSTGEN_REST_BITS - 1))) >> HYSTGEN_REST_BITS;
    const hystgen_ramp_t ramp = {before + move + whole,
                                 left - whole * ((hystgen_play_t)1 << HYSTGEN_REST_BITS)};
    return ramp;
}
