/* Operators of engine loop: plain plays solved for their input. The kernel sums them up again: a
   model without effects does not keep the sum, and in fixed point it lacks bits. Called by plays.c
   and by relaxing_plays.c. */
#ifndef HYSTGEN_CHAIN_PLAYS_SOLVE_C
#define HYSTGEN_CHAIN_PLAYS_SOLVE_C
#include "compensator/chain/model.h"
#include "compensator/chain/signals.c"

#if !defined(HYSTGEN_FIXED) && defined(HYSTGEN_CHAIN)
/* Input of the plays at which their sum is h; now it is `level`, which tells the direction. Assumes
   first that every play follows, then drops the largest thresholds one by one until the solution
   reaches the last play that is left, and goes no further than where the play dropped last would
   follow. */
static hystgen_reach_t hystgen_input_of(const hystgen_play_t *play, hystgen_signal_t level,
                                        hystgen_signal_t h) {
    const hystgen_tables_t *t = &hystgen_model_tables;
    const bool rising = h >= level;
    hystgen_sum_t tail = 0;
    hystgen_play_t next = 0; /* input at which play k would start to follow */
    unsigned int k;
    for (k = t->n + 1u; k > 0; --k) {
        const unsigned int last = k - 1u;
        const hystgen_play_t first =
            rising ? play[last] + t->threshold[last] : play[last] - t->threshold[last];
        const hystgen_reach_t w =
            (h - (rising ? tail - t->lift[k] : tail + t->lift[k])) * t->inverse_slope[k];
        if (rising ? w >= first : w <= first) {
            if (k <= t->n && (rising ? w > next : w < next)) {
                return next;
            }
            return w;
        }
        tail = tail + t->weight[last] * play[last];
        next = first;
    }
    return play[0]; /* h differs from the present sum only by rounding */
}
#else
/* Input of the plays at which their sum is h. */
static inline hystgen_reach_t hystgen_input_of(const hystgen_play_t *play, hystgen_signal_t level,
                                               hystgen_signal_t h) {
    (void)level;
    return hystgen_loop_solve(&hystgen_model_tables, play, hystgen_asked(h));
}
#endif

#endif
