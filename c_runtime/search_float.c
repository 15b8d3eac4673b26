#include "hystgen_runtime.h"

/* Input of the plays at which their sum is h, by bisection between the present input and the
   farthest one. */
HYSTGEN_APART hystgen_real_t hystgen_inverse_input(const hystgen_inverse_t *self,
                                                   hystgen_real_t h) {
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
