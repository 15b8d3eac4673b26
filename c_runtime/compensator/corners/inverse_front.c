/* The inverse with a memoryless part, in floating point. Called by users and by start.c. */
#ifndef HYSTGEN_CONFIGURED
#define HYSTGEN_HAS_CORNERS
#define HYSTGEN_HAS_FRONT
#endif
#include "compensator/model.h"
#include "compensator/drive.c"

#ifdef HYSTGEN_INVERSE
/* Saves the place that a commit returns to. */
static void hystgen_inverse_keep(hystgen_inverse_t *self) {
    hystgen_copy_place(&self->undo, &self->plays.here);
    self->undo_drive = self->drive;
    self->undo_ascending = self->ascending;
}

/* Undoes the last step: the actuator has moved to v instead. */
HYSTGEN_APART void hystgen_inverse_replace(hystgen_inverse_t *self, hystgen_real_t v) {
    hystgen_take_back(&self->plays, &self->undo);
    self->drive = self->undo_drive;
    self->ascending = self->undo_ascending;
    const hystgen_real_t w = hystgen_operator_arrive(self, v);
    if (w < self->plays.here.output || w > self->plays.here.output) {
        hystgen_move_to_output(&hystgen_operator_curve, &self->plays, self->corner, w);
    }
}

/* A sample that is not finite: repeats the last returned drive. */
static hystgen_real_t hystgen_inverse_hold(hystgen_inverse_t *self) {
    hystgen_inverse_keep(self);
    hystgen_inverse_replace(self, self->stepped && self->committed ? self->returned : self->drive);
    self->stepped = true;
    self->committed = false;
    self->status |= HYSTGEN_STATUS_HELD;
    return self->drive;
}

/* One sample. The memory takes the returned drive as applied at once; a commit, a limit or a held
   drive undoes the step and applies the actual drive instead.

   stepped  committed  memory at            commit replaces      NaN returns, and sets memory to
   no       no         the start drive      nothing              the start drive
   no       yes        the committed drive  the committed drive  the committed drive
   yes      no         the returned drive   the returned drive   the returned drive
   yes      yes        the committed drive  the committed drive  the returned drive, `returned` */
hystgen_real_t hystgen_operator_step(hystgen_operator_t *self, hystgen_real_t u) {
    if (!(u >= -HYSTGEN_REAL_MAX && u <= HYSTGEN_REAL_MAX)) {
        return hystgen_inverse_hold(self);
    }
    hystgen_inverse_keep(self);
    if (!self->repeated || u < self->reference || u > self->reference) {
        hystgen_real_t level = u;
        if (u < HYSTGEN_OUTPUT_MIN) {
            level = HYSTGEN_OUTPUT_MIN;
        } else if (u > HYSTGEN_OUTPUT_MAX) {
            level = HYSTGEN_OUTPUT_MAX;
        }
        self->bits = level < u || level > u ? HYSTGEN_STATUS_INPUT_CLAMPED : 0u;
        self->reference = u;
        const hystgen_real_t w = hystgen_plays_step(&hystgen_operator_curve, &self->plays,
                                                    self->corner, level - HYSTGEN_OFFSET);
        const hystgen_real_t v = hystgen_inverse_choose(self, level, w, &self->unreached);
        const hystgen_real_t inside = hystgen_clamp_drive(v);
        const bool clamped = inside < v || inside > v;
        self->bits |= self->unreached ? HYSTGEN_STATUS_DOMAIN : 0u;
        if (clamped || (inside <= self->drive && inside >= self->drive)) {
            /* the plays do not reach w with this drive */
            self->bits |= clamped ? HYSTGEN_STATUS_OUTPUT_CLAMPED : 0u;
            hystgen_inverse_replace(self, inside);
        } else {
            hystgen_operator_set_drive(self, inside);
        }
        self->last = level;
        self->repeated = true;
    }
    self->stepped = true;
    self->committed = false;
    self->status |= self->bits;
    return self->drive;
}

void hystgen_inverse_commit(hystgen_inverse_t *self, hystgen_real_t applied) {
    const hystgen_real_t v = hystgen_clamp_drive(applied) + 0; /* no drive is -0 */
    if (!(applied >= -HYSTGEN_REAL_MAX && applied <= HYSTGEN_REAL_MAX)) {
        self->status |= HYSTGEN_STATUS_HELD;
        return;
    }
    if (v < applied || v > applied) {
        self->status |= HYSTGEN_STATUS_INPUT_CLAMPED;
    }
    if (self->stepped && !self->committed) {
        self->returned = self->drive;
    }
    self->committed = true;
    self->repeated = false;
    hystgen_inverse_replace(self, v);
}

/* The part common to init and reset: the drive rests within its range. */
HYSTGEN_APART void hystgen_operator_begin(hystgen_operator_t *self, bool reset) {
    const hystgen_drive_t *first = &hystgen_operator_first_drive[reset ? 1 : 0];
    hystgen_start(&hystgen_operator_curve, &self->plays, self->corner,
                  &hystgen_operator_start[reset ? 1 : 0]);
    self->last = self->plays.here.input + HYSTGEN_OFFSET;
    hystgen_move_to_output(&hystgen_operator_curve, &self->plays, self->corner, first->w);
    self->drive = first->drive;
    self->ascending = first->ascending;
    hystgen_inverse_keep(self);
    self->returned = self->drive;
    self->reference = 0;
    self->stepped = false;
    self->committed = false;
    self->repeated = false;
    self->bits = 0;
    self->status = 0;
}
#endif
