/* Limits drives and references to their ranges. Called by every operator. */
#ifndef HYSTGEN_CLAMP_C
#define HYSTGEN_CLAMP_C
#include "compensator/model.h"

static hystgen_real_t hystgen_clamp_drive(hystgen_reach_t v) {
    const hystgen_reach_t least = v < HYSTGEN_DRIVE_MIN ? HYSTGEN_DRIVE_MIN : v;
    return (hystgen_real_t)(least > HYSTGEN_DRIVE_MAX ? HYSTGEN_DRIVE_MAX : least);
}

static hystgen_real_t hystgen_inverse_clamp(hystgen_reach_t u) {
    const hystgen_reach_t least = u < HYSTGEN_OUTPUT_MIN ? HYSTGEN_OUTPUT_MIN : u;
    return (hystgen_real_t)(least > HYSTGEN_OUTPUT_MAX ? HYSTGEN_OUTPUT_MAX : least);
}

#if defined(HYSTGEN_FIXED) && defined(HYSTGEN_CHAIN)
/* Output of the drive side in a model with effects, limited to what the drive range allows. */
static hystgen_fine_t hystgen_clamp_fine(hystgen_reach_t a) {
    if (a < HYSTGEN_FINE_MIN) {
        return (hystgen_fine_t)HYSTGEN_FINE_MIN;
    }
    if (a > HYSTGEN_FINE_MAX) {
        return (hystgen_fine_t)HYSTGEN_FINE_MAX;
    }
    return (hystgen_fine_t)a;
}
#endif

#endif
