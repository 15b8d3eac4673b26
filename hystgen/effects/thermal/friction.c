/* Heat of hysteresis loops: a few plays represent all internal friction. In fixed point these have
   as many bits below a drive code as fit. Called by the functions that emission writes for a chain,
   see compensator/chain/model.h. */
#include "compensator/chain/model.h"

static void hystgen_friction_init(hystgen_friction_t *self) {
    self->begun = false;
}

/* A drive as a value of the plays. */
static inline hystgen_signal_t hystgen_friction_input(const hystgen_friction_table_t *t,
                                                      hystgen_real_t v) {
#ifdef HYSTGEN_FIXED
    return v * ((int64_t)1 << t->bits);
#else
    (void)t;
    return v;
#endif
}

/* The plays start at rest at the drive. */
static void hystgen_friction_begin(const hystgen_friction_table_t *t, hystgen_friction_t *self,
                                   hystgen_friction_state_t *state, hystgen_real_t v) {
    unsigned int i;
    for (i = 0; i < t->n; ++i) {
        state[i].at = (hystgen_narrow_t)hystgen_friction_input(t, v);
    }
    self->begun = true;
}

/* The drive has moved from `before` to v. Returns the sum of the plays' moves, each times the odd
   ratio of its threshold to the first. If a play stays, so do those with larger thresholds. */
HYSTGEN_APART_IN_FIXED_BLOCK hystgen_signal_t
hystgen_friction_move(const hystgen_friction_table_t *t, hystgen_friction_t *self,
                      hystgen_friction_state_t *state, hystgen_real_t before, hystgen_real_t v) {
    const hystgen_signal_t x = hystgen_friction_input(t, v);
    hystgen_signal_t amount = 0;
    hystgen_narrow_t odd = 1;
    unsigned int i;
    if (!self->begun) {
        hystgen_friction_begin(t, self, state, before);
    }
    for (i = 0; i < t->n; ++i) {
        const hystgen_signal_t r = t->play[i].threshold;
        const hystgen_signal_t at = state[i].at;
        hystgen_signal_t way;
        if (x - r > at) {
            state[i].at = (hystgen_narrow_t)(x - r);
            way = (x - r) - at;
        } else if (x + r < at) {
            state[i].at = (hystgen_narrow_t)(x + r);
            way = at - (x + r);
        } else {
            break;
        }
        amount += (hystgen_signal_t)odd * way;
        odd += 2;
    }
    return amount;
}
