#include "hystgen_runtime.h"

/* Operators of a model with effects: the input of the plays has no bits below a drive code. The
   inverse of a lag would amplify that rounding into noise, so the input is refined for it. */

/* The input of the plays that gives their sum h, with HYSTGEN_ARRIVING_BITS more bits than w, the
   nearest one without them: the remainder of h at w, divided by the slope. */
static hystgen_signal_t hystgen_inverse_finer(const hystgen_inverse_t *self, hystgen_signal_t h,
                                              hystgen_reach_t w, hystgen_reach_t a) {
    const hystgen_tables_t *t = &hystgen_model_tables;
    const hystgen_signal_t whole = (hystgen_signal_t)a * ((int64_t)1 << HYSTGEN_ARRIVING_BITS);
    hystgen_sum_t left = h;
    unsigned int k = 1; /* plays that follow */
    unsigned int i;
    if (h > HYSTGEN_LARGEST_LEVEL || h < -HYSTGEN_LARGEST_LEVEL) {
        return whole;
    }
    left = h * ((hystgen_sum_t)1 << HYSTGEN_LEVEL_DROP);
    for (i = 0; i <= t->n; ++i) {
        const hystgen_reach_t low = w - t->threshold[i];
        const hystgen_reach_t high = w + t->threshold[i];
        const hystgen_reach_t play = self->play[i];
        hystgen_reach_t z = play;
        if (play > high) {
            z = high;
        } else if (play < low) {
            z = low;
        }
        k = z != play ? i + 1u : k;
        left -= t->weight[i] * z;
    }
    const hystgen_sum_t size = left < 0 ? -left : left;
    if (size > t->slope[k]) { /* w was limited and is not the nearest */
        return whole;
    }
    const hystgen_signal_t more = hystgen_over_slope(
        size * ((hystgen_sum_t)1 << HYSTGEN_ARRIVING_BITS), t->reciprocal[k], t->shift[k]);
    return left < 0 ? whole - more : whole + more;
}
