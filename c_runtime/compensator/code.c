/* The output code of a sum of plays or of a signal, in fixed point. Called by the forward operators
   of models without effects, and by chain/signals.c. */
#ifndef HYSTGEN_CODE_C
#define HYSTGEN_CODE_C
#include "arithmetic/fixed.h"
#include "compensator/model.h"

/* An output code, limited to the type. */
static hystgen_real_t hystgen_limited_code(hystgen_sum_t code, unsigned int *status) {
#ifdef HYSTGEN_HAS_LIMITED_CODES
    if (code > HYSTGEN_CODE_MAX || code < -HYSTGEN_CODE_MAX) {
        *status |= HYSTGEN_STATUS_OUTPUT_CLAMPED;
    }
#else
    (void)status;
#endif
    if (code > HYSTGEN_CODE_MAX) {
        return (hystgen_real_t)HYSTGEN_CODE_MAX;
    }
    if (code < -HYSTGEN_CODE_MAX) {
        return (hystgen_real_t)-HYSTGEN_CODE_MAX;
    }
    return (hystgen_real_t)code;
}

/* Output code of a sum. */
static hystgen_real_t hystgen_code(hystgen_sum_t sum, unsigned int *status) {
    return hystgen_limited_code(hystgen_nearest(sum, HYSTGEN_FRACTION), status);
}

#endif
