#include "hystgen_runtime.h"

/* Play i that rests at q, once its input has gone from `before` to w; the threshold grows with the
   way of the step. */
static hystgen_real_t hystgen_moved(unsigned int i, hystgen_real_t q, hystgen_real_t before,
                                    hystgen_real_t w)
{
    const hystgen_real_t way = w > before ? w - before : before - w;
    const hystgen_real_t threshold = hystgen_play.threshold[i] + hystgen_wider[i] * way;
    const hystgen_real_t low = w - threshold;
    const hystgen_real_t high = w + threshold;
    const hystgen_real_t upper = q > high ? high : q;
    return upper < low ? low : upper;
}

/* Where play i comes to rest from z with its input held at w. */
static hystgen_real_t hystgen_left(unsigned int i, hystgen_real_t z, hystgen_real_t w)
{
    (void)i;
    (void)w;
    return z;
}
