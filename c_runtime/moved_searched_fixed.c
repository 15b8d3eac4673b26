#include "hystgen_runtime.h"

/* Plays that have to be searched for, in fixed point: each moves in its own way (hystgen_moved). */

/* What the plays give once their input has gone to w. */
HYSTGEN_APART hystgen_sum_t hystgen_moved_sum(const hystgen_play_t *play, hystgen_reach_t w) {
    const hystgen_tables_t *t = &hystgen_model_tables;
    hystgen_sum_t sum = (hystgen_sum_t)t->weight[0] * w;
    unsigned int i;
    for (i = 1; i <= t->n; ++i) {
        sum += t->weight[i] * hystgen_moved(i, play, w);
    }
    return sum;
}

/* The plays follow their input w. Returns their sum. */
static hystgen_sum_t hystgen_moved_follow(hystgen_play_t *play, hystgen_play_t w) {
    const hystgen_tables_t *t = &hystgen_model_tables;
    hystgen_sum_t sum = (hystgen_sum_t)t->weight[0] * w;
    unsigned int i;
    for (i = 1; i <= t->n; ++i) {
        const int64_t z = hystgen_moved(i, play, w);
        sum += t->weight[i] * z;
        play[i] = (hystgen_play_t)hystgen_left(i, z, w);
    }
    play[0] = w;
    return sum;
}

/* Input of the plays at which their sum is `sum`, by halves between where it is and the farthest:
   the nearer of two neighbours. */
static hystgen_reach_t hystgen_moved_input(hystgen_play_t *play, hystgen_sum_t sum) {
    const hystgen_sum_t here = hystgen_moved_sum(play, play[0]);
    hystgen_reach_t low = here < sum ? play[0] : -HYSTGEN_LARGEST_INPUT;
    hystgen_reach_t high = here < sum ? HYSTGEN_LARGEST_INPUT : play[0];
    if (here == sum) {
        return play[0];
    }
    while (high - low > 1) {
        const hystgen_reach_t middle = low + (high - low) / 2;
        const bool beyond = hystgen_moved_sum(play, middle) >= sum;
        low = beyond ? low : middle;
        high = beyond ? middle : high;
    }
    return sum - hystgen_moved_sum(play, low) < hystgen_moved_sum(play, high) - sum ? low : high;
}
