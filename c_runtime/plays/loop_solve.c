/* Solves the plays of engine loop for their input, in floating point. Called by the operators of
   engine loop. */
#include "hystgen_runtime.h"

/* Input of the plays at which their sum is `output`; the present sum is `here`. Assumes first that
   every play follows, then drops the largest thresholds one by one until the last remaining play
   follows at the solution. The solution must not pass the input at which the play dropped last
   would follow: a rounding error of `output` is divided by the slope before this input, which may
   be small, and must not extend into the steeper slope beyond it. */
HYSTGEN_API hystgen_real_t hystgen_loop_solve(const hystgen_tables_t *t, const hystgen_real_t *play,
                                              hystgen_real_t here, hystgen_real_t output) {
    const bool rising = output >= here;
    hystgen_real_t tail = 0;
    hystgen_real_t next = 0; /* input at which play k would start to follow */
    unsigned int k;
    for (k = t->n + 1u; k > 0; --k) {
        const unsigned int last = k - 1u;
        const hystgen_real_t first =
            rising ? play[last] + t->threshold[last] : play[last] - t->threshold[last];
        const hystgen_real_t w =
            (output - (rising ? tail - t->lift[k] : tail + t->lift[k])) * t->inverse_slope[k];
        if (rising ? w >= first : w <= first) {
            if (k <= t->n && (rising ? w > next : w < next)) {
                return next;
            }
            return w;
        }
        tail = tail + t->weight[last] * play[last];
        next = first;
    }
    return play[0]; /* the output differs from the present one only by rounding */
}
