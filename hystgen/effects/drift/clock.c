/* Drift over the time since the clock was started. In floating point samples are counted: `low`
   counts exactly up to `carry`, 2^24; `high` counts the carries. In fixed point the drift is a sum
   of the change in each sample, as a whole part in units of signals and a fraction below. Called by
   the functions that emission writes for a chain, see compensator/chain/model.h. */
#include "compensator/chain/model.h"

#ifdef HYSTGEN_FIXED
static void hystgen_clock_start(hystgen_clock_t *self) {
    self->whole = 0;
    self->part = 0;
    self->gained = 0;
    self->count = 0;
}

/* Advances by one sample. */
static void hystgen_clock_tick(const hystgen_clock_table_t *t, hystgen_clock_t *self) {
    if (self->count < t->samples) {
        const int64_t part = self->part + t->slope + self->gained;
        const int64_t whole = part >> t->bits;
        self->whole += whole;
        self->part = part - whole * ((int64_t)1 << t->bits);
        self->gained += t->change;
        ++self->count;
    }
}
#else
static void hystgen_clock_start(hystgen_clock_t *self) {
    self->high = 0;
    self->low = 0;
}

/* Advances by one sample. */
static void hystgen_clock_tick(const hystgen_clock_table_t *t, hystgen_clock_t *self) {
    const hystgen_real_t next = self->low + 1;
    const bool full = next >= t->carry;
    self->low = full ? 0 : next;
    self->high = full ? self->high + 1 : self->high;
}
#endif

/* The drift `ahead` samples after the present one, limited to +-`farthest`. */
static hystgen_signal_t hystgen_clock_drift(const hystgen_clock_table_t *t,
                                            const hystgen_clock_t *self, hystgen_signal_t ahead) {
#ifdef HYSTGEN_FIXED
    const int64_t more = (t->slope + self->gained) * ahead + t->change * (ahead * (ahead - 1) / 2);
    const int64_t drift = self->whole + ((self->part + more) >> t->bits);
#else
    const hystgen_real_t time = self->high * t->block + (self->low + ahead) * t->sample;
    const hystgen_real_t drift = (t->rate + t->half_change * time) * time;
#endif
    if (drift > t->farthest) {
        return t->farthest;
    }
    if (drift < -t->farthest) {
        return -t->farthest;
    }
    return drift;
}
