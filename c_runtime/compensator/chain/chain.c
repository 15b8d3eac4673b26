/* Operators of the loop engine and of every model with effects: a chain of blocks from drive to
   displacement; without effects it is the plays alone. Applied drives pass forwards through all
   blocks, references backwards, so the memory depends only on drives that the actuator has seen.
   The model's own functions call its blocks:

   waited, slewed   delay and slew limit; only the forward operator has the delay, since references
                    of the inverse come ahead of time
   drive_side       lag: before the memoryless part and the plays
   output_side      creep, ageing, heat, gain: after the plays; the forward operator also has the
                    modes of the stage here
   displaced        saturation, offsets and drift, at the very end

   rest: everything has settled at an input; absorb: one sample; solve: the input that gives an
   output.

   moving   false  no drive has been applied yet: everything will be at rest at the first one
            true   every block has seen the previous sample
   A step leaves the returned drive pending. The next step or settle absorbs this drive, or the one
   committed in its place.

   Signals between the blocks have a type of their own; signals.c converts them. */
#ifndef HYSTGEN_CHAIN_CHAIN_C
#define HYSTGEN_CHAIN_CHAIN_C
#include "compensator/chain/model.h"
#include "compensator/chain/drive_signal.c"
#define HYSTGEN_ASKS_LIMITS
#include "effects/catalogue.h"
#include "compensator/chain/signals.c"
#ifndef HYSTGEN_CONFIGURED
#include "compensator/drive.c"
#ifndef HYSTGEN_HAS_CORNERS
#include "compensator/chain/plays.c"
#elif defined(HYSTGEN_FIXED)
#include "compensator/chain/corners_fixed.c"
#else
#include "compensator/chain/corners_float.c"
#endif
#endif

/* Passes drive v through the drive side and moves the plays. */
static inline void hystgen_operator_played(hystgen_operator_t *self, hystgen_real_t v) {
#ifdef HYSTGEN_FORWARD
    const hystgen_reach_t late = hystgen_forward_waited(self, v);
    const hystgen_reach_t reached = hystgen_forward_slewed(self, late);
    if (reached < late || reached > late) {
        self->status |= HYSTGEN_STATUS_SLEW_LIMITED;
    }
    const hystgen_signal_t x = hystgen_drive_signal(reached);
#else
    const hystgen_signal_t x = hystgen_drive_signal(v);
#endif
    const hystgen_signal_t a = self->moving ? hystgen_operator_drive_side_absorb(self, x)
                                            : hystgen_operator_drive_side_rest(self, x);
    hystgen_operator_follow(self, hystgen_operator_arrive(self, hystgen_arriving(a)));
}

/* Passes the sum of the plays through the output side. */
HYSTGEN_APART_IN_FIXED_CHAIN void hystgen_operator_passed_on(hystgen_operator_t *self) {
    self->output = self->moving ? hystgen_operator_output_side_absorb(self, self->level)
                                : hystgen_operator_output_side_rest(self, self->level);
    self->moving = true;
}

/* The actuator has seen drive v. */
HYSTGEN_APART_IN_FIXED_CHAIN void hystgen_operator_absorb(hystgen_operator_t *self,
                                                          hystgen_real_t v) {
#ifdef HYSTGEN_HAS_LATE_COLUMN
    hystgen_operator_tick(self);
#endif
    if (self->moving) {
        hystgen_operator_travelled(self, v);
    }
    self->applied = v;
    hystgen_operator_played(self, v);
    hystgen_operator_passed_on(self);
}

#ifdef HYSTGEN_INVERSE
/* The actuator has seen the pending drive. */
static void hystgen_inverse_take(hystgen_inverse_t *self) {
    if (self->has_pending) {
        hystgen_operator_absorb(self, self->pending);
        self->has_pending = false;
    }
}

/* Returns a drive and leaves it pending. */
static hystgen_real_t hystgen_inverse_answer(hystgen_inverse_t *self, hystgen_real_t sent) {
    self->answer = sent;
    self->pending = sent;
    self->has_pending = true;
    self->stepped = true;
    return sent;
}
#endif

/* The present displacement. */
static hystgen_real_t hystgen_operator_shown(const hystgen_operator_t *self) {
    unsigned int status = 0; /* not reported, since this is not a step */
    return hystgen_output_code(hystgen_operator_displaced(self, hystgen_operator_output(self)),
                               &status);
}

/* The part common to init and reset, after the plays are set: everything rests at this drive. */
HYSTGEN_APART_IN_CHAIN void hystgen_operator_begin(hystgen_operator_t *self, hystgen_real_t drive,
                                                   bool ascending) {
    const hystgen_signal_t x = hystgen_drive_signal(drive);
#ifdef HYSTGEN_INVERSE
    self->pending = drive;
    self->answer = drive;
    self->reference = 0;
    self->has_pending = false;
    self->repeated = false;
    self->stepped = false;
    self->filled = false;
    self->bits = 0;
#endif
    self->applied = drive;
    self->drive = hystgen_arriving(x);
    self->ascending = ascending;
    self->moving = false;
    self->status = 0;
    self->level = hystgen_operator_started(self);
    (void)hystgen_operator_drive_side_rest(self, x);
    self->output = hystgen_operator_output_side_rest(self, self->level);
#ifdef HYSTGEN_FORWARD
    self->answer = hystgen_operator_shown(self);
#else
    self->last = hystgen_operator_shown(self);
#endif
}

#endif
