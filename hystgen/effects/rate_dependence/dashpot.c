/* Plays with a nonlinear dashpot. During a step the input is taken as standing still at a point of
   its move; a table (hystgen_yield) gives the part of its stretch that a play gains in this time. A
   second row after the plays holds the rounding remainder of each play, so that none stops short of
   its rest value. Called by compensator/chain/moving_plays.c. */
#ifndef HYSTGEN_RATE_DEPENDENCE_DASHPOT_C
#define HYSTGEN_RATE_DEPENDENCE_DASHPOT_C
#include "compensator/chain/model.h"
#include "effects/rate_dependence/yield.c"

/* The input taken as standing still during the move to w. */
static inline hystgen_play_t hystgen_standing(const hystgen_play_t *play, hystgen_play_t w) {
    return (hystgen_play_t)(play[0] + hystgen_standing_way((hystgen_sum_t)w - play[0]));
}

/* The move of play i, as a yield, with the input of the plays standing still. */
HYSTGEN_APART_IN_FIXED hystgen_sum_t hystgen_change(unsigned int i, const hystgen_play_t *play,
                                                    hystgen_play_t standing) {
    const hystgen_sum_t x = (hystgen_sum_t)standing - play[i];
    const hystgen_sum_t lost = play[HYSTGEN_N_PLAYS + i];
    const hystgen_sum_t on = (x < 0 ? -x : x) - hystgen_model_tables.threshold[i];
    if (on > 0) {
        const hystgen_sum_t gained = hystgen_yield(on);
        return x < 0 ? lost - gained : lost + gained;
    }
    return lost;
}

/* Play i after a move by a yield. */
static inline hystgen_play_t hystgen_gone(unsigned int i, const hystgen_play_t *play,
                                          hystgen_sum_t yield) {
    return (hystgen_play_t)(play[i] + hystgen_moved_by(yield));
}

/* Play i after the input of the plays has moved to w. */
static inline hystgen_play_t hystgen_moved(unsigned int i, const hystgen_play_t *play,
                                           hystgen_play_t w) {
    return hystgen_gone(i, play, hystgen_change(i, play, hystgen_standing(play, w)));
}

/* The present values of the plays are their rest values: plays creep on only in the next steps. */
static inline void hystgen_relax(hystgen_play_t *play, hystgen_sum_t *bent) {
    (void)play;
    (void)bent;
}

/* Play i moves while the input of the plays moves to w. */
HYSTGEN_APART_IN_FLOAT void hystgen_move(unsigned int i, hystgen_play_t *play, hystgen_play_t w) {
    const hystgen_sum_t yield = hystgen_change(i, play, hystgen_standing(play, w));
    const hystgen_play_t z = hystgen_gone(i, play, yield);
    const hystgen_sum_t lost = yield - hystgen_yield_of((hystgen_sum_t)z - play[i]);
    play[HYSTGEN_N_PLAYS + i] = (hystgen_play_t)lost;
    play[i] = z;
}

/* Play i rests at z. */
static void hystgen_put(unsigned int i, hystgen_play_t *play, hystgen_play_t z) {
    play[HYSTGEN_N_PLAYS + i] = 0;
    play[i] = z;
}

#endif
