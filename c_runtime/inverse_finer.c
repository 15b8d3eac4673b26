#include "hystgen_runtime.h"

/* What an input move `way` leaves of an output move `on`; the input is finer than codes. */
static inline int64_t hystgen_inverse_left(int64_t on, uint32_t slope, uint32_t way) {
    return on - (int64_t)hystgen_wide(slope, way);
}
