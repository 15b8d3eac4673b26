/* Operators of a model with effects: the corner engine's plays in floating point. The inverse
   moves its plays to the solution. If another input arrives, they go on from there on the same
   line, or the move is undone. Called by chain.c, chain_calls.c and chain_start.c. */
#ifndef HYSTGEN_CHAIN_CORNERS_FLOAT_C
#define HYSTGEN_CHAIN_CORNERS_FLOAT_C
#ifndef HYSTGEN_CONFIGURED
#define HYSTGEN_HAS_CORNERS
#endif
#include "compensator/chain/model.h"

/* Sets all plays to their start values or, at a reset, to 0. */
static void hystgen_operator_plays_start(hystgen_operator_t *self, bool reset) {
    hystgen_start(&hystgen_operator_curve, &self->plays, self->corner,
                  &hystgen_operator_start[reset ? 1 : 0]);
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

/* Moves the plays from the solution to an output w on its line, which begins at `behind` if no play
   follows, else, in the same block, at the previous place or the last kink. False elsewhere. */
static bool hystgen_inverse_move_on(hystgen_inverse_t *self, hystgen_play_t w) {
    hystgen_plays_t *m = &self->plays;
    const unsigned int k = m->here.k;
    if (k > 0) {
        if (m->here.rising != self->undo.rising || m->here.depth != self->undo.depth) {
            return false;
        }
        const hystgen_real_t since = k > self->undo.k ? m->start : self->undo.output;
        if (m->here.rising ? w <= since : w >= since) {
            return false;
        }
    }
    const hystgen_real_t h = m->begin + (w - m->start) * hystgen_operator_curve.segment[k].slope;
    if ((m->here.rising ? h >= m->next : h <= m->next) ||
        (k == 0 && (m->here.rising ? h <= m->behind : h >= m->behind))) {
        return false;
    }
    m->here.input = h;
    m->here.output = w;
    return true;
}

/* The plays follow their input w. Updates their sum. */
static void hystgen_operator_follow(hystgen_operator_t *self, hystgen_play_t w) {
    hystgen_plays_t *m = &self->plays;
    if ((w < m->here.output || w > m->here.output) &&
        !(self->sought && hystgen_inverse_move_on(self, w))) {
        if (self->sought) {
            hystgen_take_back(m, &self->undo);
        }
        if (w < m->here.output || w > m->here.output) {
            hystgen_move_to_output(&hystgen_operator_curve, m, self->corner, w);
        }
    }
    self->sought = false;
    self->level = hystgen_operator_started(self);
}

/* Input of the plays at which their sum is h. */
static hystgen_reach_t hystgen_inverse_input(hystgen_inverse_t *self, hystgen_signal_t h) {
    if (h < self->plays.here.input || h > self->plays.here.input) {
        hystgen_copy_place(&self->undo, &self->plays.here);
        self->sought = true;
        (void)hystgen_plays_step(&hystgen_operator_curve, &self->plays, self->corner, h);
    }
    return self->plays.here.output;
}
#endif

#endif
