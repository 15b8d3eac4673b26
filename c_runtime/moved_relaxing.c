#include "hystgen_runtime.h"

/* The part of x beyond +-r. */
static hystgen_real_t hystgen_beyond(hystgen_real_t x, hystgen_real_t r)
{
    return x > r ? x - r : x < -r ? x + r : 0;
}

/* Viscous play i that would come to rest at q, once its input has gone from `before` to w: it gains
   a share of what it is stretched by. Exact while it slides or rests; where contact begins or ends
   inside a step, it does so at the first touch. */
static hystgen_real_t hystgen_moved(unsigned int i, hystgen_real_t q, hystgen_real_t before,
                                    hystgen_real_t w)
{
    (void)before;
    return q + hystgen_late[i] * hystgen_beyond(w - q, hystgen_play.threshold[i]);
}

/* Where play i comes to rest from z with its input held at w, as far as one more step goes. */
static hystgen_real_t hystgen_left(unsigned int i, hystgen_real_t z, hystgen_real_t w)
{
    return z + hystgen_kept[i] * hystgen_beyond(w - z, hystgen_play.threshold[i]);
}
