#include "hystgen_runtime.h"

/* A drive at a limited rate, in fixed point. What rounding to a code takes from it is kept beside
   it: no number of steps adds it up, and a step may be smaller than a code. */

/* Bits below a code of what is kept: the sum of two and a half fits 32 bits. */
#define HYSTGEN_REST_BITS 30

/* One step of `move`, from which rounding took `more`. */
static void hystgen_ramp_on(hystgen_ramp_t *ramp, hystgen_reach_t move, hystgen_play_t more) {
    const hystgen_play_t left = ramp->rest + more;
    const hystgen_play_t whole =
        (left + ((hystgen_play_t)1 << (HYSTGEN_REST_BITS - 1))) >> HYSTGEN_REST_BITS;
    ramp->drive = ramp->drive + move + whole;
    ramp->rest = left - whole * ((hystgen_play_t)1 << HYSTGEN_REST_BITS);
}
