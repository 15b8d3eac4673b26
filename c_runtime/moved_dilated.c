#include "hystgen_runtime.h"

/* Play i after the input of the plays has gone to w; thresholds grow with the size of the step. */
static hystgen_play_t hystgen_moved(unsigned int i, const hystgen_play_t *play, hystgen_play_t w) {
    const hystgen_sum_t way = w > play[0] ? (hystgen_sum_t)w - play[0] : (hystgen_sum_t)play[0] - w;
    return hystgen_drawn(
        play[i], w, hystgen_model_tables.threshold[i] + hystgen_share_of(way, &hystgen_wider[i]));
}

/* Where the plays are is where they rest. */
static inline void hystgen_relax(hystgen_play_t *play, hystgen_sum_t *bent) {
    (void)play;
    (void)bent;
}
