/* Gain and offset from self-heating, which follows from the applied drives. In fixed point the
   temperature has as many bits as fit in 64, so that slow changes do not stall. Called by the
   functions that emission writes for a chain, see compensator/chain/model.h. */
#include "compensator/chain/model.h"
#include "effects/gains.c"

static void hystgen_heat_init(hystgen_heat_t *self) {
    self->high = 0;
#ifndef HYSTGEN_FIXED
    self->low = 0;
#endif
    self->gain = (hystgen_narrow_t)HYSTGEN_GAIN_ONE;
    self->inverse = (hystgen_narrow_t)HYSTGEN_GAIN_ONE;
    self->offset = 0;
}

/* The signed square of a drive. */
static hystgen_signal_t hystgen_heat_square(hystgen_real_t v) {
    const hystgen_signal_t square = (hystgen_signal_t)v * v;
    return v >= 0 ? square : -square;
}

/* Distance moved by the signed square of the drive. */
static hystgen_signal_t hystgen_heat_way(hystgen_real_t before, hystgen_real_t v) {
    const hystgen_signal_t way = hystgen_heat_square(v) - hystgen_heat_square(before);
    return way >= 0 ? way : -way;
}

/* Updates the temperature, gain and offset by the heating of a move of the drive. */
HYSTGEN_APART_IN_FIXED_BLOCK void hystgen_heat_move(const hystgen_heat_table_t *t,
                                                    hystgen_heat_t *self, hystgen_signal_t amount) {
#ifdef HYSTGEN_FIXED
    const hystgen_signal_t size = hystgen_nearest(amount, t->coarse);
    const hystgen_signal_t heat = hystgen_times(size, &t->per_amount) * ((int64_t)1 << t->lift);
    self->high += heat - hystgen_times(self->high >> t->drop, &t->rate);
    const hystgen_signal_t warm = self->high >> t->drop;
#else
    const hystgen_signal_t high = self->high;
    const hystgen_signal_t change = (t->per_amount * amount - t->rate * high) + self->low;
    const hystgen_signal_t warm = high + change;
    self->high = warm;
    self->low = change - (warm - high); /* rounding remainder of the sum */
#endif
    const hystgen_signal_t rise = warm > t->hottest ? t->hottest : warm;
    const hystgen_signal_t gain = HYSTGEN_GAIN_ONE + hystgen_times(rise, &t->per_degree);
#ifdef HYSTGEN_FIXED
    self->gain = hystgen_gain_inside(gain); /* rounding may have taken it out */
#else
    self->gain = gain;
#endif
    self->offset = hystgen_times(rise, &t->offset_per_degree);
    self->inverse = hystgen_gain_followed(self->gain, self->inverse, t->turns);
}

/* The input for the output y. */
static hystgen_signal_t hystgen_heat_solve(const hystgen_heat_t *self, hystgen_signal_t y) {
    return hystgen_gain_times(y - self->offset, self->inverse);
}

/* The output for the input x. */
static hystgen_signal_t hystgen_heat_absorb(const hystgen_heat_t *self, hystgen_signal_t x) {
    return hystgen_gain_times(x, self->gain) + self->offset;
}
