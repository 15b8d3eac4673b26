/* Gain and offset from self-heating, which follows from the applied drives. In fixed point the
   temperature has as many bits as fit in 64, so that slow changes do not stall. Called by the
   functions that emission writes for a chain, see compensator/chain/model.h. */
#include "compensator/chain/model.h"
#ifdef HYSTGEN_FIXED
#include "arithmetic/factors.c"
#include "effects/gains.c"
#endif

#ifdef HYSTGEN_FIXED
static void hystgen_heat_init(hystgen_heat_t *self) {
    self->rise = 0;
    self->gain = (int32_t)HYSTGEN_GAIN_ONE;
    self->inverse = (int32_t)HYSTGEN_GAIN_ONE;
    self->offset = 0;
}

/* The signed square of a drive. */
static int64_t hystgen_heat_square(hystgen_real_t v) {
    const int64_t square = (int64_t)v * v;
    return v >= 0 ? square : -square;
}

/* Distance moved by the signed square of the drive. */
static int64_t hystgen_heat_way(hystgen_real_t before, hystgen_real_t v) {
    const int64_t way = hystgen_heat_square(v) - hystgen_heat_square(before);
    return way >= 0 ? way : -way;
}

/* Updates the temperature, gain and offset by the heating of a move of the drive. */
HYSTGEN_APART void hystgen_heat_move(const hystgen_heat_table_t *t, hystgen_heat_t *self,
                                     int64_t amount) {
    const int64_t size = hystgen_nearest(amount, t->coarse);
    const int64_t heat = hystgen_times(size, &t->per_amount) * ((int64_t)1 << t->lift);
    self->rise += heat - hystgen_times(self->rise >> t->drop, &t->rate);
    const int64_t warm = self->rise >> t->drop;
    const int64_t rise = warm > t->hottest ? t->hottest : warm;
    self->gain = hystgen_gain_inside(HYSTGEN_GAIN_ONE + hystgen_times(rise, &t->per_degree));
    self->offset = hystgen_times(rise, &t->offset_per_degree);
    self->inverse = hystgen_gain_followed(self->gain, self->inverse, t->turns);
}

/* The input for the output y. */
static int64_t hystgen_heat_solve(const hystgen_heat_t *self, int64_t y) {
    return hystgen_gain_times(y - self->offset, self->inverse);
}

/* The output for the input x. */
static int64_t hystgen_heat_absorb(const hystgen_heat_t *self, int64_t x) {
    return hystgen_gain_times(x, self->gain) + self->offset;
}
#else
static void hystgen_heat_init(hystgen_heat_t *self) {
    self->high = 0;
    self->low = 0;
    self->gain = 1;
    self->inverse = 1;
    self->offset = 0;
}

/* Distance moved by the signed square of the drive. */
static hystgen_real_t hystgen_heat_way(hystgen_real_t before, hystgen_real_t v) {
    const hystgen_real_t to = v >= 0 ? v * v : -(v * v);
    const hystgen_real_t from = before >= 0 ? before * before : -(before * before);
    const hystgen_real_t way = to - from;
    return way >= 0 ? way : -way;
}

/* Updates the temperature, gain and offset by the heating of a move of the drive. Newton steps
   update the reciprocal of the gain. */
static void hystgen_heat_move(const hystgen_heat_table_t *t, hystgen_heat_t *self,
                              hystgen_real_t amount) {
    const hystgen_real_t high = self->high;
    const hystgen_real_t change = (t->per_amount * amount - t->rate * high) + self->low;
    const hystgen_real_t next = high + change;
    const hystgen_real_t rise = next > t->hottest ? t->hottest : next;
    unsigned int i;
    self->high = next;
    self->low = change - (next - high); /* rounding remainder of the sum */
    self->gain = 1 + t->per_degree * rise;
    self->offset = t->offset_per_degree * rise;
    for (i = 0; i < t->turns; ++i) {
        self->inverse = self->inverse * (2 - self->gain * self->inverse);
    }
}

/* The input for the output y. */
static hystgen_real_t hystgen_heat_solve(const hystgen_heat_t *self, hystgen_real_t y) {
    return (y - self->offset) * self->inverse;
}

/* The output for the input x. */
static hystgen_real_t hystgen_heat_absorb(const hystgen_heat_t *self, hystgen_real_t x) {
    return self->gain * x + self->offset;
}
#endif
