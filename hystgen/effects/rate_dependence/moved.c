/* The move of a play: viscous, with thresholds that grow with the step, or plain. Called by
   chain/moving_plays.c. */
#ifndef HYSTGEN_RATE_DEPENDENCE_MOVED_C
#define HYSTGEN_RATE_DEPENDENCE_MOVED_C
#include "compensator/chain/model.h"
#include "effects/rate_dependence/stretch.c"
#include "compensator/chain/signals.c"
#define HYSTGEN_ASKS_BENDS
#include "effects/catalogue.h"

#ifdef HYSTGEN_HAS_RELAXING_PLAYS
/* Viscous play i after the input of the plays has moved to w. The state of a play is its rest
   value; the play gains a share of its stretch. Exact while the play slides or rests; contact that
   begins or ends within a step counts from the first touch. */
static hystgen_play_t hystgen_moved(unsigned int i, const hystgen_play_t *play, hystgen_play_t x,
                                    hystgen_play_t w) {
    (void)x;
    const hystgen_sum_t on =
        hystgen_stretch((hystgen_sum_t)w - play[i], hystgen_model_tables.threshold[i]);
    return (hystgen_play_t)(play[i] + hystgen_share_of(on, &hystgen_late[i]));
}

#ifndef HYSTGEN_FIXED
/* Whether play i moves while its input moves to w, or comes to rest there. Sets the value it
   reaches, and its share of a further change of w. */
HYSTGEN_APART_IF_MOVED bool hystgen_tried(const hystgen_inverse_t *self, hystgen_attempt_t *at,
                                          unsigned int i) {
    const hystgen_real_t *play = self->play;
    const hystgen_real_t w = at->input;
    const hystgen_real_t on = hystgen_stretch(w - play[i], hystgen_model_tables.threshold[i]);
    at->share = self->moving ? hystgen_late[i] : 1;
    at->reached = play[i] + on * at->share;
    return on < 0 || on > 0;
}
#endif

/* Updates the plays to their rest values with the input held, as of one step later. */
HYSTGEN_APART void hystgen_relax(hystgen_play_t *play, hystgen_sum_t *bent) {
    unsigned int i;
    HYSTGEN_ROLLED
    for (i = 1; i <= HYSTGEN_N_PLAYS; ++i) {
        const hystgen_sum_t on =
            hystgen_stretch((hystgen_sum_t)play[0] - play[i], hystgen_model_tables.threshold[i]);
        const hystgen_play_t rest =
            (hystgen_play_t)(play[i] + hystgen_share_of(on, &hystgen_kept[i]));
        if (rest < play[i] || rest > play[i]) {
            play[i] = rest;
            hystgen_bent_anew(i, rest, bent);
        }
    }
}
#else
/* Threshold of play i in a step, which grows with its size `way`, or does not. */
static inline hystgen_sum_t hystgen_widened(unsigned int i, hystgen_sum_t way) {
#ifdef HYSTGEN_HAS_DILATED_PLAYS
    return hystgen_model_tables.threshold[i] + hystgen_share_of(way, &hystgen_wider[i]);
#else
    (void)way;
    return hystgen_model_tables.threshold[i];
#endif
}

/* Play i after the input of the plays has moved from x to w. */
static hystgen_play_t hystgen_moved(unsigned int i, const hystgen_play_t *play, hystgen_play_t x,
                                    hystgen_play_t w) {
#ifdef HYSTGEN_FIXED
    const uint32_t way = (uint32_t)(w > x ? (hystgen_sum_t)w - x : (hystgen_sum_t)x - w);
    if (hystgen_drawn(play[i], w, hystgen_model_tables.threshold[i]) == play[i]) {
        return play[i]; /* nor does a larger threshold move it */
    }
#else
    const hystgen_sum_t way = w > x ? w - x : x - w;
#endif
    return hystgen_drawn(play[i], w, hystgen_widened(i, way));
}

#ifndef HYSTGEN_FIXED
/* Whether play i moves while its input moves to w, or comes to rest there. Sets the value it
   reaches, and its share of a further change of w, which is less than all of it while the band
   around w grows in this direction and more while it shrinks. */
HYSTGEN_APART_IF_MOVED bool hystgen_tried(const hystgen_inverse_t *self, hystgen_attempt_t *at,
                                          unsigned int i) {
    const hystgen_real_t *play = self->play;
    const hystgen_real_t w = at->input;
#ifdef HYSTGEN_HAS_DILATED_PLAYS
    const hystgen_real_t way = self->moving ? w - play[0] : 0;
    const hystgen_real_t side = way < 0 ? -1 : 1;
    const hystgen_real_t grows = self->moving ? side : 0;
    const hystgen_real_t r = hystgen_widened(i, way < 0 ? -way : way);
    if (w - r > play[i]) {
        at->reached = w - r;
        at->share = 1 - grows * hystgen_wider[i];
        return true;
    }
    at->reached = w + r;
    at->share = 1 + grows * hystgen_wider[i];
#else
    const hystgen_real_t r = hystgen_model_tables.threshold[i];
    at->share = 1;
    if (w - r > play[i]) {
        at->reached = w - r;
        return true;
    }
    at->reached = w + r;
#endif
    return w + r < play[i];
}
#endif
#endif

#endif
