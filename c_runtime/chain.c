#include "hystgen_runtime.h"

/* Operators of a model with effects: a chain of blocks from drive to displacement. An applied drive
   passes forwards through all of them, a reference backwards, so that the memory holds only what
   the actuator has seen. The model's own functions call its blocks:

   waited, slewed   delay and slew limit; only the forward operator has the delay, since references
                    of the inverse come ahead of time
   drive_side       lag: in front of the memoryless part and the plays
   output_side      creep, ageing, heat, gain: behind the plays; the forward operator also has the
                    modes of the stage here
   displaced        saturation, offsets and drift, at the very end

   rest: everything has settled at an input; absorb: one sample; solve: the input that gives an
   output.

   moving   false  no drive has been applied yet: the first one finds everything at rest there
            true   every block has seen the previous sample
   A step leaves its answer pending. The next step or settle absorbs it, or the drive committed in
   its place.

   Signals between the blocks have a type of their own; chain_float.c and chain_fixed.c convert. */

/* An offset, limited to the span of the displacement. */
static hystgen_signal_t hystgen_inside_offset(hystgen_signal_t d) {
    return d > HYSTGEN_FARTHEST_OFFSET    ? HYSTGEN_FARTHEST_OFFSET
           : d < -HYSTGEN_FARTHEST_OFFSET ? -HYSTGEN_FARTHEST_OFFSET
                                          : d;
}

/* Drive v has passed through the drive side and moved the plays. Returns their sum. */
static hystgen_signal_t hystgen_forward_played(hystgen_forward_t *self, hystgen_real_t v) {
    const hystgen_reach_t late = hystgen_forward_waited(self, v);
    const hystgen_reach_t reached = hystgen_forward_slewed(self, late);
    if (reached < late || reached > late) {
        self->status |= HYSTGEN_STATUS_SLEW_LIMITED;
    }
    const hystgen_signal_t x = hystgen_entered_drive((hystgen_real_t)reached);
    const hystgen_signal_t a = self->moving ? hystgen_forward_drive_side_absorb(self, x)
                                            : hystgen_forward_drive_side_rest(self, x);
    self->level = hystgen_forward_follow(self, hystgen_forward_arrive(self, hystgen_arriving(a)));
    return self->level;
}

/* The actuator has seen drive v. */
HYSTGEN_APART_IN_FIXED void hystgen_forward_absorb(hystgen_forward_t *self, hystgen_real_t v) {
    if (self->moving) {
        hystgen_forward_travelled(self, v);
    }
    self->applied = v;
    const hystgen_signal_t h = hystgen_forward_played(self, v);
    self->output = self->moving ? hystgen_forward_output_side_absorb(self, h)
                                : hystgen_forward_output_side_rest(self, h);
    self->moving = true;
}

/* Drive v has passed through the drive side and moved the plays. Returns their sum. */
static hystgen_signal_t hystgen_inverse_played(hystgen_inverse_t *self, hystgen_real_t v) {
    const hystgen_signal_t x = hystgen_entered_drive(v);
    const hystgen_signal_t a = self->moving ? hystgen_inverse_drive_side_absorb(self, x)
                                            : hystgen_inverse_drive_side_rest(self, x);
    self->level = hystgen_inverse_follow(self, hystgen_inverse_arrive(self, hystgen_arriving(a)));
    return self->level;
}

/* The actuator has seen drive v. */
HYSTGEN_APART_IN_FIXED void hystgen_inverse_absorb(hystgen_inverse_t *self, hystgen_real_t v) {
    if (self->moving) {
        hystgen_inverse_travelled(self, v);
    }
    self->applied = v;
    const hystgen_signal_t h = hystgen_inverse_played(self, v);
    self->output = self->moving ? hystgen_inverse_output_side_absorb(self, h)
                                : hystgen_inverse_output_side_rest(self, h);
    self->moving = true;
}

