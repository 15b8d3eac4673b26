#include "hystgen_runtime.h"

/* What is left of `on`, a way of the output, behind a way of the input to the nearest drive code,
   which is a whole step of it: less than a step gives, so that 32 bits hold it. */
static inline int64_t hystgen_inverse_left(int64_t on, uint32_t slope, uint32_t way) {
    const uint32_t left = (uint32_t)on - slope * way;
    const uint32_t sign = 0x80000000u;
    return (int64_t)(left ^ sign) - (int64_t)sign;
}
