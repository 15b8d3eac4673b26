#include "hystgen_runtime.h"

/* Play i after the input of the plays has gone to w. */
static hystgen_play_t hystgen_moved(unsigned int i, const hystgen_play_t *play, hystgen_play_t w) {
    return hystgen_drawn(play[i], w, hystgen_model_tables.threshold[i]);
}

/* Where the plays are is where they rest. */
static inline void hystgen_relax(hystgen_play_t *play, hystgen_sum_t *bent) {
    (void)play;
    (void)bent;
}
