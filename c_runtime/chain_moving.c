#include "hystgen_runtime.h"

/* Operators of a model with effects: plays that an effect moves or bends in its own way. Play i is
   kept as where it would come to rest (`play`) and what it contributes there (`bent`). */

/* What the plays give once their input has gone to w. It rises with w. */
static hystgen_real_t hystgen_moved_sum(const hystgen_real_t *play, const hystgen_real_t *bent,
                                        hystgen_real_t w) {
    hystgen_real_t sum = hystgen_play.weight[0] * w;
    unsigned int i;
    for (i = 1; i <= HYSTGEN_N_PLAYS; ++i) {
        const hystgen_real_t z = hystgen_moved(i, play, w);
        const bool rests = z >= play[i] && z <= play[i];
        sum = sum + hystgen_play.weight[i] * (rests ? bent[i] : hystgen_bent(i, z));
    }
    return sum;
}

/* The plays follow their input w. Returns their sum. */
static hystgen_real_t hystgen_moved_follow(hystgen_real_t *play, hystgen_real_t *bent,
                                           hystgen_real_t w) {
    hystgen_real_t sum = hystgen_play.weight[0] * w;
    unsigned int i;
    for (i = 1; i <= HYSTGEN_N_PLAYS; ++i) {
        const hystgen_real_t z = hystgen_moved(i, play, w);
        const hystgen_real_t rest = hystgen_left(i, z, w);
        const bool rests = z >= play[i] && z <= play[i];
        const hystgen_real_t value = rests ? bent[i] : hystgen_bent(i, z);
        sum = sum + hystgen_play.weight[i] * value;
        bent[i] = rest >= z && rest <= z ? value : hystgen_bent(i, rest);
        hystgen_keep(i, play, w, rest);
    }
    play[0] = w;
    return sum;
}

/* The plays as they are set, at rest with their input at w. Returns their sum. */
static hystgen_real_t hystgen_moved_rest(hystgen_real_t *play, hystgen_real_t *bent,
                                         hystgen_real_t w) {
    hystgen_real_t sum = hystgen_play.weight[0] * w;
    unsigned int i;
    for (i = 1; i <= HYSTGEN_N_PLAYS; ++i) {
        const hystgen_real_t low = w - hystgen_play.threshold[i];
        const hystgen_real_t high = w + hystgen_play.threshold[i];
        const hystgen_real_t upper = play[i] > high ? high : play[i];
        hystgen_put(i, play, upper < low ? low : upper);
        bent[i] = hystgen_bent(i, play[i]);
        sum = sum + hystgen_play.weight[i] * bent[i];
    }
    play[0] = w;
    return sum;
}

/* The plays follow their input w. Returns their sum. */
static hystgen_real_t hystgen_forward_follow(hystgen_forward_t *self, hystgen_real_t w) {
    return self->moving ? hystgen_moved_follow(self->play, self->bent, w)
                        : hystgen_moved_rest(self->play, self->bent, w);
}

/* The plays follow their input w. Returns their sum. */
static hystgen_real_t hystgen_inverse_follow(hystgen_inverse_t *self, hystgen_real_t w) {
    return self->moving ? hystgen_moved_follow(self->play, self->bent, w)
                        : hystgen_moved_rest(self->play, self->bent, w);
}

/* What rest at an input w gives, for plays as they are. */
static hystgen_real_t hystgen_resting_sum(const hystgen_real_t *play, hystgen_real_t w) {
    hystgen_real_t sum = hystgen_play.weight[0] * w;
    unsigned int i;
    for (i = 1; i <= HYSTGEN_N_PLAYS; ++i) {
        const hystgen_real_t low = w - hystgen_play.threshold[i];
        const hystgen_real_t high = w + hystgen_play.threshold[i];
        const hystgen_real_t upper = play[i] > high ? high : play[i];
        sum = sum + hystgen_play.weight[i] * hystgen_bent(i, upper < low ? low : upper);
    }
    return sum;
}

/* Sum of the plays as they are set. */
static hystgen_real_t hystgen_forward_started(hystgen_forward_t *self) {
    return hystgen_moved_rest(self->play, self->bent, self->play[0]);
}

/* Sum of the plays as they are set. */
static hystgen_real_t hystgen_inverse_started(hystgen_inverse_t *self) {
    return hystgen_moved_rest(self->play, self->bent, self->play[0]);
}

/* What the plays give with their input at w. */
static hystgen_real_t hystgen_inverse_sum(const hystgen_inverse_t *self, hystgen_real_t w) {
    return self->moving ? hystgen_moved_sum(self->play, self->bent, w)
                        : hystgen_resting_sum(self->play, w);
}

/* Input of the plays at which their sum is h, by halves between where it is and the farthest. */
static hystgen_real_t hystgen_inverse_input(const hystgen_inverse_t *self, hystgen_real_t h) {
    const hystgen_real_t here = self->play[0];
    const hystgen_real_t sum = hystgen_inverse_sum(self, here);
    hystgen_real_t low = sum < h ? here : HYSTGEN_LEAST_INPUT;
    hystgen_real_t high = sum < h ? HYSTGEN_LARGEST_INPUT : here;
    unsigned int i;
    if (sum >= h && sum <= h) {
        return here;
    }
    for (i = 0; i < HYSTGEN_HALVES; ++i) {
        const hystgen_real_t w = low + (high - low) / 2;
        if (hystgen_inverse_sum(self, w) < h) {
            low = w;
        } else {
            high = w;
        }
    }
    return high;
}
