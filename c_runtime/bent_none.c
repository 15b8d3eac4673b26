#include "hystgen_runtime.h"

/* What play i contributes at z. */
static hystgen_real_t hystgen_bent(unsigned int i, hystgen_real_t z) {
    (void)i;
    return z;
}
