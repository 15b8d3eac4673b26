#include "hystgen_runtime.h"

/* The delayed drive, to the nearest code. */
static hystgen_reach_t hystgen_delayed(const hystgen_real_t *sample, unsigned int oldest) {
    const hystgen_reach_t v = sample[oldest];
    const int64_t change = (int64_t)sample[hystgen_delay_next(oldest)] - v;
    return v + (hystgen_reach_t)hystgen_times(change, &hystgen_waited);
}
