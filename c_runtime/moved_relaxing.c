#include "hystgen_runtime.h"

/* Viscous play i after the input of the plays has gone to w. Its state is where it would come to
   rest; it gains a share of its stretch. Exact while it slides or rests; contact that begins or
   ends within a step counts from the first touch. */
static hystgen_play_t hystgen_moved(unsigned int i, const hystgen_play_t *play, hystgen_play_t w) {
    const hystgen_sum_t on =
        hystgen_stretch((hystgen_sum_t)w - play[i], hystgen_model_tables.threshold[i]);
    return (hystgen_play_t)(play[i] + hystgen_share_of(on, &hystgen_late[i]));
}

/* Where play i, now at z, would come to rest with its input held at w, as seen one step later. */
static hystgen_play_t hystgen_left(unsigned int i, hystgen_play_t z, hystgen_play_t w) {
    const hystgen_sum_t on =
        hystgen_stretch((hystgen_sum_t)w - z, hystgen_model_tables.threshold[i]);
    return (hystgen_play_t)(z + hystgen_share_of(on, &hystgen_kept[i]));
}
