/* Operators of engine loop: the part common to all arithmetics and memoryless parts. Called by
   loop_float.c and loop_fixed.c. */
#ifndef HYSTGEN_LOOP_C
#define HYSTGEN_LOOP_C
#include "compensator/model.h"
#include "compensator/clamp.c"
#ifdef HYSTGEN_FIXED
#include "compensator/loop_output_fixed.c"
#else
#include "compensator/loop_output_float.c"
#endif
#if !defined(HYSTGEN_CONFIGURED) && defined(HYSTGEN_HAS_TWO_BRANCHES)
#include "compensator/loop_branches.c"
#include "compensator/loop_branches_drive.c"
#elif !defined(HYSTGEN_CONFIGURED)
#include "compensator/loop_plain.c"
#endif

/* The actuator has seen drive v. */
static void hystgen_forward_absorb(hystgen_forward_t *self, hystgen_real_t v) {
    hystgen_loop_absorb(&hystgen_model_tables, self->play, hystgen_forward_arrive(self, v));
}

/* The actuator has seen drive v. */
static void hystgen_inverse_absorb(hystgen_inverse_t *self, hystgen_real_t v) {
    hystgen_loop_absorb(&hystgen_model_tables, self->play, hystgen_inverse_arrive(self, v));
}

/* Returns drive v and leaves it pending: the next step absorbs it, or the drive committed in its
   place. */
static hystgen_real_t hystgen_inverse_answer(hystgen_inverse_t *self, hystgen_real_t v) {
    self->answer = v;
    self->pending = v;
    self->has_pending = true;
    self->stepped = true;
    return v;
}

/* The actuator has seen the pending drive. */
static void hystgen_inverse_take(hystgen_inverse_t *self) {
    if (self->has_pending) {
        hystgen_inverse_absorb(self, self->pending);
        self->has_pending = false;
    }
}

/* Answers reference u, which is `level` after limiting; `bits` is its status so far. */
HYSTGEN_APART_IN_FIXED hystgen_real_t hystgen_inverse_search(hystgen_inverse_t *self,
                                                             hystgen_real_t u, hystgen_real_t level,
                                                             unsigned int bits) {
    if (self->repeat && u >= self->reference && u <= self->reference) {
        self->status |= self->bits;
        return hystgen_inverse_answer(self, self->answer);
    }
    self->reference = u;
    self->repeat = true;
    self->bits = bits;
    const hystgen_reach_t v =
        hystgen_inverse_drive(self, level, hystgen_inverse_solve(self, level));
    const hystgen_real_t inside = hystgen_clamp_drive(v);
    if (inside < v || inside > v) {
        self->bits |= HYSTGEN_STATUS_OUTPUT_CLAMPED;
    }
    self->status |= self->bits;
    return hystgen_inverse_answer(self, inside);
}

/* Drive v, which is `applied` after limiting, is pending in place of the last answer. */
static void hystgen_inverse_replace(hystgen_inverse_t *self, hystgen_real_t applied,
                                    hystgen_real_t v) {
    if (v < applied || v > applied) {
        self->status |= HYSTGEN_STATUS_INPUT_CLAMPED;
    }
    self->repeat = false;
    self->pending = v;
    self->has_pending = true;
}

/* The part common to init and reset, once the plays are set: they rest at this drive. */
static void hystgen_inverse_begin(hystgen_inverse_t *self, hystgen_real_t drive) {
    self->pending = drive;
    self->drive = drive;
    self->reference = 0;
    self->answer = drive;
    self->has_pending = false;
    self->repeat = false;
    self->stepped = false;
    self->bits = 0;
    self->status = 0;
}

#endif
