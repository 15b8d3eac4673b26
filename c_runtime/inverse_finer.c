#include "hystgen_runtime.h"

/* What is left of `on`, of the output, behind a way of the input, which is finer than the drive. */
static inline int64_t hystgen_inverse_left(int64_t on, uint32_t slope, uint32_t way) {
    return on - (int64_t)hystgen_wide(slope, way);
}
