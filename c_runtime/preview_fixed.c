#include "hystgen_runtime.h"

/* The output to reach at this sample: the weighted sum of the line. */
static int64_t hystgen_preview_target(const hystgen_factor_t *tap, const int64_t *line) {
    int64_t sum = 0;
    unsigned int i;
    for (i = 0; i < HYSTGEN_TAPS; ++i) {
        sum += hystgen_times(line[i], &tap[i]);
    }
    return sum;
}
