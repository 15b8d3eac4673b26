#include "hystgen_runtime.h"

/* Input of the plays: the drive itself. */
static inline hystgen_play_t hystgen_front_forward(hystgen_fine_t v)
{
    return v;
}

/* The drive for an input of the plays. */
static inline hystgen_reach_t hystgen_front_inverse(hystgen_reach_t w)
{
    return w;
}
