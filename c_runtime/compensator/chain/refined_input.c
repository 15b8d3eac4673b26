/* Operators of the loop engine and of every model with effects: bits of the plays' input below a
   drive code. The inverse of some models refines its solution to these bits, since the inverse of
   a lag would turn the rounding to a code into noise. Called by chain_calls.c and, for the corner
   engine, by corners_fixed.c. */
#ifndef HYSTGEN_CHAIN_REFINED_INPUT_C
#define HYSTGEN_CHAIN_REFINED_INPUT_C
#include "compensator/chain/model.h"
#if defined(HYSTGEN_FIXED) && defined(HYSTGEN_HAS_CORNERS)
#include "plays/corners_fixed.c"
#endif

#ifndef HYSTGEN_HAS_FINE_SIGNAL
static inline hystgen_signal_t hystgen_inverse_refined(const hystgen_inverse_t *self,
                                                       hystgen_signal_t h, hystgen_reach_t w,
                                                       hystgen_reach_t a) {
    (void)self;
    (void)h;
    (void)w;
    return a;
}
#elif defined(HYSTGEN_HAS_CORNERS)
/* The last kink before w: that of the solve, unless rounding or a limit took w back to it. */
HYSTGEN_APART void hystgen_inverse_kink_before(hystgen_inverse_t *self, hystgen_reach_t w) {
    const int64_t x = hystgen_along(&self->here, w);
    if (x > hystgen_along(&self->here, self->here.input) && x <= self->kink.input) {
        self->kink.output = x - 1;
        hystgen_find(&hystgen_model_curve, &self->here, self->corner, &self->kink, false);
    }
}

/* Input of the plays at which their sum is h, with HYSTGEN_ARRIVING_BITS more bits than w, the
   nearest input without them: adds the remainder of h at w, divided by the slope at w. */
HYSTGEN_APART hystgen_signal_t hystgen_inverse_refined(const hystgen_inverse_t *self,
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
    const int64_t more = hystgen_divide_by_slope(size * ((int64_t)1 << HYSTGEN_ARRIVING_BITS),
                                                 s->reciprocal, s->shift);
    return whole + hystgen_along(here, left < 0 ? -more : more);
}
#else
/* Input of the plays at which their sum is h, with HYSTGEN_ARRIVING_BITS more bits than w, the
   nearest input without them: adds the remainder of h at w, divided by the slope. */
static hystgen_signal_t hystgen_inverse_refined(const hystgen_inverse_t *self, hystgen_signal_t h,
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
    const hystgen_signal_t more = hystgen_divide_by_slope(
        size * ((hystgen_sum_t)1 << HYSTGEN_ARRIVING_BITS), t->reciprocal[k], t->shift[k]);
    return left < 0 ? whole - more : whole + more;
}
#endif

#endif
