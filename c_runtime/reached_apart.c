#include "hystgen_runtime.h"

/* Play i after the input of the plays has gone to w, apart from what it contributes there, to need
   less of the stack. */
HYSTGEN_APART hystgen_play_t hystgen_reached(unsigned int i, const hystgen_play_t *play,
                                             hystgen_play_t w) {
    return hystgen_moved(i, play, w);
}
