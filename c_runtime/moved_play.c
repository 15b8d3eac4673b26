#include "hystgen_runtime.h"

/* Play i that rests at q, once its input has gone from `before` to w. */
static hystgen_real_t hystgen_moved(unsigned int i, hystgen_real_t q, hystgen_real_t before,
                                    hystgen_real_t w)
{
    const hystgen_real_t low = w - hystgen_play.threshold[i];
    const hystgen_real_t high = w + hystgen_play.threshold[i];
    const hystgen_real_t upper = q > high ? high : q;
    (void)before;
    return upper < low ? low : upper;
}

/* Where play i comes to rest from z with its input held at w. */
static hystgen_real_t hystgen_left(unsigned int i, hystgen_real_t z, hystgen_real_t w)
{
    (void)i;
    (void)w;
    return z;
}
