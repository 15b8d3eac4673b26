#include "hystgen_runtime.h"

/* Play i once the input of the plays has gone to w. */
static hystgen_real_t hystgen_moved(unsigned int i, const hystgen_real_t *play, hystgen_real_t w)
{
    const hystgen_real_t low = w - hystgen_play.threshold[i];
    const hystgen_real_t high = w + hystgen_play.threshold[i];
    const hystgen_real_t upper = play[i] > high ? high : play[i];
    return upper < low ? low : upper;
}

/* Where play i comes to rest from z with its input held at w. */
static hystgen_real_t hystgen_left(unsigned int i, hystgen_real_t z, hystgen_real_t w)
{
    (void)i;
    (void)w;
    return z;
}
