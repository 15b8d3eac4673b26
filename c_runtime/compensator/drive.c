/* Conversion between drives and inputs of the plays, with a memoryless part of one or two branches
   or without one. Called by the operators. */
#ifndef HYSTGEN_DRIVE_C
#define HYSTGEN_DRIVE_C
#include "compensator/model.h"
#include "front/front.c"
#include "compensator/clamp.c"

/* The actuator has moved to drive v. */
static void hystgen_operator_set_drive(hystgen_operator_t *self, hystgen_fine_t v) {
#ifdef HYSTGEN_HAS_TWO_BRANCHES
    if (v > self->drive) { /* the direction of the move picks the branch */
        self->ascending = true;
    } else if (v < self->drive) {
        self->ascending = false;
    }
#endif
    self->drive = v;
}

/* The actuator has moved to drive v. Returns the input of the plays. */
static hystgen_play_t hystgen_operator_arrive(hystgen_operator_t *self, hystgen_fine_t v) {
    hystgen_operator_set_drive(self, v);
#ifdef HYSTGEN_HAS_TWO_BRANCHES
    return hystgen_front_forward(v, self->ascending);
#elif defined(HYSTGEN_HAS_FRONT)
    return hystgen_front_forward(v, true);
#else
    return hystgen_front_forward(v);
#endif
}

#ifndef HYSTGEN_HAS_FRONT
/* Drive for an input w of the plays. */
static hystgen_reach_t hystgen_inverse_drive(hystgen_inverse_t *self, hystgen_real_t level,
                                             hystgen_reach_t w) {
    (void)self;
    (void)level;
    return hystgen_front_inverse(w);
}
#elif defined(HYSTGEN_CHAIN) && defined(HYSTGEN_HAS_TWO_BRANCHES)
#ifdef HYSTGEN_HAS_STEADY_LAG
/* Whether a drive that should move back by `back` turns to the other branch, a distance `way` away:
   only if holding costs a larger error than the lag does over `way` in the first sample. */
static inline bool hystgen_turns(hystgen_signal_t back, hystgen_signal_t way) {
    return back - HYSTGEN_HOLD > hystgen_inverse_missed(way < 0 ? -way : way);
}
#else
/* Whether a drive that should move back by `back` turns to the other branch. */
static inline bool hystgen_turns(hystgen_signal_t back, hystgen_signal_t way) {
    (void)way;
    return back > HYSTGEN_HOLD;
}
#endif

/* Drive for an input w of the plays, on the branch of its own move. Stays on the present branch,
   moving on or holding, and turns only if holding costs more than the turn. Sets a status bit if no
   drive reaches w. */
HYSTGEN_APART_BUT_IN_FLOAT_LOOP hystgen_reach_t hystgen_inverse_drive(hystgen_inverse_t *self,
                                                                      hystgen_real_t level,
                                                                      hystgen_reach_t w) {
    bool limited = false;
    const bool up = self->ascending;
    hystgen_reach_t v = hystgen_front_inverse(w, up, &limited);
    const hystgen_fine_t on = hystgen_clamp_fine(v);
    (void)level;
    if (up ? on < self->drive : on > self->drive) {
        v = hystgen_front_inverse(w, !up, &limited);
        const hystgen_fine_t over = hystgen_clamp_fine(v);
        const hystgen_reach_t back = (hystgen_reach_t)on - self->drive;
        const bool fits = up ? over < self->drive : over > self->drive;
        if (!fits || !hystgen_turns(up ? -back : back, (hystgen_reach_t)over - on)) {
            v = self->drive;
        }
    }
    if (limited) {
        self->bits |= HYSTGEN_STATUS_DOMAIN;
    }
    return v;
}
#else
#ifdef HYSTGEN_HAS_TWO_BRANCHES
/* Whether the move to v belongs to the branch that v was computed on. */
static bool hystgen_inverse_fits(const hystgen_inverse_t *self, hystgen_reach_t v, bool ascending) {
    const hystgen_fine_t inside = hystgen_clamp_fine(v);
    if (inside > self->drive) {
        return ascending;
    }
    if (inside < self->drive) {
        return !ascending;
    }
    return self->ascending == ascending;
}

/* Drive for an input w of the plays, on the branch of its own move. Tries the branch of the
   reference's move, then the other one; if neither fits, the drive holds. Sets `limited` if no
   drive reaches w. */
HYSTGEN_APART_IN_FLOAT_CORNERS hystgen_reach_t hystgen_inverse_choose(const hystgen_inverse_t *self,
                                                                      hystgen_real_t level,
                                                                      hystgen_reach_t w,
                                                                      bool *limited) {
    bool up = self->ascending;
    if (level > self->last) {
        up = true;
    } else if (level < self->last) {
        up = false;
    }
    hystgen_reach_t v = hystgen_front_inverse(w, up, limited);
    if (!hystgen_inverse_fits(self, v, up)) {
        const hystgen_reach_t back = (hystgen_reach_t)hystgen_clamp_fine(v) - self->drive;
        if (up == self->ascending && back >= -HYSTGEN_HOLD && back <= HYSTGEN_HOLD) {
            /* the drive moves back only by rounding */
            v = self->drive;
        } else {
            v = hystgen_front_inverse(w, !up, limited);
            v = hystgen_inverse_fits(self, v, !up) ? v : self->drive;
        }
    }
    return v;
}
#else
/* Drive for an input w of the plays, or the nearest possible one. */
HYSTGEN_APART_IN_FLOAT_CORNERS hystgen_reach_t hystgen_inverse_choose(const hystgen_inverse_t *self,
                                                                      hystgen_real_t level,
                                                                      hystgen_reach_t w,
                                                                      bool *limited) {
    (void)self;
    (void)level;
    return hystgen_front_inverse(w, true, limited);
}
#endif

/* Drive for an input w of the plays; the reference is already limited. */
static hystgen_reach_t hystgen_inverse_drive(hystgen_inverse_t *self, hystgen_real_t level,
                                             hystgen_reach_t w) {
    bool limited = false;
    const hystgen_reach_t v = hystgen_inverse_choose(self, level, w, &limited);
    self->last = level;
    if (limited) {
        self->bits |= HYSTGEN_STATUS_DOMAIN;
    }
    return v;
}
#endif

#endif
