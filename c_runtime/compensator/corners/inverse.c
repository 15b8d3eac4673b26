/* The inverse without a memoryless part, in floating point. Called by users and by start.c. */
#ifndef HYSTGEN_CONFIGURED
#define HYSTGEN_HAS_CORNERS
#endif
#include "compensator/model.h"
#include "compensator/clamp.c"
#include "plays/corners_float.c"

#ifdef HYSTGEN_INVERSE
/* Any sample that needs a search. */
HYSTGEN_APART void hystgen_inverse_search(hystgen_inverse_t *self, hystgen_real_t u) {
    hystgen_plays_t *m = &self->plays;
    hystgen_real_t x = u - HYSTGEN_OFFSET;
    unsigned int bits = 0;
    hystgen_copy_place(&self->undo, &m->here);
    if (!(u >= HYSTGEN_OUTPUT_MIN && u <= HYSTGEN_OUTPUT_MAX)) {
        bits = u >= -HYSTGEN_REAL_MAX && u <= HYSTGEN_REAL_MAX ? HYSTGEN_STATUS_INPUT_CLAMPED
                                                               : HYSTGEN_STATUS_HELD;
        x = (u < HYSTGEN_OUTPUT_MIN ? HYSTGEN_OUTPUT_MIN : HYSTGEN_OUTPUT_MAX) - HYSTGEN_OFFSET;
    }
    if (bits == HYSTGEN_STATUS_HELD && self->stepped && self->committed) { /* repeat the drive */
        hystgen_move_to_output(&hystgen_operator_curve, m, self->corner, self->returned);
    } else if (bits != HYSTGEN_STATUS_HELD &&
               ((m->limited &&
                 !hystgen_above(hystgen_along(m, m->here.input), hystgen_along(m, x))) ||
                ((hystgen_above(m->here.input, x) || hystgen_above(x, m->here.input)) &&
                 hystgen_move_to_input(&hystgen_operator_curve, m, self->corner, x)))) {
        m->limited = true;
        bits |= HYSTGEN_STATUS_OUTPUT_CLAMPED;
    }
    self->before = m->here.input;
    self->stepped = true;
    self->committed = false;
    self->status |= bits;
}

/* One sample. The memory takes the returned drive as applied at once; a commit undoes the step and
   applies the committed drive instead. While `limited` is set, references beyond `input` return the
   same drive, a limit of its range.

   stepped  committed  memory at            commit replaces      NaN returns, and sets memory to
   no       no         the start drive      nothing              the start drive
   no       yes        the committed drive  the committed drive  the committed drive
   yes      no         the returned drive   the returned drive   the returned drive
   yes      yes        the committed drive  the committed drive  the returned drive, `returned` */
hystgen_real_t hystgen_operator_step(hystgen_operator_t *self, hystgen_real_t u) {
    hystgen_plays_t *m = &self->plays;
    const hystgen_real_t x = u - HYSTGEN_OFFSET;
    const bool on =
        m->here.rising ? hystgen_above(x, m->here.input) : hystgen_above(m->here.input, x);
    bool same = false;
    if (on) {
        same = m->here.rising ? hystgen_above(m->next, x) : hystgen_above(x, m->next);
    } else if (m->here.k == 0) {
        same = m->here.rising ? hystgen_above(x, m->behind) && hystgen_above(m->here.input, x)
                              : hystgen_above(m->behind, x) && hystgen_above(x, m->here.input);
    }
    if (same) { /* the usual sample */
        self->before = m->here.input;
        m->here.input = x;
        m->here.output = m->start + (x - m->begin) * m->gain;
        return m->here.output;
    }
    if (on && (m->here.rising ? hystgen_above(m->cap, x) : hystgen_above(x, m->cap))) {
        hystgen_copy_place(&self->undo, &m->here);
        self->before = x;
        if (hystgen_move_in_block(&hystgen_operator_curve, m, x)) {
            return m->here.output;
        }
    }
    hystgen_inverse_search(self, u);
    return m->here.output;
}

void hystgen_inverse_commit(hystgen_inverse_t *self, hystgen_real_t applied) {
    hystgen_plays_t *m = &self->plays;
    const hystgen_real_t v = hystgen_clamp_drive(applied) + 0; /* no drive is -0 */
    if (!(applied >= -HYSTGEN_REAL_MAX && applied <= HYSTGEN_REAL_MAX)) {
        self->status |= HYSTGEN_STATUS_HELD;
        return;
    }
    self->status |= v < applied || v > applied ? HYSTGEN_STATUS_INPUT_CLAMPED : 0u;
    self->returned = self->stepped && !self->committed ? m->here.output : self->returned;
    self->committed = true;
    if (self->before < m->here.input || self->before > m->here.input) { /* a usual step */
        hystgen_copy_place(&self->undo, &m->here);
        self->undo.input = self->before;
        self->undo.output = m->start + (self->before - m->begin) * m->gain;
    }
    hystgen_take_back(m, &self->undo);
    hystgen_move_to_output(&hystgen_operator_curve, m, self->corner, v);
    self->before = m->here.input;
}

/* The part common to init and reset: the drive rests within its range. */
HYSTGEN_APART void hystgen_operator_begin(hystgen_operator_t *self, bool reset) {
    hystgen_plays_t *m = &self->plays;
    hystgen_start(&hystgen_operator_curve, m, self->corner, &hystgen_operator_start[reset ? 1 : 0]);
    hystgen_move_to_output(&hystgen_operator_curve, m, self->corner,
                           hystgen_clamp_drive(m->here.output));
    hystgen_copy_place(&self->undo, &m->here);
    self->before = m->here.input;
    self->stepped = false;
    self->committed = false;
    self->status = 0;
}
#endif