/* The actuator has seen the pending drive. */
static void hystgen_inverse_take(hystgen_inverse_t *self) {
    if (self->has_pending) {
        hystgen_inverse_absorb(self, self->pending);
        self->has_pending = false;
    }
}

/* Returns drive v and leaves it pending. */
static hystgen_real_t hystgen_inverse_answer(hystgen_inverse_t *self, hystgen_real_t v) {
    self->answer = v;
    self->pending = v;
    self->has_pending = true;
    self->stepped = true;
    return v;
}

/* The part common to init and reset, once the plays are set: they rest at this drive. */
HYSTGEN_APART void hystgen_forward_begin(hystgen_forward_t *self, hystgen_real_t drive,
                                         bool ascending) {
    self->applied = drive;
    self->drive = hystgen_arriving(hystgen_entered_drive(drive));
    self->ascending = ascending;
    self->moving = false;
    self->status = 0;
    self->level = hystgen_forward_started(self);
    (void)hystgen_forward_drive_side_rest(self, hystgen_entered_drive(drive));
    self->output = hystgen_forward_output_side_rest(self, self->level);
    self->answer =
        hystgen_output_code(hystgen_forward_displaced(self, self->output), &self->status);
    self->status = 0;
}

/* The part common to init and reset, once the plays are set: they rest at this drive. */
HYSTGEN_APART void hystgen_inverse_begin(hystgen_inverse_t *self, hystgen_real_t drive,
                                         bool ascending) {
    self->pending = drive;
    self->answer = drive;
    self->has_pending = false;
    self->stepped = false;
    self->filled = false;
    self->bits = 0;
    self->applied = drive;
    self->drive = hystgen_arriving(hystgen_entered_drive(drive));
    self->ascending = ascending;
    self->moving = false;
    self->status = 0;
    self->level = hystgen_inverse_started(self);
    (void)hystgen_inverse_drive_side_rest(self, hystgen_entered_drive(drive));
    self->output = hystgen_inverse_output_side_rest(self, self->level);
}

void hystgen_forward_init(hystgen_forward_t *self) {
    hystgen_forward_settings_init(self);
    hystgen_loop_init(self->play);
    hystgen_forward_begin(self, HYSTGEN_FORWARD_INIT_DRIVE, HYSTGEN_FORWARD_INIT_ASCENDING);
}

void hystgen_forward_reset(hystgen_forward_t *self, hystgen_real_t v) {
    hystgen_loop_rest(&hystgen_model_tables, self->play, 0);
    hystgen_forward_begin(self, HYSTGEN_FORWARD_RESET_DRIVE, HYSTGEN_FORWARD_RESET_ASCENDING);
    (void)hystgen_forward_step(self, v);
}

void hystgen_inverse_init(hystgen_inverse_t *self) {
    hystgen_inverse_settings_init(self);
    hystgen_loop_init(self->play);
    hystgen_inverse_begin(self, HYSTGEN_INVERSE_INIT_DRIVE, HYSTGEN_INVERSE_INIT_ASCENDING);
}

void hystgen_inverse_reset(hystgen_inverse_t *self, hystgen_real_t u) {
    hystgen_loop_rest(&hystgen_model_tables, self->play, 0);
    hystgen_inverse_begin(self, HYSTGEN_INVERSE_RESET_DRIVE, HYSTGEN_INVERSE_RESET_ASCENDING);
    (void)hystgen_inverse_step(self, u);
}

void hystgen_forward_settle(hystgen_forward_t *self, hystgen_real_t v) {
    if (!hystgen_finite(v)) {
        self->status |= HYSTGEN_STATUS_HELD;
        return;
    }
    const hystgen_real_t inside = hystgen_applied_drive(v);
    if (inside < v || inside > v) {
        self->status |= HYSTGEN_STATUS_INPUT_CLAMPED;
    }
    if (self->moving) {
        hystgen_forward_travelled(self, inside);
    }
    self->moving = false;
    hystgen_forward_absorb(self, inside);
}

