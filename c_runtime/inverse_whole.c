#include "hystgen_runtime.h"

/* What an input move `way` leaves of an output move `on`. The input moves in whole drive codes, to
   the nearest one: the remainder is below one code's worth, which 32 bits hold. */
static inline int64_t hystgen_inverse_left(int64_t on, uint32_t slope, uint32_t way) {
    const uint32_t left = (uint32_t)on - slope * way;
    const uint32_t sign = 0x80000000u;
    return (int64_t)(left ^ sign) - (int64_t)sign;
}
