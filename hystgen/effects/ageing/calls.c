/* Ageing: the travel, and the gain that follows it. Called by users. */
#include "compensator/chain/model.h"
#include "compensator/chain/signals.c"
#include "effects/ageing/ageing.c"

hystgen_travel_t hystgen_operator_travel(const hystgen_operator_t *self) {
    return self->ageing_1.high;
}

void hystgen_operator_set_travel(hystgen_operator_t *self, hystgen_travel_t travel) {
    if (!hystgen_finite(travel)) {
        self->status |= HYSTGEN_STATUS_HELD;
    } else if (hystgen_ageing_set_travel(&hystgen_ageing_1, &self->ageing_1, travel)) {
        self->status |= HYSTGEN_STATUS_LIMITED_SETTING;
    }
}

void hystgen_operator_set_gain(hystgen_operator_t *self, hystgen_real_t gain) {
    if (!hystgen_finite(gain)) {
        self->status |= HYSTGEN_STATUS_HELD;
    } else if (hystgen_ageing_set(&hystgen_ageing_1, &self->ageing_1, gain)) {
        self->status |= HYSTGEN_STATUS_LIMITED_SETTING;
    }
}
