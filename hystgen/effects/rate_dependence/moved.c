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
static hystgen_play_t hystgen_moved(unsigned int i, const hystgen_play_t *play, hystgen_play_t w) {
    const hystgen_sum_t on =
        hystgen_stretch((hystgen_sum_t)w - play[i], hystgen_model_tables.threshold[i]);
    return (hystgen_play_t)(play[i] + hystgen_share_of(on, &hystgen_late[i]));
}

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
            bent[i] = hystgen_bent(i, rest);
        }
    }
}
#elif defined(HYSTGEN_HAS_DILATED_PLAYS)
/* Play i after the input of the plays has moved to w; thresholds grow with the size of the step. */
static hystgen_play_t hystgen_moved(unsigned int i, const hystgen_play_t *play, hystgen_play_t w) {
    const hystgen_sum_t way = w > play[0] ? (hystgen_sum_t)w - play[0] : (hystgen_sum_t)play[0] - w;
    return hystgen_drawn(
        play[i], w, hystgen_model_tables.threshold[i] + hystgen_share_of(way, &hystgen_wider[i]));
}

/* The present values of the plays are their rest values. */
static inline void hystgen_relax(hystgen_play_t *play, hystgen_sum_t *bent) {
    (void)play;
    (void)bent;
}
#else
/* Play i after the input of the plays has moved to w. */
static hystgen_play_t hystgen_moved(unsigned int i, const hystgen_play_t *play, hystgen_play_t w) {
    return hystgen_drawn(play[i], w, hystgen_model_tables.threshold[i]);
}

/* The present values of the plays are their rest values. */
static inline void hystgen_relax(hystgen_play_t *play, hystgen_sum_t *bent) {
    (void)play;
    (void)bent;
}
#endif

#endif
