/* Viscous plays with one time constant. The state of a play is its rest value (`play`). At the end
   of a step its input w has stretched the play by the excess over the threshold; the play gains a
   share of this stretch. Exact while the play slides or rests; contact that begins or ends within a
   step counts from the first touch. In fixed point a play stops where its stretch would gain less
   than half a step of the plays' input in a sample. Before the first move the plays are at rest,
   like plain ones. Called by chain.c and chain_calls.c. */
#include "compensator/chain/model.h"
#include "compensator/chain/plays_solve.c"
#include "effects/rate_dependence/stretch.c"
#include "compensator/chain/signals.c"
#ifdef HYSTGEN_FIXED
#include "arithmetic/factors.c"
#endif

#ifdef HYSTGEN_FIXED
/* The rest value of play i, no farther from that of play i - 1 than their thresholds differ,
   despite rounding. */
static hystgen_play_t hystgen_limited_rest(const hystgen_play_t *play, unsigned int i,
                                           int64_t rest) {
    const hystgen_tables_t *t = &hystgen_model_tables;
    if (i > 1u) {
        const int64_t room = (int64_t)t->threshold[i] - t->threshold[i - 1u];
        const int64_t low = play[i - 1u] - room;
        const int64_t high = play[i - 1u] + room;
        if (rest < low) {
            return (hystgen_play_t)low;
        }
        if (rest > high) {
            return (hystgen_play_t)high;
        }
        return (hystgen_play_t)rest;
    }
    return (hystgen_play_t)rest;
}

/* The plays follow their input w. Returns their sum. */
HYSTGEN_APART hystgen_sum_t hystgen_relaxing_follow(hystgen_play_t *play, hystgen_play_t w) {
    const hystgen_tables_t *t = &hystgen_model_tables;
    hystgen_sum_t sum = (hystgen_sum_t)t->weight[0] * w;
    unsigned int i;
    for (i = 1; i <= t->n; ++i) {
        const int32_t r = t->threshold[i];
        const int64_t on = hystgen_stretch((int64_t)w - play[i], r);
        const int64_t z = play[i] + hystgen_times(on, &hystgen_relaxing_late);
        const int64_t left = hystgen_times(hystgen_stretch(w - z, r), &hystgen_relaxing_kept);
        sum += t->weight[i] * z;
        play[i] = hystgen_limited_rest(play, i, z + left);
    }
    play[0] = w;
    return sum;
}

/* Input of the plays at which their sum is `sum`. No viscous play is stretched at the rest value of
   play 1; from there on they are solved like plain ones, with smaller slopes. */
static hystgen_reach_t hystgen_relaxing_input(hystgen_play_t *play, hystgen_sum_t sum) {
    play[0] = play[1];
    return hystgen_loop_solve(&hystgen_relaxing_tables, play, sum);
}
#else
/* The plays follow their input w. Returns their sum. */
static hystgen_real_t hystgen_relaxing_follow(hystgen_real_t *play, hystgen_real_t w) {
    hystgen_real_t sum = hystgen_play.weight[0] * w;
    unsigned int i;
    for (i = 1; i <= HYSTGEN_N_PLAYS; ++i) {
        const hystgen_real_t r = hystgen_play.threshold[i];
        const hystgen_real_t z = play[i] + HYSTGEN_LATE * hystgen_stretch(w - play[i], r);
        sum = sum + hystgen_play.weight[i] * z;
        play[i] = z + HYSTGEN_KEPT * hystgen_stretch(w - z, r);
    }
    play[0] = w;
    return sum;
}

/* Input of the plays at which their sum is h: first without any stretched play, then with the plays
   stretched on the way to w, in the order of their thresholds. */
static hystgen_real_t hystgen_relaxing_input(const hystgen_real_t *play, hystgen_real_t h) {
    hystgen_real_t rest = 0;
    unsigned int i;
    for (i = 1; i <= HYSTGEN_N_PLAYS; ++i) {
        rest = rest + hystgen_play.weight[i] * play[i];
    }
    rest = h - rest;
    hystgen_real_t w = rest * hystgen_relaxing.inverse[0];
    const bool rising = w > play[1];
    for (i = 1; i <= HYSTGEN_N_PLAYS; ++i) {
        const hystgen_real_t r = hystgen_play.threshold[i];
        const hystgen_real_t first = rising ? play[i] + r : play[i] - r;
        if (rising ? w <= first : w >= first) {
            break;
        }
        rest = rest + hystgen_relaxing.share[i] * first;
        w = rest * hystgen_relaxing.inverse[i];
        if (rising ? w < first : w > first) {
            w = first; /* rounding must not take w back past the play's first touch */
        }
    }
    return w;
}
#endif

/* Sum of the plays. */
static hystgen_signal_t hystgen_operator_started(const hystgen_operator_t *self) {
    return hystgen_level(hystgen_loop_output(&hystgen_model_tables, self->play));
}

/* The plays follow their input w. Updates their sum. */
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
