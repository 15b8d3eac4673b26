/* Operators of a model with effects: the corner engine's plays in fixed point, with the same bits
   as those of the loop engine. Up to the output `next`, along the move, plays continue from the
   last kink found, which the inverse finds when it solves for their input. Searches are called
   where the least stack is in use. Called by chain.c, chain_calls.c and chain_start.c. */
#ifndef HYSTGEN_CHAIN_CORNERS_FIXED_C
#define HYSTGEN_CHAIN_CORNERS_FIXED_C
#include "arithmetic/fixed.h"
#ifndef HYSTGEN_CONFIGURED
#define HYSTGEN_HAS_CORNERS
#endif
#include "compensator/chain/model.h"
#include "plays/corners_fixed.c"
#include "compensator/chain/refined_input.c"
#include "compensator/chain/signals.c"

/* Sets all plays to their start values or, at a reset, to 0. Only their place is known then. */
static void hystgen_operator_plays_start(hystgen_operator_t *self, bool reset) {
    if (reset) {
        hystgen_start(&hystgen_model_curve, &self->here, self->corner, hystgen_model_zero, 0);
    } else {
        hystgen_start(&hystgen_model_curve, &self->here, self->corner, hystgen_model_start,
                      HYSTGEN_START_STEP);
    }
    self->kink.output = 0;
    self->kink.input = 0;
    self->kink.k = 0;
    self->kink.depth = 0;
    self->next = -HYSTGEN_FAR;
#ifdef HYSTGEN_INVERSE
    self->sought = false;
#endif
}

/* Sum of the plays. */
static hystgen_signal_t hystgen_operator_started(const hystgen_operator_t *self) {
    return hystgen_level(self->here.output);
}

/* Moves the plays to an input between the kink and the next. False for any other input. */
HYSTGEN_APART bool hystgen_operator_move_on(hystgen_operator_t *self, hystgen_play_t w) {
    const int64_t moved = hystgen_gained(&hystgen_model_curve, &self->here, &self->kink, w);
    if (moved < 0 || self->kink.output + moved > self->next) {
        return false;
    }
    hystgen_go_on(&self->here, &self->kink, w, moved);
    return true;
}

/* The same for a kink just found; finds the next one first. */
HYSTGEN_APART bool hystgen_operator_moved(hystgen_operator_t *self, hystgen_play_t w) {
    self->next = hystgen_next_output(&hystgen_model_curve, &self->here, self->corner, &self->kink);
    return hystgen_operator_move_on(self, w);
}

/* The plays follow their input w. Updates their sum. */
HYSTGEN_APART_IN_FIXED void hystgen_operator_follow(hystgen_operator_t *self, hystgen_play_t w) {
#ifdef HYSTGEN_FORWARD
    const bool turns = self->here.rising ? w < self->here.input : w > self->here.input;
    if (turns || !hystgen_operator_move_on(self, w)) {
#else
    if (!self->sought || !hystgen_operator_moved(self, w)) {
#endif
        hystgen_find_input(&hystgen_model_curve, &self->here, self->corner, w, &self->kink);
        (void)hystgen_operator_moved(self, w);
    }
#ifdef HYSTGEN_INVERSE
    self->sought = false;
#endif
    self->level = hystgen_operator_started(self);
}

#ifdef HYSTGEN_INVERSE
/* Input of the plays at which their sum is h. */
HYSTGEN_APART_IN_FIXED hystgen_reach_t hystgen_inverse_input(hystgen_inverse_t *self,
                                                             hystgen_signal_t h) {
    const hystgen_reach_t w = (hystgen_reach_t)hystgen_solve(
        &hystgen_model_curve, &self->here, self->corner, hystgen_asked(h), self->next, &self->kink);
    self->sought = true;
#ifdef HYSTGEN_HAS_FINE_SIGNAL
    hystgen_inverse_kink_before(self, w);
#endif
    return w;
}
#endif

#endif