void hystgen_inverse_settle(hystgen_inverse_t *self, hystgen_real_t v) {
    hystgen_inverse_take(self);
    if (!hystgen_finite(v)) {
        self->status |= HYSTGEN_STATUS_HELD;
        return;
    }
    const hystgen_real_t inside = hystgen_applied_drive(v);
    if (inside < v || inside > v) {
        self->status |= HYSTGEN_STATUS_INPUT_CLAMPED;
    }
    if (self->moving) {
        hystgen_inverse_travelled(self, inside);
    }
    self->moving = false;
    hystgen_inverse_absorb(self, inside);
}

/* Sets the offset, within its limits. */
static void hystgen_forward_put_offset(hystgen_forward_t *self, hystgen_signal_t d) {
    if (!hystgen_finite(d)) {
        self->status |= HYSTGEN_STATUS_HELD;
        return;
    }
    const hystgen_signal_t inside = hystgen_inside_offset(d);
    if (inside < d || inside > d) {
        self->status |= HYSTGEN_STATUS_LIMITED_SETTING;
    }
    self->offset = inside;
}

void hystgen_forward_set_offset(hystgen_forward_t *self, hystgen_real_t d) {
    const hystgen_signal_t level = hystgen_entered_level(d);
    hystgen_forward_put_offset(self, level);
    if (hystgen_finite(level)) {
        hystgen_forward_clock_start(self);
    }
}

/* Sets the offset, within its limits. */
static void hystgen_inverse_put_offset(hystgen_inverse_t *self, hystgen_signal_t d) {
    if (!hystgen_finite(d)) {
        self->status |= HYSTGEN_STATUS_HELD;
        return;
    }
    const hystgen_signal_t inside = hystgen_inside_offset(d);
    if (inside < d || inside > d) {
        self->status |= HYSTGEN_STATUS_LIMITED_SETTING;
    }
    self->offset = inside;
}

void hystgen_inverse_set_offset(hystgen_inverse_t *self, hystgen_real_t d) {
    const hystgen_signal_t level = hystgen_entered_level(d);
    hystgen_inverse_put_offset(self, level);
    if (hystgen_finite(level)) {
        hystgen_inverse_clock_start(self);
    }
}

void hystgen_forward_set_temperature(hystgen_forward_t *self, hystgen_real_t temperature) {
    if (!hystgen_finite(temperature)) {
        self->status |= HYSTGEN_STATUS_HELD;
    } else if (hystgen_forward_heat(self, temperature)) {
        self->status |= HYSTGEN_STATUS_LIMITED_SETTING;
    }
}

void hystgen_inverse_set_temperature(hystgen_inverse_t *self, hystgen_real_t temperature) {
    if (!hystgen_finite(temperature)) {
        self->status |= HYSTGEN_STATUS_HELD;
    } else if (hystgen_inverse_heat(self, temperature)) {
        self->status |= HYSTGEN_STATUS_LIMITED_SETTING;
    }
}

HYSTGEN_ALONE hystgen_real_t hystgen_forward_step(hystgen_forward_t *self, hystgen_real_t v) {
    if (!hystgen_finite(v)) {
        self->status |= HYSTGEN_STATUS_HELD;
        return self->answer;
    }
    const hystgen_real_t inside = hystgen_clamp_drive(v);
    if (inside < v || inside > v) {
        self->status |= HYSTGEN_STATUS_INPUT_CLAMPED;
    }
    hystgen_forward_absorb(self, inside);
    self->answer =
        hystgen_output_code(hystgen_forward_displaced(self, self->output), &self->status);
    return self->answer;
}

/* Takes the next reference. Returns the output that the output side has to reach at this sample. */
HYSTGEN_APART_IN_FIXED hystgen_signal_t hystgen_inverse_put(hystgen_inverse_t *self,
                                                            hystgen_real_t u) {
    bool limited = false;
    const hystgen_real_t level = hystgen_inverse_clamp(u);
    if (level < u || level > u) {
        self->status |= HYSTGEN_STATUS_INPUT_CLAMPED;
    }
    const hystgen_signal_t wanted =
        hystgen_inverse_undisplaced(self, hystgen_entered_level(level), &limited);
    if (limited) {
        self->status |= HYSTGEN_STATUS_DOMAIN;
    }
    return hystgen_inverse_ahead(self, wanted);
}

