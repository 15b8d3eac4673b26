#include "hystgen_runtime.h"

/* A share of the part of x beyond +-r. */
static int64_t hystgen_stretched(int64_t x, int32_t r, const hystgen_factor_t *share) {
    return hystgen_times(x > r ? x - r : x < -(int64_t)r ? x + r : 0, share);
}
