#include "hystgen_runtime.h"

/* The part of x beyond +-r. */
static hystgen_real_t hystgen_beyond(hystgen_real_t x, hystgen_real_t r)
{
    return x > r ? x - r : x < -r ? x + r : 0;
}

/* Viscous play i, kept as where it would come to rest, once the input of the plays has gone to w:
   it gains a share of what it is stretched by. Exact while it slides or rests; where contact begins
   or ends inside a step, it does so at the first touch. */
static hystgen_real_t hystgen_moved(unsigned int i, const hystgen_real_t *play, hystgen_real_t w)
{
    return play[i] + hystgen_late[i] * hystgen_beyond(w - play[i], hystgen_play.threshold[i]);
}

/* Where play i comes to rest from z with its input held at w, as far as one more step goes. */
static hystgen_real_t hystgen_left(unsigned int i, hystgen_real_t z, hystgen_real_t w)
{
    return z + hystgen_kept[i] * hystgen_beyond(w - z, hystgen_play.threshold[i]);
}
