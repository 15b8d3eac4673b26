#include "hystgen_runtime.h"

/* Output code of a sum. */
static hystgen_real_t hystgen_code(hystgen_sum_t sum, unsigned int *status) {
    const hystgen_sum_t code = hystgen_nearest(sum, HYSTGEN_FRACTION);
    if (code > HYSTGEN_CODE_MAX || code < -HYSTGEN_CODE_MAX) { /* only after a reset */
        *status |= HYSTGEN_STATUS_OUTPUT_CLAMPED;
    }
    if (code > HYSTGEN_CODE_MAX) {
        return (hystgen_real_t)HYSTGEN_CODE_MAX;
    }
    if (code < -HYSTGEN_CODE_MAX) {
        return (hystgen_real_t)-HYSTGEN_CODE_MAX;
    }
    return (hystgen_real_t)code;
}
