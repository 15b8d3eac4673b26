#include "hystgen_runtime.h"

/* The delayed drive: the oldest sample and HYSTGEN_WAITED of the step to the next one. */
static hystgen_reach_t hystgen_delayed(const hystgen_real_t *sample, unsigned int oldest) {
    const hystgen_real_t v = sample[oldest];
    return v + HYSTGEN_WAITED * (sample[hystgen_delay_next(oldest)] - v);
}
