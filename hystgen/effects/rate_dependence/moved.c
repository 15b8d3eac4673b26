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
/* The same; `steep`: the play's change with w, times its weight. */
static inline hystgen_real_t hystgen_tried(unsigned int i, const hystgen_real_t *play,
                                           hystgen_real_t w, hystgen_real_t *steep) {
    const hystgen_real_t on = hystgen_stretch(w - play[i], hystgen_model_tables.threshold[i]);
    const hystgen_real_t weight = hystgen_model_tables.weight[i];
    *steep = on < 0 || on > 0 ? hystgen_share_of(weight, &hystgen_late[i]) : 0;
    return play[i] + hystgen_share_of(on, &hystgen_late[i]);
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
            (void)hystgen_bent_anew(i, rest, bent);
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
/* The same, from where it is; `steep`: the play's change with w, times its weight, which is less
   while the band around w grows in this direction and more while it shrinks. */
static inline hystgen_real_t hystgen_tried(unsigned int i, const hystgen_real_t *play,
                                           hystgen_real_t w, hystgen_real_t *steep) {
    const hystgen_real_t way = w - play[0];
    const hystgen_real_t r = hystgen_widened(i, way > 0 ? way : -way);
    const hystgen_real_t weight = hystgen_model_tables.weight[i];
#ifdef HYSTGEN_HAS_DILATED_PLAYS
    const hystgen_real_t wider = hystgen_share_of(weight, &hystgen_wider[i]);
#else
    const hystgen_real_t wider = 0;
#endif
    if (play[i] <= w - r) {
        *steep = way >= 0 ? weight - wider : weight + wider;
        return w - r;
    }
    if (play[i] >= w + r) {
        *steep = way > 0 ? weight + wider : weight - wider;
        return w + r;
    }
    *steep = 0;
    return play[i];
}
#endif
#endif

#endif
