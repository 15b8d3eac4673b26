#include "hystgen_runtime.h"

/* The input of the plays that gives `output`: takes along the plays one by one until the next would be too much. */
HYSTGEN_API hystgen_reach_t hystgen_loop_solve(const hystgen_tables_t *t, const hystgen_play_t *play,
                                               hystgen_sum_t output)
{
    hystgen_sum_t here = hystgen_loop_output(t, play);
    const bool rising = output > here;
    hystgen_reach_t w = play[0];
    unsigned int k;
    if (output == here) {
        return w;
    }
    for (k = 1; k <= t->n; ++k) {
        if (rising) {
            const hystgen_reach_t start = (hystgen_reach_t)play[k] + t->threshold[k];
            const hystgen_sum_t there = here + (hystgen_sum_t)(start - w) * t->slope[k];
            if (output < there) {
                break;
            }
            here = there;
            w = start;
        } else {
            const hystgen_reach_t start = (hystgen_reach_t)play[k] - t->threshold[k];
            const hystgen_sum_t there = here - (hystgen_sum_t)(w - start) * t->slope[k];
            if (output > there) {
                break;
            }
            here = there;
            w = start;
        }
    }
    return hystgen_going(t, w, rising ? output - here : here - output, k, rising);
}