void hystgen_inverse_push(hystgen_inverse_t *self, hystgen_real_t u) {
    if (hystgen_finite(u)) {
        (void)hystgen_inverse_put(self, u);
    } else {
        self->status |= HYSTGEN_STATUS_HELD;
        hystgen_inverse_repeat(self);
    }
}

/* The sum of the plays with which the output side gives y; the memory is up to date. */
HYSTGEN_APART_IN_FIXED hystgen_signal_t hystgen_inverse_wanted(hystgen_inverse_t *self,
                                                               hystgen_signal_t y) {
    return self->moving ? hystgen_inverse_output_side_solve(self, y)
                        : hystgen_inverse_output_side_resting(self, y);
}

/* The drive that leads to an input w of the plays, at which their sum is h. */
HYSTGEN_APART_IN_FIXED hystgen_reach_t hystgen_inverse_sought(hystgen_inverse_t *self,
                                                              hystgen_signal_t h,
                                                              hystgen_reach_t w) {
    self->bits = 0;
    const hystgen_signal_t a = hystgen_inverse_finer(self, h, w, hystgen_inverse_drive(self, h, w));
    return hystgen_drive_code(self->moving ? hystgen_inverse_drive_side_solve(self, a) : a);
}

/* The drive v within its limits. */
static hystgen_real_t hystgen_inverse_limited(hystgen_inverse_t *self, hystgen_reach_t v) {
    const hystgen_reach_t reached = hystgen_inverse_slewed(self, v);
    if (reached < v || reached > v) {
        self->bits |= HYSTGEN_STATUS_SLEW_LIMITED;
    }
    const hystgen_real_t inside = hystgen_clamp_drive(reached);
    if (inside < reached || inside > reached) {
        self->bits |= HYSTGEN_STATUS_OUTPUT_CLAMPED;
    }
    self->status |= self->bits;
    return inside;
}

HYSTGEN_ALONE hystgen_real_t hystgen_inverse_step(hystgen_inverse_t *self, hystgen_real_t u) {
    hystgen_inverse_take(self);
    if (!hystgen_finite(u)) {
        self->status |= HYSTGEN_STATUS_HELD;
        hystgen_inverse_repeat(self);
        return hystgen_inverse_answer(self, self->stepped ? self->answer : self->applied);
    }
    const hystgen_signal_t h = hystgen_inverse_wanted(self, hystgen_inverse_put(self, u));
    const hystgen_reach_t w = hystgen_inverse_input(self, h);
    const hystgen_reach_t v = hystgen_inverse_sought(self, h, w);
    return hystgen_inverse_answer(self, hystgen_inverse_limited(self, v));
}

void hystgen_inverse_commit(hystgen_inverse_t *self, hystgen_real_t applied) {
    if (!hystgen_finite(applied)) {
        self->status |= HYSTGEN_STATUS_HELD;
        return;
    }
    const hystgen_real_t inside = hystgen_applied_drive(applied);
    if (inside < applied || inside > applied) {
        self->status |= HYSTGEN_STATUS_INPUT_CLAMPED;
    }
    self->pending = inside;
    self->has_pending = true;
}

hystgen_real_t hystgen_inverse_expected(const hystgen_inverse_t *self) {
    unsigned int status = 0; /* not reported: this is no step */
    return hystgen_output_code(hystgen_inverse_displaced(self, self->output), &status);
}

void hystgen_inverse_correct(hystgen_inverse_t *self, hystgen_real_t measured,
                             hystgen_real_t share) {
    const hystgen_signal_t more =
        hystgen_entered_level(measured) - hystgen_inverse_displaced(self, self->output);
    hystgen_inverse_put_offset(self, self->offset + hystgen_shared(share, more));
}
