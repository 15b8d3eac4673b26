#include "hystgen_runtime.h"

/* Play i once the input of the plays has gone to w; thresholds grow with the way of the step. */
static int64_t hystgen_moved(unsigned int i, const hystgen_play_t *play, int64_t w) {
    const int64_t way = w > play[0] ? w - play[0] : play[0] - w;
    const int64_t threshold =
        hystgen_model_tables.threshold[i] + hystgen_times(way, &hystgen_wider[i]);
    const int64_t low = w - threshold;
    const int64_t high = w + threshold;
    const int64_t upper = play[i] > high ? high : play[i];
    return upper < low ? low : upper;
}

/* Where play i comes to rest from z with its input held at w. */
static int64_t hystgen_left(unsigned int i, int64_t z, int64_t w) {
    (void)i;
    (void)w;
    return z;
}
