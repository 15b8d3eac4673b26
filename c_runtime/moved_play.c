#include "hystgen_runtime.h"

/* Play i after the input of the plays has gone to w. */
static hystgen_sum_t hystgen_moved(unsigned int i, const hystgen_play_t *play, hystgen_sum_t w) {
    const hystgen_sum_t low = w - hystgen_model_tables.threshold[i];
    const hystgen_sum_t high = w + hystgen_model_tables.threshold[i];
    const hystgen_sum_t upper = play[i] > high ? high : play[i];
    return upper < low ? low : upper;
}

/* Where play i comes to rest from z with its input held at w. */
static hystgen_sum_t hystgen_left(unsigned int i, hystgen_sum_t z, hystgen_sum_t w) {
    (void)i;
    (void)w;
    return z;
}
