#include "hystgen_runtime.h"

static hystgen_real_t hystgen_clamp_drive(hystgen_real_t v)
{
    return v < HYSTGEN_DRIVE_MIN ? HYSTGEN_DRIVE_MIN : v > HYSTGEN_DRIVE_MAX ? HYSTGEN_DRIVE_MAX : v;
}

/* A sample that is no number: the last answer once more. */
HYSTGEN_APART hystgen_real_t hystgen_inverse_hold(hystgen_inverse_t *self)
{
    hystgen_plays_t *m = &self->plays;
    self->undo = m->here;
    if (self->stepped && self->committed) {
        hystgen_move_to_output(&hystgen_inverse_curve, m, self->corner, self->returned);
    }
    self->before = m->here.input;
    self->stepped = true;
    self->committed = false;
    self->status |= HYSTGEN_STATUS_HELD;
    return m->here.output;
}

/* A sample for which another corner may count. */
HYSTGEN_APART hystgen_real_t hystgen_inverse_search(hystgen_inverse_t *self, hystgen_real_t u)
{
    const hystgen_place_t *here = &self->plays.here;
    hystgen_real_t x = u - HYSTGEN_OFFSET;
    if (!(u >= HYSTGEN_OUTPUT_MIN && u <= HYSTGEN_OUTPUT_MAX)) {
        if (!(u >= -HYSTGEN_REAL_MAX && u <= HYSTGEN_REAL_MAX)) {
            return hystgen_inverse_hold(self);
        }
        x = (u < HYSTGEN_OUTPUT_MIN ? HYSTGEN_OUTPUT_MIN : HYSTGEN_OUTPUT_MAX) - HYSTGEN_OFFSET;
        self->status |= HYSTGEN_STATUS_INPUT_CLAMPED;
    }
    self->undo = *here;
    self->stepped = true;
    self->committed = false;
    if ((x < here->input || x > here->input) &&
        !(here->limited && (here->rising ? x > here->input : x < here->input))) {
        (void)hystgen_move_to_input(&hystgen_inverse_curve, &self->plays, self->corner, x);
    }
    if (here->limited) {
        self->status |= HYSTGEN_STATUS_OUTPUT_CLAMPED;
    }
    self->before = here->input;
    return here->output;
}

/* A sample in which more plays of the same block follow. */
HYSTGEN_APART hystgen_real_t hystgen_inverse_go_on(hystgen_inverse_t *self, hystgen_real_t x)
{
    self->undo = self->plays.here;
    self->before = x;
    return hystgen_move_in_block(&hystgen_inverse_curve, &self->plays, self->corner, x);
}

/* One sample. The memory takes the answer for applied at once, so that the usual sample need not look back; a commit takes
   the last step back and puts the applied drive in its place.

   stepped  committed   the memory is at        a commit puts another     a NaN answers and leaves
                                                drive in place of
   no       no          the start drive         nothing                   the start drive
   no       yes         the committed drive     the committed drive       the committed drive
   yes      no          the last answer         the last answer           the last answer
   yes      yes         the committed drive     the committed drive       the last answer, `returned`

   While `here.limited` is set, references beyond `here.input` have the same answer, a limit of the drive. */
hystgen_real_t hystgen_inverse_step(hystgen_inverse_t *self, hystgen_real_t u)
{
    hystgen_plays_t *m = &self->plays;
    const hystgen_real_t x = u - HYSTGEN_OFFSET;
    if (m->here.rising ? x > m->here.input : x < m->here.input) {
        if (m->here.rising ? x < m->next : x > m->next) { /* the usual sample: the same plays follow */
            self->before = m->here.input;
            m->here.input = x;
            m->here.output = m->start + (x - m->begin) * m->gain;
            return m->here.output;
        }
        if (m->here.rising ? x < m->cap : x > m->cap) {
            return hystgen_inverse_go_on(self, x);
        }
    }
    return hystgen_inverse_search(self, u);
}

void hystgen_inverse_commit(hystgen_inverse_t *self, hystgen_real_t applied)
{
    hystgen_plays_t *m = &self->plays;
    const hystgen_real_t v = hystgen_clamp_drive(applied) + 0; /* no drive is -0 */
    if (!(applied >= -HYSTGEN_REAL_MAX && applied <= HYSTGEN_REAL_MAX)) {
        self->status |= HYSTGEN_STATUS_HELD;
        return;
    }
    if (v < applied || v > applied) {
        self->status |= HYSTGEN_STATUS_INPUT_CLAMPED;
    }
    if (self->stepped && !self->committed) {
        self->returned = m->here.output;
    }
    self->committed = true;
    if (self->before < m->here.input || self->before > m->here.input) {
        m->here.input = self->before;
        m->here.output = m->start + (self->before - m->begin) * m->gain;
        self->undo = m->here;
    } else {
        hystgen_put(m, &self->undo);
    }
    hystgen_move_to_output(&hystgen_inverse_curve, m, self->corner, v);
    self->before = m->here.input;
}

static void hystgen_inverse_begin(hystgen_inverse_t *self, const hystgen_start_t *start)
{
    hystgen_plays_t *m = &self->plays;
    hystgen_start(&hystgen_inverse_curve, m, self->corner, start);
    hystgen_move_to_output(&hystgen_inverse_curve, m, self->corner, hystgen_clamp_drive(start->output));
    self->undo = m->here;
    self->before = m->here.input;
    self->returned = m->here.output;
    self->stepped = false;
    self->committed = false;
    self->status = 0;
}

void hystgen_inverse_init(hystgen_inverse_t *self)
{
    hystgen_inverse_begin(self, &hystgen_inverse_first);
}

void hystgen_inverse_reset(hystgen_inverse_t *self, hystgen_real_t u)
{
    hystgen_inverse_begin(self, &hystgen_inverse_zero);
    (void)hystgen_inverse_step(self, u);
}

unsigned int hystgen_inverse_status(hystgen_inverse_t *self)
{
    const unsigned int status = self->status;
    self->status = 0;
    return status;
}
