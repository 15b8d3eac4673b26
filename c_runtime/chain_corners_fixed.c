#include "hystgen_runtime.h"

/* Operators of a model with effects: plays of engine corners in fixed point, which give the same
   bits as those of engine loop. The inverse keeps the kink from which it has solved for an input of
   the plays; what is applied is mostly near there. */

/* All plays hold their start values. */
static void hystgen_forward_plays_init(hystgen_forward_t *self) {
    hystgen_start(&hystgen_model_curve, &self->here, self->corner, hystgen_model_start,
                  HYSTGEN_START_STEP);
    self->next = self->here.input;
}

/* All plays are 0. */
static void hystgen_forward_plays_reset(hystgen_forward_t *self) {
    hystgen_start(&hystgen_model_curve, &self->here, self->corner, hystgen_model_zero, 0);
    self->next = self->here.input;
}

/* All plays hold their start values. */
static void hystgen_inverse_plays_init(hystgen_inverse_t *self) {
    hystgen_start(&hystgen_model_curve, &self->here, self->corner, hystgen_model_start,
                  HYSTGEN_START_STEP);
    self->next = -HYSTGEN_FAR;
    self->sought = false;
}

/* All plays are 0. */
static void hystgen_inverse_plays_reset(hystgen_inverse_t *self) {
    hystgen_start(&hystgen_model_curve, &self->here, self->corner, hystgen_model_zero, 0);
    self->next = -HYSTGEN_FAR;
    self->sought = false;
}

/* Sum of the plays. */
static hystgen_signal_t hystgen_forward_started(const hystgen_forward_t *self) {
    return hystgen_level(self->here.output);
}

/* Sum of the plays. */
static hystgen_signal_t hystgen_inverse_started(const hystgen_inverse_t *self) {
    return hystgen_level(self->here.output);
}

/* The plays follow their input w. Returns their sum. */
HYSTGEN_APART_IN_FIXED hystgen_signal_t hystgen_forward_follow(hystgen_forward_t *self,
                                                               hystgen_play_t w) {
    return hystgen_level(hystgen_plays_step(&hystgen_model_curve, &self->here, self->corner,
                                            &self->kink, &self->next, w));
}

/* The plays follow their input w. Returns their sum. */
HYSTGEN_APART_IN_FIXED hystgen_signal_t hystgen_inverse_follow(hystgen_inverse_t *self,
                                                               hystgen_play_t w) {
    if (self->sought) {
        self->next = hystgen_move_to_solution(&hystgen_model_curve, &self->here, self->corner,
                                              &self->kink, w);
    } else {
        hystgen_move_to_input(&hystgen_model_curve, &self->here, self->corner, &self->kink, w);
        self->next = -HYSTGEN_FAR;
    }
    self->sought = false;
    return hystgen_inverse_started(self);
}

/* Input of the plays at which their sum is h. */
HYSTGEN_APART_IN_FIXED hystgen_reach_t hystgen_inverse_input(hystgen_inverse_t *self,
                                                             hystgen_signal_t h) {
    self->sought = true;
    return (hystgen_reach_t)hystgen_solve(&hystgen_model_curve, &self->here, self->corner,
                                          hystgen_asked(h), self->next, &self->kink);
}
