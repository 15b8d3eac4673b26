#include "hystgen_runtime.h"

/* Gain and offset by the actuator's own heat, which follows from the applied drives. */

static void hystgen_heat_init(hystgen_heat_t *self) {
    self->high = 0;
    self->low = 0;
    self->gain = 1;
    self->inverse = 1;
    self->offset = 0;
}

/* How far the square of the drive, with its sign, has moved. */
static hystgen_real_t hystgen_heat_way(hystgen_real_t before, hystgen_real_t v) {
    const hystgen_real_t to = v >= 0 ? v * v : -(v * v);
    const hystgen_real_t from = before >= 0 ? before * before : -(before * before);
    const hystgen_real_t way = to - from;
    return way >= 0 ? way : -way;
}

/* The drive has moved, by an amount of what warms. Newton steps update the reciprocal of the
   gain. */
static void hystgen_heat_move(const hystgen_heat_table_t *t, hystgen_heat_t *self,
                              hystgen_real_t amount) {
    const hystgen_real_t high = self->high;
    const hystgen_real_t change = (t->per_amount * amount - t->rate * high) + self->low;
    const hystgen_real_t next = high + change;
    const hystgen_real_t rise = next > t->hottest ? t->hottest : next;
    unsigned int i;
    self->high = next;
    self->low = change - (next - high); /* what rounding took from the sum */
    self->gain = 1 + t->per_degree * rise;
    self->offset = t->offset_per_degree * rise;
    for (i = 0; i < t->turns; ++i) {
        self->inverse = self->inverse * (2 - self->gain * self->inverse);
    }
}

/* The input that gives the output y. */
static hystgen_real_t hystgen_heat_solve(const hystgen_heat_t *self, hystgen_real_t y) {
    return (y - self->offset) * self->inverse;
}

/* The output for the input x. */
static hystgen_real_t hystgen_heat_absorb(const hystgen_heat_t *self, hystgen_real_t x) {
    return self->gain * x + self->offset;
}
