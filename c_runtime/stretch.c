#include "hystgen_runtime.h"

/* The part of x beyond +-r. */
static hystgen_sum_t hystgen_stretch(hystgen_sum_t x, hystgen_play_t r) {
    return x > r ? x - r : x < -r ? x + r : 0;
}
