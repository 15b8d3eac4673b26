#include "hystgen_runtime.h"

/* What play i contributes once the input of the plays has gone to w, apart from their sum, to need
   less of the stack. */
HYSTGEN_APART hystgen_sum_t hystgen_value(unsigned int i, const hystgen_play_t *play,
                                          const hystgen_sum_t *bent, hystgen_play_t w) {
    return hystgen_contributed(i, play, bent, hystgen_reached(i, play, w));
}
