#include "hystgen_runtime.h"

/* Viscous plays, each with a time constant of its own, in fixed point; see moved_relaxing.c. */

/* Play i once the input of the plays has gone to w. */
static int64_t hystgen_moved(unsigned int i, const hystgen_play_t *play, int64_t w) {
    return play[i] +
           hystgen_stretched(w - play[i], hystgen_model_tables.threshold[i], &hystgen_late[i]);
}

/* Where play i comes to rest from z with its input held at w, as far as one more step goes. */
static int64_t hystgen_left(unsigned int i, int64_t z, int64_t w) {
    return z + hystgen_stretched(w - z, hystgen_model_tables.threshold[i], &hystgen_kept[i]);
}
