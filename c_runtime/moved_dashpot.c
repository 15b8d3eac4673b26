#include "hystgen_runtime.h"

/* Plays with a nonlinear dashpot. In a step the input counts as if it stood still at a share of its
   way; what a play gains of its stretch meanwhile is a table, cubic between its knots. Behind the
   plays stands what each has lost below its last bit: none stops short of where it creeps to. */

/* What a play that is stretched by x, not negative, gains of it in a step. */
static hystgen_real_t hystgen_yield(hystgen_real_t x)
{
    unsigned int low = 0;
    unsigned int high = HYSTGEN_YIELDS;
    while (high - low > 1u) {
        const unsigned int middle = (low + high) / 2;
        const bool before = x < hystgen_yields[middle][0];
        low = before ? low : middle;
        high = before ? middle : high;
    }
    const hystgen_real_t *c = hystgen_yields[low];
    const hystgen_real_t on = x - c[0];
    return ((c[4] * on + c[3]) * on + c[2]) * on + c[1];
}

/* How far play i moves while the input of the plays goes to w. */
static hystgen_real_t hystgen_change(unsigned int i, const hystgen_real_t *play, hystgen_real_t w)
{
    const hystgen_real_t r = hystgen_play.threshold[i];
    const hystgen_real_t x = play[0] + (w - play[0]) * HYSTGEN_SEEN - play[i];
    const hystgen_real_t gained = x > r    ? hystgen_yield(x - r)
                                  : x < -r ? -hystgen_yield(-x - r)
                                           : 0;
    return gained + play[HYSTGEN_N_PLAYS + i];
}

/* Play i once the input of the plays has gone to w. */
static hystgen_real_t hystgen_moved(unsigned int i, const hystgen_real_t *play, hystgen_real_t w)
{
    return play[i] + hystgen_change(i, play, w);
}

/* Where play i comes to rest from z with its input held at w: after a time, at z for now. */
static hystgen_real_t hystgen_left(unsigned int i, hystgen_real_t z, hystgen_real_t w)
{
    (void)i;
    (void)w;
    return z;
}

/* Play i has moved to z while the input of the plays goes to w. */
static void hystgen_keep(unsigned int i, hystgen_real_t *play, hystgen_real_t w, hystgen_real_t z)
{
    play[HYSTGEN_N_PLAYS + i] = hystgen_change(i, play, w) - (z - play[i]);
    play[i] = z;
}

/* Play i rests at z. */
static void hystgen_put(unsigned int i, hystgen_real_t *play, hystgen_real_t z)
{
    play[HYSTGEN_N_PLAYS + i] = 0;
    play[i] = z;
}
