/* The stretch of a viscous play. Called by relaxing.c and moved.c. */
#ifndef HYSTGEN_RATE_DEPENDENCE_STRETCH_C
#define HYSTGEN_RATE_DEPENDENCE_STRETCH_C
#include "compensator/chain/model.h"

/* The part of x beyond +-r. */
static hystgen_sum_t hystgen_stretch(hystgen_sum_t x, hystgen_play_t r) {
    if (x > r) {
        return x - r;
    }
    if (x < -r) {
        return x + r;
    }
    return 0;
}

#endif
