#include "hystgen_runtime.h"

/* Play i after the input of the plays has gone to w; thresholds grow with the size of the step. */
static hystgen_sum_t hystgen_moved(unsigned int i, const hystgen_play_t *play, hystgen_sum_t w) {
    const hystgen_sum_t way = w > play[0] ? w - play[0] : play[0] - w;
    const hystgen_sum_t threshold =
        hystgen_model_tables.threshold[i] + hystgen_share_of(way, &hystgen_wider[i]);
    const hystgen_sum_t low = w - threshold;
    const hystgen_sum_t high = w + threshold;
    const hystgen_sum_t upper = play[i] > high ? high : play[i];
    return upper < low ? low : upper;
}

/* Where play i comes to rest from z with its input held at w. */
static hystgen_sum_t hystgen_left(unsigned int i, hystgen_sum_t z, hystgen_sum_t w) {
    (void)i;
    (void)w;
    return z;
}
