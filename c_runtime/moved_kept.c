#include "hystgen_runtime.h"

/* Play i moves while the input of the plays goes to w, and comes to rest at z. */
static void hystgen_keep(unsigned int i, hystgen_play_t *play, hystgen_play_t w, hystgen_play_t z) {
    (void)w;
    play[i] = z;
}

/* Play i rests at z. */
static void hystgen_put(unsigned int i, hystgen_play_t *play, hystgen_play_t z) {
    play[i] = z;
}
