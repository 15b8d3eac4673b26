/* Operators of a model with effects: plays of engine corners in floating point. The inverse moves
   its plays to the solution, and undoes this move if another drive is applied. Called by chain.c,
   chain_calls.c and chain_start.c. */
#ifndef HYSTGEN_CHAIN_CORNERS_FLOAT_C
#define HYSTGEN_CHAIN_CORNERS_FLOAT_C
#ifndef HYSTGEN_CONFIGURED
#define HYSTGEN_HAS_CORNERS
#endif
#include "compensator/chain/model.h"

/* Sets all plays to their start values. */
static void hystgen_operator_plays_init(hystgen_operator_t *self) {
    hystgen_start(&hystgen_operator_curve, &self->plays, self->corner, &hystgen_operator_start[0]);
#ifdef HYSTGEN_INVERSE
    self->sought = false;
#endif
}

/* Sets all plays to 0. */
static void hystgen_operator_plays_reset(hystgen_operator_t *self) {
    hystgen_start(&hystgen_operator_curve, &self->plays, self->corner, &hystgen_operator_start[1]);
#ifdef HYSTGEN_INVERSE
    self->sought = false;
#endif
}

#ifdef HYSTGEN_FORWARD
/* Sum of the plays. */
static hystgen_signal_t hystgen_operator_started(const hystgen_operator_t *self) {
    return self->plays.here.output;
}

/* The plays follow their input w. Updates their sum. */
static void hystgen_operator_follow(hystgen_operator_t *self, hystgen_play_t w) {
    if (w < self->plays.here.input || w > self->plays.here.input) {
        (void)hystgen_plays_step(&hystgen_operator_curve, &self->plays, self->corner, w);
    }
    self->level = hystgen_operator_started(self);
}
#else
/* Sum of the plays, which is the input of the inverse curve. */
static hystgen_signal_t hystgen_operator_started(const hystgen_operator_t *self) {
    return self->plays.here.input;
}

/* The plays follow their input w. Updates their sum. */
static void hystgen_operator_follow(hystgen_operator_t *self, hystgen_play_t w) {
    hystgen_plays_t *m = &self->plays;
    if (self->sought && (w < m->here.output || w > m->here.output)) {
        hystgen_copy_place(&m->here, &self->undo);
        hystgen_forget_line(m);
    }
    if (w < m->here.output || w > m->here.output) {
        hystgen_move_to_output(&hystgen_operator_curve, m, self->corner, w);
    }
    self->sought = false;
    self->level = hystgen_operator_started(self);
}

/* Input of the plays at which their sum is h. */
static hystgen_reach_t hystgen_inverse_input(hystgen_inverse_t *self, hystgen_signal_t h) {
    hystgen_copy_place(&self->undo, &self->plays.here);
    self->sought = true;
    if (h < self->plays.here.input || h > self->plays.here.input) {
        (void)hystgen_plays_step(&hystgen_operator_curve, &self->plays, self->corner, h);
    }
    return self->plays.here.output;
}
#endif

#endif
