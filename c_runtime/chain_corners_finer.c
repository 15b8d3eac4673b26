#include "hystgen_runtime.h"

/* Operators of a model with effects: the input of the plays has no bits below a drive code, as in
   chain_finer.c, where the plays are those of engine corners. */

/* The kink before a solution w, which it refines: plays that begin to follow at w do not count. */
HYSTGEN_APART void hystgen_inverse_seen(hystgen_inverse_t *self, hystgen_reach_t w) {
    const int64_t x = hystgen_along(&self->here, w);
    if (x > hystgen_along(&self->here, self->here.input)) {
        self->kink.output = x - 1;
        hystgen_find(&hystgen_model_curve, &self->here, self->corner, &self->kink, false);
    }
}

/* The input of the plays that gives their sum h, with HYSTGEN_ARRIVING_BITS more bits than w, the
   nearest one without them: the remainder of h at w, divided by the slope there. */
HYSTGEN_APART hystgen_signal_t hystgen_inverse_finer(const hystgen_inverse_t *self,
                                                     hystgen_signal_t h, hystgen_reach_t w,
                                                     hystgen_reach_t a) {
    const hystgen_place_t *here = &self->here;
    const hystgen_signal_t whole = (hystgen_signal_t)a * ((int64_t)1 << HYSTGEN_ARRIVING_BITS);
    const int64_t x = hystgen_along(here, w);
    const int64_t on = x - hystgen_along(here, here->input);
    if (h > HYSTGEN_LARGEST_LEVEL || h < -HYSTGEN_LARGEST_LEVEL || on < 0) {
        return whole; /* w was limited and is not the nearest */
    }
    const hystgen_segment_t *s = &hystgen_model_curve.segment[on > 0 ? self->kink.k : 0u];
    const int64_t left = hystgen_along(here, h * ((hystgen_sum_t)1 << HYSTGEN_LEVEL_DROP)) -
                         self->kink.output - s->slope * (x - self->kink.input);
    const int64_t size = left < 0 ? -left : left;
    if (size > s->slope) {
        return whole;
    }
    const int64_t more =
        hystgen_over_slope(size * ((int64_t)1 << HYSTGEN_ARRIVING_BITS), s->reciprocal, s->shift);
    return whole + hystgen_along(here, left < 0 ? -more : more);
}
