/* Heat of hysteresis loops: a few plays represent all internal friction. In fixed point these have
   as many bits below a drive code as fit. Called by the functions that emission writes for a chain,
   see compensator/chain/model.h. */
#include "compensator/chain/model.h"

#ifdef HYSTGEN_FIXED
static void hystgen_friction_init(hystgen_friction_t *self) {
    self->begun = false;
}

/* The plays start at rest at the drive. */
static void hystgen_friction_begin(const hystgen_friction_table_t *t, hystgen_friction_t *self,
                                   hystgen_friction_state_t *state, hystgen_real_t v) {
    unsigned int i;
    for (i = 0; i < t->n; ++i) {
        state[i].at = (int32_t)(v * ((int64_t)1 << t->bits));
    }
    self->begun = true;
}

/* The drive has moved from `before` to v. Returns the sum of the plays' moves, each times the odd
   ratio of its threshold to the first. If a play stays, so do those with larger thresholds. */
HYSTGEN_APART int64_t hystgen_friction_move(const hystgen_friction_table_t *t,
                                            hystgen_friction_t *self,
                                            hystgen_friction_state_t *state, hystgen_real_t before,
                                            hystgen_real_t v) {
    const int64_t x = v * ((int64_t)1 << t->bits);
    int64_t amount = 0;
    unsigned int i;
    if (!self->begun) {
        hystgen_friction_begin(t, self, state, before);
    }
    for (i = 0; i < t->n; ++i) {
        const int64_t r = t->play[i].threshold;
        const int64_t at = state[i].at;
        int64_t to = at;
        if (x - r > at) {
            to = x - r;
        } else if (x + r < at) {
            to = x + r;
        }
        const int64_t way = to >= at ? to - at : at - to;
        if (way == 0) {
            break;
        }
        state[i].at = (int32_t)to;
        amount += (int64_t)(2u * i + 1u) * way;
    }
    return amount;
}
#else
static void hystgen_friction_init(hystgen_friction_t *self) {
    self->begun = false;
}

/* The plays start at rest at the drive. */
static void hystgen_friction_begin(const hystgen_friction_table_t *t, hystgen_friction_t *self,
                                   hystgen_friction_state_t *state, hystgen_real_t v) {
    unsigned int i;
    for (i = 0; i < t->n; ++i) {
        state[i].at = v;
    }
    self->begun = true;
}

/* The drive has moved from `before` to v. Returns the sum of the plays' moves, each times the odd
   ratio of its threshold to the first. If a play stays, so do those with larger thresholds. */
static hystgen_real_t hystgen_friction_move(const hystgen_friction_table_t *t,
                                            hystgen_friction_t *self,
                                            hystgen_friction_state_t *state, hystgen_real_t before,
                                            hystgen_real_t v) {
    hystgen_real_t amount = 0;
    hystgen_real_t odd = 1;
    unsigned int i;
    if (!self->begun) {
        hystgen_friction_begin(t, self, state, before);
    }
    for (i = 0; i < t->n; ++i) {
        const hystgen_real_t r = t->play[i].threshold;
        const hystgen_real_t at = state[i].at;
        if (v - r > at) {
            state[i].at = v - r;
            amount += odd * (state[i].at - at);
        } else if (v + r < at) {
            state[i].at = v + r;
            amount += odd * (at - state[i].at);
        } else {
            break;
        }
        odd += 2;
    }
    return amount;
}
#endif
