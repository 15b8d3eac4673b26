#include "hystgen_runtime.h"

/* Play i moves while the input of the plays goes to w. */
static void hystgen_move(unsigned int i, hystgen_play_t *play, hystgen_play_t w) {
    play[i] = hystgen_reached(i, play, w);
}

/* Play i rests at z. */
static void hystgen_put(unsigned int i, hystgen_play_t *play, hystgen_play_t z) {
    play[i] = z;
}
