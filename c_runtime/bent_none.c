#include "hystgen_runtime.h"

/* What play i contributes at z: itself. */
static inline hystgen_sum_t hystgen_bent(unsigned int i, hystgen_play_t z) {
    (void)i;
    return z;
}
