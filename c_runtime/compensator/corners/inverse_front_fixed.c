/* The inverse with a memoryless part, in fixed point. Called by users and by start.c. */
#include "arithmetic/fixed.h"
#ifndef HYSTGEN_CONFIGURED
#define HYSTGEN_HAS_CORNERS
#define HYSTGEN_HAS_FRONT
#endif
#include "compensator/model.h"
#include "compensator/drive.c"
#include "compensator/code.c"

#ifdef HYSTGEN_INVERSE
/* Saves the place that a commit returns to. */
HYSTGEN_APART void hystgen_inverse_keep(hystgen_inverse_t *self) {
    hystgen_copy_place(&self->undo, &self->here);
    self->undo_drive = self->drive;
    self->undo_ascending = self->ascending;
}

/* One sample. The memory takes the returned drive as applied at once; a commit undoes the step and
   applies the committed drive instead.

   last call   memory at             commit replaces       the same reference again
   init        the start memory      nothing               is solved
   step        the returned drive    the returned drive    returns the same drive
   commit      the committed drive   the committed drive   is solved again */
hystgen_real_t hystgen_operator_step(hystgen_operator_t *self, hystgen_real_t u) {
    hystgen_inverse_keep(self);
    if (!self->repeated || u != self->reference) {
        const hystgen_real_t level = hystgen_inverse_clamp(u);
        const int64_t output = (int64_t)level * ((int64_t)1 << HYSTGEN_FRACTION);
        self->reference = u;
        self->repeated = true;
        self->bits = level != u ? HYSTGEN_STATUS_INPUT_CLAMPED : 0u;
        const int64_t w = hystgen_solve(&hystgen_model_curve, &self->here, self->corner, output,
                                        self->next, &self->kink);
        const hystgen_reach_t v =
            hystgen_inverse_choose(self, level, (hystgen_reach_t)w, &self->unreached);
        const hystgen_real_t inside = hystgen_clamp_drive(v);
        self->last = level;
        if (self->unreached) {
            self->bits |= HYSTGEN_STATUS_DOMAIN;
        }
        if (inside != v) {
            self->bits |= HYSTGEN_STATUS_OUTPUT_CLAMPED;
        }
        const int32_t to = hystgen_operator_arrive(self, inside);
        self->next = hystgen_move_to_solution(&hystgen_model_curve, &self->here, self->corner,
                                              &self->kink, to);
    }
    self->status |= self->bits;
    return self->drive;
}

void hystgen_inverse_commit(hystgen_inverse_t *self, hystgen_real_t applied) {
    const hystgen_real_t v = hystgen_clamp_drive(applied);
    if (v != applied) {
        self->status |= HYSTGEN_STATUS_INPUT_CLAMPED;
    }
    hystgen_copy_place(&self->here, &self->undo);
    self->drive = self->undo_drive;
    self->ascending = self->undo_ascending;
    self->repeated = false;
    self->next = -HYSTGEN_FAR;
    hystgen_move_to_input(&hystgen_model_curve, &self->here, self->corner, &self->kink,
                          hystgen_operator_arrive(self, v));
}

/* The part common to init and reset. */
static void hystgen_operator_begin(hystgen_operator_t *self, bool reset) {
    unsigned int status = 0; /* not reported, since this is not a step */
    const hystgen_drive_t *first = &hystgen_operator_first_drive[reset ? 1 : 0];
    hystgen_start(&hystgen_model_curve, &self->here, self->corner,
                  reset ? hystgen_model_zero : hystgen_model_start,
                  reset ? 0u : HYSTGEN_START_STEP);
    self->drive = (hystgen_real_t)first->drive;
    self->ascending = first->ascending;
    hystgen_inverse_keep(self);
    self->reference = 0;
    self->last = hystgen_code(self->here.output, &status);
    self->repeated = false;
    self->next = -HYSTGEN_FAR;
    self->bits = 0;
    self->status = 0;
}
#endif
