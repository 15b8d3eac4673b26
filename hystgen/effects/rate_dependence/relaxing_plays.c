/* Operators of a model with viscous plays of one time constant. The first move finds them at rest,
   as it finds plain ones. Called by chain.c and chain_calls.c. */
#include "compensator/chain/model.h"
#include "compensator/chain/plays_solve.c"
#include "effects/rate_dependence/relaxing.c"
#include "compensator/chain/signals.c"

/* Sum of the plays. */
static hystgen_signal_t hystgen_operator_started(const hystgen_operator_t *self) {
    return hystgen_level(hystgen_loop_output(&hystgen_model_tables, self->play));
}

/* The plays follow their input w to another sum. */
HYSTGEN_APART_IN_FIXED void hystgen_operator_follow(hystgen_operator_t *self, hystgen_play_t w) {
    if (self->moving) {
        self->level = hystgen_level(hystgen_relaxing_follow(self->play, w));
    } else {
        hystgen_loop_absorb(&hystgen_model_tables, self->play, w);
        self->level = hystgen_operator_started(self);
    }
}

#ifdef HYSTGEN_INVERSE
/* Input of the plays at which their sum is h. */
HYSTGEN_APART_IN_FIXED hystgen_reach_t hystgen_inverse_input(hystgen_inverse_t *self,
                                                             hystgen_signal_t h) {
    return self->moving ? hystgen_relaxing_input(self->play, hystgen_asked(h))
                        : hystgen_input_of(self->play, self->level, h);
}
#endif
