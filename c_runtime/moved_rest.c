#include "hystgen_runtime.h"

/* Play i at rest with its input at w. */
static hystgen_play_t hystgen_resting(unsigned int i, const hystgen_play_t *play,
                                      hystgen_play_t w) {
    return hystgen_drawn(play[i], w, hystgen_model_tables.threshold[i]);
}
