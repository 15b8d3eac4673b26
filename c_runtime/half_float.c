#include "hystgen_runtime.h"

static hystgen_real_t hystgen_half(hystgen_real_t x)
{
    return x * (hystgen_real_t)0.5f;
}
