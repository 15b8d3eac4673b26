/* Operators of the loop engine and every model with effects: step and commit. Called by users. */
#ifndef HYSTGEN_CHAIN_CHAIN_CALLS_C
#define HYSTGEN_CHAIN_CHAIN_CALLS_C
#include "compensator/chain/model.h"
#include "compensator/chain/chain.c"
#include "compensator/chain/refined_input.c"

#ifdef HYSTGEN_FORWARD
HYSTGEN_ALONE hystgen_real_t hystgen_operator_step(hystgen_operator_t *self, hystgen_real_t v) {
    hystgen_real_t inside = v;
    if (!hystgen_is_drive(v)) {
        if (!hystgen_finite(v)) {
            self->status |= HYSTGEN_STATUS_HELD;
            return self->answer;
        }
        inside = hystgen_clamp_drive(v);
        self->status |= HYSTGEN_STATUS_INPUT_CLAMPED;
    }
    hystgen_operator_absorb(self, inside);
    const hystgen_real_t answer = hystgen_output_code(
        hystgen_operator_displaced(self, hystgen_operator_output(self)), &self->status);
    self->answer = answer;
    return answer;
}
#else
/* A reference that is not finite: repeats the newest one. */
static void hystgen_inverse_unread(hystgen_inverse_t *self) {
    self->status |= HYSTGEN_STATUS_HELD;
    hystgen_inverse_repeat(self);
}

/* Takes the next reference, which lies within its range. Returns the target of the output side at
   this sample. */
HYSTGEN_APART_IN_FIXED_CHAIN hystgen_signal_t hystgen_inverse_put(hystgen_inverse_t *self,
                                                                  hystgen_real_t level) {
    bool limited = false;
    const hystgen_signal_t wanted =
        hystgen_inverse_undisplaced(self, hystgen_level_signal(level), &limited);
    if (limited) {
        self->status |= HYSTGEN_STATUS_DOMAIN;
    }
    return hystgen_inverse_ahead(self, wanted);
}

/* Sum of the plays for the output y of the output side; the memory is up to date. */
HYSTGEN_APART_IN_FIXED_CHAIN hystgen_signal_t hystgen_inverse_wanted(hystgen_inverse_t *self,
                                                                     hystgen_signal_t y) {
    return self->moving ? hystgen_inverse_output_side_solve(self, y)
                        : hystgen_inverse_output_side_resting(self, y);
}

/* Drive for an input w of the plays, at which their sum is h; the reference is already limited. */
HYSTGEN_APART_IN_FIXED_CHAIN hystgen_reach_t hystgen_inverse_sought(hystgen_inverse_t *self,
                                                                    hystgen_real_t level,
                                                                    hystgen_signal_t h,
                                                                    hystgen_reach_t w) {
    const hystgen_signal_t a =
        hystgen_inverse_refined(self, h, w, hystgen_inverse_drive(self, level, w));
    return hystgen_drive_code(self->moving ? hystgen_inverse_drive_side_solve(self, a) : a);
}

/* The drive v within its limits. */
static hystgen_real_t hystgen_inverse_limited(hystgen_inverse_t *self, hystgen_reach_t v) {
    const hystgen_reach_t reached = hystgen_inverse_slewed(self, v);
    if (reached < v || reached > v) {
        self->bits |= HYSTGEN_STATUS_SLEW_LIMITED;
    }
    const hystgen_real_t inside = hystgen_clamp_drive(reached);
    if (inside < reached || inside > reached) {
        self->bits |= HYSTGEN_STATUS_OUTPUT_CLAMPED;
    }
    self->status |= self->bits;
    return inside;
}

/* The next drive, for reference u; the memory is up to date. `bits`: status of the reference. */
HYSTGEN_APART_IN_FIXED hystgen_real_t hystgen_inverse_next(hystgen_inverse_t *self,
                                                           hystgen_real_t u) {
    hystgen_real_t level = u;
    unsigned int bits = 0;
    if (!hystgen_is_reference(u)) {
        if (!hystgen_finite(u)) {
            hystgen_inverse_unread(self);
            return hystgen_inverse_answer(self, hystgen_inverse_held(self));
        }
        level = hystgen_inverse_clamp(u);
        bits = HYSTGEN_STATUS_INPUT_CLAMPED;
    }
    if (hystgen_inverse_stands(self, u)) {
        return hystgen_inverse_answer(self, self->answer);
    }
    self->bits = bits;
    const hystgen_signal_t h = hystgen_inverse_wanted(self, hystgen_inverse_put(self, level));
    const hystgen_reach_t w = hystgen_inverse_input(self, h);
    const hystgen_reach_t v = hystgen_inverse_sought(self, level, h, w);
    return hystgen_inverse_answer(self, hystgen_inverse_limited(self, v));
}

HYSTGEN_ALONE hystgen_real_t hystgen_operator_step(hystgen_operator_t *self, hystgen_real_t u) {
    hystgen_inverse_take(self);
    return hystgen_inverse_next(self, u);
}

void hystgen_inverse_commit(hystgen_inverse_t *self, hystgen_real_t applied) {
    if (!hystgen_finite(applied)) {
        self->status |= HYSTGEN_STATUS_HELD;
        return;
    }
    const hystgen_real_t inside = hystgen_applied_drive(applied);
    if (inside < applied || inside > applied) {
        self->status |= HYSTGEN_STATUS_INPUT_CLAMPED;
    }
    self->repeated = false;
    self->pending = inside;
    self->has_pending = true;
}
#endif

#endif
