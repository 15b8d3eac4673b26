/* Operators of a model with effects: drives in front of a memoryless part with two branches. Called
   by chain_calls.c. */
#ifndef HYSTGEN_CONFIGURED
#define HYSTGEN_HAS_FRONT
#define HYSTGEN_HAS_TWO_BRANCHES
#endif
#include "compensator/chain/model.h"
#include "front/front.c"
#include "compensator/clamp.c"

#ifdef HYSTGEN_HAS_STEADY_LAG
/* Whether a drive that should go back by `back` goes to the other branch, `way` from there: only if
   holding misses more than what the lag misses of that way in the first sample of a turn. */
static inline bool hystgen_turns(hystgen_signal_t back, hystgen_signal_t way) {
    return back - HYSTGEN_HOLD > hystgen_inverse_missed(way < 0 ? -way : way);
}
#else
/* Whether a drive that should go back by `back` goes to the other branch, `way` from there. */
static inline bool hystgen_turns(hystgen_signal_t back, hystgen_signal_t way) {
    (void)way;
    return back > HYSTGEN_HOLD;
}
#endif

/* The drive that gives w on the branch of its own move. Stays on the branch that it is on, where it
   moves on or holds, and turns only for more than that is worth. Sets a status bit if no drive
   gives w. */
HYSTGEN_APART_BUT_IN_FLOAT_LOOP hystgen_reach_t hystgen_inverse_drive(hystgen_inverse_t *self,
                                                                      hystgen_real_t level,
                                                                      hystgen_reach_t w) {
    bool limited;
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
