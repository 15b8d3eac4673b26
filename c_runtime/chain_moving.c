#include "hystgen_runtime.h"

/* Operators of a model with effects: plays that an effect moves or bends in its own way. The state
   of play i is the value at which it would come to rest (`play`) and what it contributes there
   (`bent`). */

/* The plays move while their input goes to w. Returns their sum. */
HYSTGEN_APART hystgen_sum_t hystgen_moved_follow(hystgen_play_t *play, hystgen_sum_t *bent,
                                                 hystgen_play_t w) {
    hystgen_sum_t sum = (hystgen_sum_t)hystgen_model_tables.weight[0] * w;
    unsigned int i;
    HYSTGEN_ROLLED
    for (i = 1; i <= HYSTGEN_N_PLAYS; ++i) {
        const hystgen_play_t before = play[i];
        hystgen_move(i, play, w);
        if (play[i] < before || play[i] > before) {
            bent[i] = hystgen_bent(i, play[i]);
        }
        sum = sum + hystgen_model_tables.weight[i] * bent[i];
    }
    play[0] = w;
    return sum;
}

/* The plays come to rest with their input at w. Returns their sum. */
HYSTGEN_APART hystgen_sum_t hystgen_moved_rest(hystgen_play_t *play, hystgen_sum_t *bent,
                                               hystgen_play_t w) {
    hystgen_sum_t sum = (hystgen_sum_t)hystgen_model_tables.weight[0] * w;
    unsigned int i;
    HYSTGEN_ROLLED
    for (i = 1; i <= HYSTGEN_N_PLAYS; ++i) {
        hystgen_put(i, play, hystgen_resting(i, play, w));
        bent[i] = hystgen_bent(i, play[i]);
        sum = sum + hystgen_model_tables.weight[i] * bent[i];
    }
    play[0] = w;
    return sum;
}

/* The plays follow their input w to another sum. */
static void hystgen_forward_follow(hystgen_forward_t *self, hystgen_play_t w) {
    if (self->moving) {
        self->level = hystgen_level(hystgen_moved_follow(self->play, self->bent, w));
        hystgen_relax(self->play, self->bent);
    } else {
        self->level = hystgen_level(hystgen_moved_rest(self->play, self->bent, w));
    }
}

/* The plays follow their input w to another sum. */
static void hystgen_inverse_follow(hystgen_inverse_t *self, hystgen_play_t w) {
    if (self->moving) {
        self->level = hystgen_level(hystgen_moved_follow(self->play, self->bent, w));
        hystgen_relax(self->play, self->bent);
    } else {
        self->level = hystgen_level(hystgen_moved_rest(self->play, self->bent, w));
    }
}

/* Sum of the plays in the start memory. */
static hystgen_signal_t hystgen_forward_started(hystgen_forward_t *self) {
    return hystgen_level(hystgen_moved_rest(self->play, self->bent, self->play[0]));
}

/* Sum of the plays in the start memory. */
static hystgen_signal_t hystgen_inverse_started(hystgen_inverse_t *self) {
    return hystgen_level(hystgen_moved_rest(self->play, self->bent, self->play[0]));
}

/* What the plays give once their input has gone to w, or rests there. It rises with w. */
HYSTGEN_APART_IN_FIXED hystgen_sum_t hystgen_inverse_sum(const hystgen_inverse_t *self,
                                                         hystgen_play_t w) {
    hystgen_sum_t sum = (hystgen_sum_t)hystgen_model_tables.weight[0] * w;
    unsigned int i;
    if (self->moving) {
        for (i = 1; i <= HYSTGEN_N_PLAYS; ++i) {
            const hystgen_sum_t value = hystgen_value(i, self->play, self->bent, w);
            sum = sum + hystgen_model_tables.weight[i] * value;
        }
        return sum;
    }
    HYSTGEN_ROLLED
    for (i = 1; i <= HYSTGEN_N_PLAYS; ++i) {
        const hystgen_play_t z = hystgen_resting(i, self->play, w);
        const hystgen_sum_t value = hystgen_contributed(i, self->play, self->bent, z);
        sum = sum + hystgen_model_tables.weight[i] * value;
    }
    return sum;
}
