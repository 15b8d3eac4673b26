#include "hystgen_runtime.h"

/* The part of x beyond +-r. */
static hystgen_sum_t hystgen_stretch(hystgen_sum_t x, hystgen_play_t r) {
    if (x > r) {
        return x - r;
    }
    if (x < -r) {
        return x + r;
    }
    return 0;
}
