#include "hystgen_runtime.h"

/* Viscous plays with one time constant, in fixed point; see relaxing_float.c. A play stops where
   its stretch would gain less than half a step of the plays' input in a sample. */

/* Where play i rests: at most as far from the play before as their thresholds are from each other,
   in spite of rounding. */
static hystgen_play_t hystgen_beside(const hystgen_play_t *play, unsigned int i, int64_t rest) {
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
        play[i] = hystgen_beside(play, i, z + left);
    }
    play[0] = w;
    return sum;
}

/* Input of the plays at which their sum is `sum`. No viscous play is stretched with the input where
   play 1 rests; from there on they are solved for like plain ones, with smaller slopes. */
static hystgen_reach_t hystgen_relaxing_input(hystgen_play_t *play, hystgen_sum_t sum) {
    play[0] = play[1];
    return hystgen_loop_solve(&hystgen_relaxing_tables, play, sum);
}
