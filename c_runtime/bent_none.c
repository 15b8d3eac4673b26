#include "hystgen_runtime.h"

/* What play i contributes at z. */
static hystgen_sum_t hystgen_bent(unsigned int i, hystgen_sum_t z) {
    (void)i;
    return z;
}
