/* Plays with a nonlinear dashpot. During a step the input is taken as standing still at a point of
   its move; a table (hystgen_yield) gives the part of its stretch that a play gains in this time. A
   second row after the plays holds the rounding remainder of each play, so that none stops short of
   its rest value. Called by compensator/chain/moving_plays.c. */
#ifndef HYSTGEN_RATE_DEPENDENCE_DASHPOT_C
#define HYSTGEN_RATE_DEPENDENCE_DASHPOT_C
#include "compensator/chain/model.h"
#include "effects/rate_dependence/yield.c"

/* The input taken as standing still during the move from x to w. */
static inline hystgen_play_t hystgen_standing(hystgen_play_t x, hystgen_play_t w) {
    return (hystgen_play_t)(x + hystgen_standing_way((hystgen_sum_t)w - x));
}

/* The move of play i, as a yield, with the input of the plays standing still. Sets `slope` to its
   change with that input, unless it is 0. */
HYSTGEN_APART_IN_FIXED hystgen_sum_t hystgen_change(unsigned int i, const hystgen_play_t *play,
                                                    hystgen_play_t standing, hystgen_sum_t *slope) {
    const hystgen_sum_t x = (hystgen_sum_t)standing - play[i];
    const hystgen_sum_t lost = play[HYSTGEN_N_PLAYS + i];
    const hystgen_sum_t on = (x < 0 ? -x : x) - hystgen_model_tables.threshold[i];
    if (on > 0) {
        const hystgen_sum_t gained = hystgen_yield(on, slope);
        return x < 0 ? lost - gained : lost + gained;
    }
    return lost;
}

/* Play i after a move by a yield. */
static inline hystgen_play_t hystgen_gone(unsigned int i, const hystgen_play_t *play,
                                          hystgen_sum_t yield) {
    return (hystgen_play_t)(play[i] + hystgen_moved_by(yield));
}

/* Play i after the input of the plays has moved from x to w. */
static inline hystgen_play_t hystgen_moved(unsigned int i, const hystgen_play_t *play,
                                           hystgen_play_t x, hystgen_play_t w) {
    hystgen_sum_t slope = 0;
    return hystgen_gone(i, play, hystgen_change(i, play, hystgen_standing(x, w), &slope));
}

#ifndef HYSTGEN_FIXED
/* The same, from where it is; `steep`: the play's change with w, times its weight. */
static inline hystgen_real_t hystgen_tried(unsigned int i, const hystgen_real_t *play,
                                           hystgen_real_t w, hystgen_real_t *steep) {
    hystgen_real_t slope = 0;
    const hystgen_real_t yield = hystgen_change(i, play, hystgen_standing(play[0], w), &slope);
    *steep = hystgen_model_tables.weight[i] * HYSTGEN_STANDING_SHARE * slope;
    return hystgen_gone(i, play, yield);
}
#endif

/* Play i moves while the input of the plays moves from x to w. */
HYSTGEN_APART_IN_FLOAT void hystgen_move(unsigned int i, hystgen_play_t *play, hystgen_play_t x,
                                         hystgen_play_t w) {
    hystgen_sum_t slope = 0;
    const hystgen_sum_t yield = hystgen_change(i, play, hystgen_standing(x, w), &slope);
    const hystgen_play_t z = hystgen_gone(i, play, yield);
    const hystgen_sum_t lost = yield - hystgen_yield_of((hystgen_sum_t)z - play[i]);
    play[HYSTGEN_N_PLAYS + i] = (hystgen_play_t)lost;
    play[i] = z;
}

/* Play i rests at z. A store through volatile, or gcc would call memset for all plays. */
static void hystgen_put(unsigned int i, hystgen_play_t *play, hystgen_play_t z) {
    volatile hystgen_play_t *lost = &play[HYSTGEN_N_PLAYS + i];
    *lost = 0;
    play[i] = z;
}

#endif
