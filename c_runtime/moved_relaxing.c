#include "hystgen_runtime.h"

/* Viscous play i, kept as where it would come to rest, once the input of the plays has gone to w:
   it gains a share of what it is stretched by. Exact while it slides or rests; where contact begins
   or ends inside a step, it does so at the first touch. */
static hystgen_sum_t hystgen_moved(unsigned int i, const hystgen_play_t *play, hystgen_sum_t w) {
    const hystgen_sum_t on = hystgen_stretch(w - play[i], hystgen_model_tables.threshold[i]);
    return play[i] + hystgen_share_of(on, &hystgen_late[i]);
}

/* Where play i comes to rest from z with its input held at w, as far as one more step goes. */
static hystgen_sum_t hystgen_left(unsigned int i, hystgen_sum_t z, hystgen_sum_t w) {
    const hystgen_sum_t on = hystgen_stretch(w - z, hystgen_model_tables.threshold[i]);
    return z + hystgen_share_of(on, &hystgen_kept[i]);
}
