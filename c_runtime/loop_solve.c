#include "hystgen_runtime.h"

/* The input of the plays that gives `output`: starts with every play following and lets go of the largest
   thresholds until the solution has really reached the play that follows last. */
HYSTGEN_API hystgen_real_t hystgen_loop_solve(const hystgen_tables_t *t, const hystgen_real_t *play,
                                              hystgen_real_t output)
{
    const bool rising = output >= hystgen_loop_output(t, play);
    hystgen_real_t tail = 0;
    unsigned int k = t->n + 1u;
    while (k > 1) {
        const unsigned int last = k - 1;
        if (rising) {
            const hystgen_real_t w = (output - (tail - t->lift[k])) * t->inverse_slope[k];
            if (w >= play[last] + t->threshold[last]) {
                return w;
            }
        } else {
            const hystgen_real_t w = (output - (tail + t->lift[k])) * t->inverse_slope[k];
            if (w <= play[last] - t->threshold[last]) {
                return w;
            }
        }
        tail = tail + t->weight[last] * play[last];
        k = last;
    }
    return (output - tail) * t->inverse_slope[1];
}
