#include "hystgen_runtime.h"

/* Plays with a nonlinear dashpot. In a step the input counts as if it stood still part of the way;
   a table (hystgen_yield) gives what a play gains of its stretch in that time. A second row behind
   the plays holds what rounding took from each, so that none stops short of where it creeps to. */

/* How far play i moves while the input of the plays goes to w, as a yield. */
static hystgen_sum_t hystgen_change(unsigned int i, const hystgen_play_t *play, hystgen_sum_t w) {
    const hystgen_play_t r = hystgen_model_tables.threshold[i];
    const hystgen_sum_t x = play[0] + hystgen_seen(w - play[0]) - play[i];
    const hystgen_sum_t gained = x > r ? hystgen_yield(x - r) : x < -r ? -hystgen_yield(-x - r) : 0;
    return gained + play[HYSTGEN_N_PLAYS + i];
}

/* Play i once the input of the plays has gone to w. */
static hystgen_sum_t hystgen_moved(unsigned int i, const hystgen_play_t *play, hystgen_sum_t w) {
    return play[i] + hystgen_moved_by(hystgen_change(i, play, w));
}

/* Where play i, now at z, counts as resting: at z, since it only creeps on in the next steps. */
static hystgen_sum_t hystgen_left(unsigned int i, hystgen_sum_t z, hystgen_sum_t w) {
    (void)i;
    (void)w;
    return z;
}

/* Play i moves to z while the input of the plays goes to w. */
static void hystgen_keep(unsigned int i, hystgen_play_t *play, hystgen_play_t w, hystgen_sum_t z) {
    const hystgen_sum_t lost = hystgen_change(i, play, w) - hystgen_yield_of(z - play[i]);
    play[HYSTGEN_N_PLAYS + i] = (hystgen_play_t)lost;
    play[i] = (hystgen_play_t)z;
}

/* Play i rests at z. */
static void hystgen_put(unsigned int i, hystgen_play_t *play, hystgen_sum_t z) {
    play[HYSTGEN_N_PLAYS + i] = 0;
    play[i] = (hystgen_play_t)z;
}
