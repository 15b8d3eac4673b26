/* How the plays of engine loop follow their input, in every arithmetic. Called by the operators of
   engine loop and by the plays of effects. */
#include "hystgen_runtime.h"

/* The textbook engine: every sample visits every play. Stores go through volatile where a compiler
   would otherwise call memset or memcpy, which a freestanding target may lack. */
HYSTGEN_API void hystgen_loop_rest(const hystgen_tables_t *t, hystgen_play_t *play,
                                   hystgen_play_t w) {
    volatile hystgen_play_t *entry = play;
    unsigned int i;
    for (i = 0; i <= t->n; ++i) {
        entry[i] = w;
    }
}

HYSTGEN_API void hystgen_loop_start(const hystgen_tables_t *t, hystgen_play_t *play,
                                    const hystgen_play_t *start) {
    volatile hystgen_play_t *entry = play;
    unsigned int i;
    for (i = 0; i <= t->n; ++i) {
        entry[i] = start[i];
    }
}

/* play_r[w] = max(w - r, min(w + r, play)) */
HYSTGEN_FIXED_KERNEL void hystgen_loop_absorb(const hystgen_tables_t *t, hystgen_play_t *play,
                                              hystgen_play_t w) {
    unsigned int i;
    for (i = 0; i <= t->n; ++i) {
        const hystgen_reach_t low = (hystgen_reach_t)w - t->threshold[i];
        const hystgen_reach_t high = (hystgen_reach_t)w + t->threshold[i];
        const hystgen_reach_t upper = play[i] > high ? high : play[i];
        play[i] = (hystgen_play_t)(upper < low ? low : upper);
    }
}

/* p_0 play_0 + p_1 play_1 + ..., in this order */
HYSTGEN_API hystgen_sum_t hystgen_loop_output(const hystgen_tables_t *t,
                                              const hystgen_play_t *play) {
    hystgen_sum_t sum = 0;
    unsigned int i;
    for (i = 0; i <= t->n; ++i) {
        sum = sum + (hystgen_sum_t)t->weight[i] * play[i];
    }
    return sum;
}
