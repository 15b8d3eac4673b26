#include "hystgen_runtime.h"

/* The output to reach at this sample: the weighted sum of the line. */
static hystgen_real_t hystgen_preview_target(const hystgen_real_t *tap,
                                             const hystgen_real_t *line) {
    hystgen_real_t sum = tap[0] * line[0];
    unsigned int i;
    for (i = 1; i < HYSTGEN_TAPS; ++i) {
        sum = sum + tap[i] * line[i];
    }
    return sum;
}
