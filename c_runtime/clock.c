#include "hystgen_runtime.h"

/* Drift over the time since the clock was started, counted in samples: `low` counts exactly up to
   `carry`, 2^24; `high` counts how often it got there. */

static void hystgen_clock_start(hystgen_clock_t *self) {
    self->high = 0;
    self->low = 0;
}

/* One sample later. */
static void hystgen_clock_tick(const hystgen_clock_table_t *t, hystgen_clock_t *self) {
    const hystgen_real_t next = self->low + 1;
    const bool full = next >= t->carry;
    self->low = full ? 0 : next;
    self->high = full ? self->high + 1 : self->high;
}

/* The drift `ahead` samples after the present one, limited to +-`farthest`. */
static hystgen_real_t hystgen_clock_drift(const hystgen_clock_table_t *t,
                                          const hystgen_clock_t *self, hystgen_real_t ahead) {
    const hystgen_real_t time = self->high * t->block + (self->low + ahead) * t->sample;
    const hystgen_real_t drift = (t->rate + t->half_change * time) * time;
    if (drift > t->farthest) {
        return t->farthest;
    }
    if (drift < -t->farthest) {
        return -t->farthest;
    }
    return drift;
}
