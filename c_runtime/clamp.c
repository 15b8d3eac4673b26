#include "hystgen_runtime.h"

static hystgen_real_t hystgen_clamp_drive(hystgen_reach_t v)
{
    return (hystgen_real_t)(v < HYSTGEN_DRIVE_MIN   ? HYSTGEN_DRIVE_MIN
                            : v > HYSTGEN_DRIVE_MAX ? HYSTGEN_DRIVE_MAX
                                                    : v);
}

static hystgen_real_t hystgen_inverse_clamp(hystgen_reach_t u)
{
    return (hystgen_real_t)(u < HYSTGEN_OUTPUT_MIN   ? HYSTGEN_OUTPUT_MIN
                            : u > HYSTGEN_OUTPUT_MAX ? HYSTGEN_OUTPUT_MAX
                                                     : u);
}
