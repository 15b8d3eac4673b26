#include "hystgen_runtime.h"

/* Input of the plays at which their sum is h, by bisection between the present input and the
   farthest one: the nearer of two neighbours. */
HYSTGEN_APART hystgen_reach_t hystgen_inverse_input(const hystgen_inverse_t *self,
                                                    hystgen_signal_t h) {
    const hystgen_sum_t sum = hystgen_asked(h);
    const hystgen_sum_t here = hystgen_inverse_sum(self, self->play[0]);
    hystgen_reach_t low = here < sum ? self->play[0] : -HYSTGEN_LARGEST_INPUT;
    hystgen_reach_t high = here < sum ? HYSTGEN_LARGEST_INPUT : self->play[0];
    if (here == sum) {
        return self->play[0];
    }
    while (high - low > 1) {
        const hystgen_reach_t middle = low + (high - low) / 2;
        const bool beyond = hystgen_inverse_sum(self, middle) >= sum;
        low = beyond ? low : middle;
        high = beyond ? middle : high;
    }
    return sum - hystgen_inverse_sum(self, low) < hystgen_inverse_sum(self, high) - sum ? low
                                                                                        : high;
}
