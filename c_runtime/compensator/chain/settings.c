/* Operators of a model with effects: the calls that only such models have. Called by users. */
#include "compensator/chain/model.h"
#include "compensator/chain/chain.c"
#include "compensator/chain/chain_calls.c"

void hystgen_operator_settle(hystgen_operator_t *self, hystgen_real_t v) {
#ifdef HYSTGEN_INVERSE
    hystgen_inverse_take(self);
#endif
    if (!hystgen_finite(v)) {
        self->status |= HYSTGEN_STATUS_HELD;
        return;
    }
    const hystgen_real_t inside = hystgen_applied_drive(v);
    if (inside < v || inside > v) {
        self->status |= HYSTGEN_STATUS_INPUT_CLAMPED;
    }
    if (self->moving) {
        hystgen_operator_travelled(self, inside);
    }
    self->moving = false;
    hystgen_operator_absorb(self, inside);
}

/* Sets the offset, limited to the span of the displacement. */
static void hystgen_operator_put_offset(hystgen_operator_t *self, hystgen_signal_t d) {
    if (!hystgen_finite(d)) {
        self->status |= HYSTGEN_STATUS_HELD;
        return;
    }
    if (d > HYSTGEN_FARTHEST_OFFSET) {
        self->offset = HYSTGEN_FARTHEST_OFFSET;
        self->status |= HYSTGEN_STATUS_LIMITED_SETTING;
    } else if (d < -HYSTGEN_FARTHEST_OFFSET) {
        self->offset = -HYSTGEN_FARTHEST_OFFSET;
        self->status |= HYSTGEN_STATUS_LIMITED_SETTING;
    } else {
        self->offset = d;
    }
}

void hystgen_operator_set_offset(hystgen_operator_t *self, hystgen_real_t d) {
    const hystgen_signal_t level = hystgen_level_signal(d);
    hystgen_operator_put_offset(self, level);
    if (hystgen_finite(level)) {
        hystgen_operator_clock_start(self);
    }
}

void hystgen_operator_set_temperature(hystgen_operator_t *self, hystgen_real_t temperature) {
    if (!hystgen_finite(temperature)) {
        self->status |= HYSTGEN_STATUS_HELD;
    } else if (hystgen_operator_heat(self, temperature)) {
        self->status |= HYSTGEN_STATUS_LIMITED_SETTING;
    }
}

void hystgen_operator_set_influence(hystgen_operator_t *self, unsigned int i,
                                    hystgen_real_t value) {
    if (!hystgen_finite(value)) {
        self->status |= HYSTGEN_STATUS_HELD;
    } else if (hystgen_operator_influence(self, i, value)) {
        self->status |= HYSTGEN_STATUS_LIMITED_SETTING;
    }
}

#ifdef HYSTGEN_INVERSE
void hystgen_inverse_push(hystgen_inverse_t *self, hystgen_real_t u) {
    hystgen_real_t level = u;
    if (!hystgen_is_reference(u)) {
        if (!hystgen_finite(u)) {
            hystgen_inverse_unread(self);
            return;
        }
        level = hystgen_inverse_clamp(u);
        self->status |= HYSTGEN_STATUS_INPUT_CLAMPED;
    }
    (void)hystgen_inverse_put(self, level);
}

hystgen_real_t hystgen_inverse_expected(const hystgen_inverse_t *self) {
    return hystgen_operator_shown(self);
}

void hystgen_inverse_correct(hystgen_inverse_t *self, hystgen_real_t measured,
                             hystgen_real_t share) {
    const hystgen_signal_t more = hystgen_level_signal(measured) -
                                  hystgen_operator_displaced(self, hystgen_operator_output(self));
    hystgen_operator_put_offset(self, self->offset + hystgen_shared(share, more));
}
#endif
