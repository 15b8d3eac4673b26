#include "hystgen_runtime.h"

/* What play i contributes once the input of the plays has gone to w. */
static inline hystgen_sum_t hystgen_value(unsigned int i, const hystgen_play_t *play,
                                          const hystgen_sum_t *bent, hystgen_play_t w) {
    return hystgen_contributed(i, play, bent, hystgen_reached(i, play, w));
}
