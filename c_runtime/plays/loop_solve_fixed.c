/* Solves the plays of engine loop for their nearest input, in fixed point. Called by the operators
   of engine loop. */
#include "arithmetic/fixed.h"
#include "hystgen_runtime.h"

/* Input of the plays at which their sum has moved by d since w, limited to `least` .. `most`. */
static hystgen_reach_t hystgen_input_further(const hystgen_tables_t *t, hystgen_reach_t w,
                                             hystgen_sum_t d, unsigned int k, bool rising) {
    const hystgen_sum_t step = hystgen_divide_by_slope(d, t->reciprocal[k], t->shift[k]);
    if (rising) {
        return step > (hystgen_sum_t)t->most - w ? t->most : (hystgen_reach_t)(w + step);
    }
    return step > (hystgen_sum_t)w - t->least ? t->least : (hystgen_reach_t)(w - step);
}

/* Input of the plays at which their sum is `output`. The plays follow one by one until the next one
   would overshoot. The remaining output, `left`, only shrinks, so no sum exceeds the first one,
   whatever the values of the plays. */
HYSTGEN_API hystgen_reach_t hystgen_loop_solve(const hystgen_tables_t *t,
                                               const hystgen_play_t *play, hystgen_sum_t output) {
    const hystgen_sum_t here = hystgen_loop_output(t, play);
    const bool rising = output > here;
    hystgen_sum_t left = rising ? output - here : here - output;
    hystgen_reach_t w = play[0];
    unsigned int k;
    if (left == 0) {
        return w;
    }
    for (k = 1; k <= t->n; ++k) {
        const hystgen_reach_t start = rising ? (hystgen_reach_t)play[k] + t->threshold[k]
                                             : (hystgen_reach_t)play[k] - t->threshold[k];
        /* play k starts to follow no earlier than play k-1, and later by at most twice the
           difference of their thresholds */
        const uint32_t further = (uint32_t)(rising ? start - w : w - start);
        const hystgen_sum_t step = (hystgen_sum_t)hystgen_wide(further, (uint32_t)t->slope[k]);
        if (left < step) {
            break;
        }
        left = left - step;
        w = start;
    }
    return hystgen_input_further(t, w, left, k, rising);
}
