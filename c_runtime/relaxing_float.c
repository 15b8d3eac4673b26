#include "hystgen_runtime.h"

/* Viscous plays with one time constant. The state of a play is where it would come to rest
   (`play`). At the end of a step its input w has stretched it by what lies beyond the threshold;
   the play gains a share of that. Exact while it slides or rests; contact that begins or ends
   within a step counts from the first touch. */

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

/* Input of the plays at which their sum is h: first without any stretched play, then with those
   that are stretched on the way there, in the order of their thresholds. */
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
