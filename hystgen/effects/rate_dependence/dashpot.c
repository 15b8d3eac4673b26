/* Plays with a nonlinear dashpot. During a step the input is taken as standing still at a point of
   its move; a table (hystgen_yield) gives the part of its stretch that a play gains in this time. A
   second row after the plays holds the rounding remainder of each play, so that none stops short of
   its rest value. Called by compensator/chain/moving_plays.c. */
#ifndef HYSTGEN_RATE_DEPENDENCE_DASHPOT_C
#define HYSTGEN_RATE_DEPENDENCE_DASHPOT_C
#include "compensator/chain/model.h"
#include "compensator/chain/signals.c"
#include "effects/rate_dependence/yield.c"

/* The input taken as standing still during the move from x to w. */
static inline hystgen_play_t hystgen_standing(hystgen_play_t x, hystgen_play_t w) {
    return (hystgen_play_t)(x + hystgen_standing_way((hystgen_sum_t)w - x));
}

/* Play i after a move by a yield. */
static inline hystgen_play_t hystgen_gone(unsigned int i, const hystgen_play_t *play,
                                          hystgen_sum_t yield) {
    return (hystgen_play_t)(play[i] + hystgen_moved_by(yield));
}

#ifdef HYSTGEN_FIXED
/* The move of play i, as a yield, with the input of the plays standing still. */
HYSTGEN_APART int64_t hystgen_change(unsigned int i, const hystgen_play_t *play,
                                     hystgen_play_t standing) {
    const int64_t x = (int64_t)standing - play[i];
    const int64_t lost = play[HYSTGEN_N_PLAYS + i];
    const int64_t on = (x < 0 ? -x : x) - hystgen_model_tables.threshold[i];
    if (on > 0) {
        const int64_t gained = hystgen_yield(on);
        return x < 0 ? lost - gained : lost + gained;
    }
    return lost;
}

/* Play i after the input of the plays has moved from x to w. */
static inline hystgen_play_t hystgen_moved(unsigned int i, const hystgen_play_t *play,
                                           hystgen_play_t x, hystgen_play_t w) {
    return hystgen_gone(i, play, hystgen_change(i, play, hystgen_standing(x, w)));
}
#else
/* Whether play i is stretched with the input of the plays standing still. Sets its move, as a
   yield, and the change of this move with that input. */
static inline bool hystgen_stretched(unsigned int i, const hystgen_real_t *play,
                                     hystgen_real_t standing, hystgen_real_t *move,
                                     hystgen_real_t *slope) {
    const hystgen_real_t x = standing - play[i];
    const hystgen_real_t on = (x < 0 ? -x : x) - hystgen_model_tables.threshold[i];
    if (on > 0) {
        const hystgen_real_t lost = play[HYSTGEN_N_PLAYS + i];
        const hystgen_real_t gained = hystgen_yield(on, slope);
        *move = x < 0 ? lost - gained : lost + gained;
        return true;
    }
    return false;
}

/* Whether play i moves while its input moves to the one tried, or comes to rest there. Sets the
   value it reaches, and its share of a further change of the input. */
HYSTGEN_APART bool hystgen_tried(const hystgen_inverse_t *self, hystgen_attempt_t *at,
                                 unsigned int i) {
    const hystgen_real_t *play = self->play;
    hystgen_real_t move;
    hystgen_real_t slope;
    if (self->moving) {
        if (!hystgen_stretched(i, play, hystgen_standing(play[0], at->input), &move, &slope)) {
            return false;
        }
        at->reached = hystgen_gone(i, play, move);
        at->share = slope * HYSTGEN_STANDING_SHARE;
        return true;
    }
    at->reached = hystgen_drawn(play[i], at->input, hystgen_model_tables.threshold[i]);
    at->share = 1;
    return at->reached < play[i] || at->reached > play[i];
}
#endif

/* Play i moves while the input of the plays moves from x to w. Returns whether it does. */
HYSTGEN_APART_IN_FLOAT bool hystgen_move(unsigned int i, hystgen_play_t *play, hystgen_play_t x,
                                         hystgen_play_t w) {
#ifdef HYSTGEN_FIXED
    const int64_t yield = hystgen_change(i, play, hystgen_standing(x, w));
#else
    hystgen_real_t yield;
    hystgen_real_t slope;
    if (!hystgen_stretched(i, play, hystgen_standing(x, w), &yield, &slope)) {
        return false;
    }
#endif
    const hystgen_play_t z = hystgen_gone(i, play, yield);
    const hystgen_sum_t lost = yield - hystgen_yield_of((hystgen_sum_t)z - play[i]);
    play[HYSTGEN_N_PLAYS + i] = (hystgen_play_t)lost;
    play[i] = z;
    return true;
}

/* Play i rests at z. A store through volatile, or gcc would call memset for all plays. */
static void hystgen_put(unsigned int i, hystgen_play_t *play, hystgen_play_t z) {
    volatile hystgen_play_t *lost = &play[HYSTGEN_N_PLAYS + i];
    *lost = 0;
    play[i] = z;
}

#endif
