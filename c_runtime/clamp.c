#include "hystgen_runtime.h"

static hystgen_real_t hystgen_clamp_drive(hystgen_reach_t v)
{
    const hystgen_reach_t least = v < HYSTGEN_DRIVE_MIN ? HYSTGEN_DRIVE_MIN : v;
    return (hystgen_real_t)(least > HYSTGEN_DRIVE_MAX ? HYSTGEN_DRIVE_MAX : least);
}

static hystgen_real_t hystgen_inverse_clamp(hystgen_reach_t u)
{
    const hystgen_reach_t least = u < HYSTGEN_OUTPUT_MIN ? HYSTGEN_OUTPUT_MIN : u;
    return (hystgen_real_t)(least > HYSTGEN_OUTPUT_MAX ? HYSTGEN_OUTPUT_MAX : least);
}
