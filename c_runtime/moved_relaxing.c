#include "hystgen_runtime.h"

/* Viscous play i after the input of the plays has gone to w. Its state is where it would come to
   rest; it gains a share of its stretch. Exact while it slides or rests; contact that begins or
   ends within a step counts from the first touch. */
static hystgen_play_t hystgen_moved(unsigned int i, const hystgen_play_t *play, hystgen_play_t w) {
    const hystgen_sum_t on =
        hystgen_stretch((hystgen_sum_t)w - play[i], hystgen_model_tables.threshold[i]);
    return (hystgen_play_t)(play[i] + hystgen_share_of(on, &hystgen_late[i]));
}

/* The plays go on to where they would come to rest with their input held, as seen one step
   later. */
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
