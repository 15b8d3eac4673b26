#include "hystgen_runtime.h"

/* Operators of a model with effects: the input of the plays has no bits below a drive code, as in
   chain_finer.c, where the plays are those of engine corners. */

/* The input of the plays that gives their sum h, with HYSTGEN_ARRIVING_BITS more bits than w, the
   nearest one without them: the remainder of h at w, divided by the slope. */
HYSTGEN_APART hystgen_signal_t hystgen_inverse_finer(hystgen_inverse_t *self, hystgen_signal_t h,
                                                     hystgen_reach_t w, hystgen_reach_t a) {
    const hystgen_place_t *here = &self->here;
    const hystgen_signal_t whole = (hystgen_signal_t)a * ((int64_t)1 << HYSTGEN_ARRIVING_BITS);
    const int64_t x = hystgen_along(here, w);
    const int64_t before = hystgen_along(here, here->input);
    if (h > HYSTGEN_LARGEST_LEVEL || h < -HYSTGEN_LARGEST_LEVEL || x < before) {
        return whole; /* w was limited and is not the nearest */
    }
    const hystgen_segment_t *s = &hystgen_model_curve.segment[0]; /* where plays 0 .. k follow */
    int64_t left = h * ((hystgen_sum_t)1 << HYSTGEN_LEVEL_DROP);
    if (x > before) {
        hystgen_find(&hystgen_model_curve, here, self->corner, x - 1, false, &self->kink);
        s = &hystgen_model_curve.segment[self->kink.k];
        left = hystgen_along(here, left) - self->kink.output - s->slope * (x - self->kink.input);
    } else {
        left = hystgen_along(here, left - here->output);
    }
    const int64_t size = left < 0 ? -left : left;
    if (size > s->slope) {
        return whole;
    }
    const int64_t more =
        hystgen_over_slope(size * ((int64_t)1 << HYSTGEN_ARRIVING_BITS), s->reciprocal, s->shift);
    return whole + hystgen_along(here, left < 0 ? -more : more);
}
