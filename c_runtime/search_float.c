#include "hystgen_runtime.h"

/* The sum of the plays in the middle of a search, which becomes one of its ends. What a search
   knows is in memory, where it takes half of what a register takes that is kept over a call. */
HYSTGEN_APART hystgen_real_t hystgen_inverse_halve(const hystgen_inverse_t *self,
                                                   hystgen_search_t *search) {
    const hystgen_real_t sum = hystgen_inverse_sum(self, search->middle);
    if (sum < search->sum) {
        search->low = search->middle;
    } else {
        search->high = search->middle;
    }
    search->middle = search->low + (search->high - search->low) / 2;
    return sum;
}

/* Input of the plays at which their sum is h, by bisection between the present input and the
   farthest one. */
HYSTGEN_APART hystgen_real_t hystgen_inverse_input(const hystgen_inverse_t *self,
                                                   hystgen_real_t h) {
    hystgen_search_t search = {HYSTGEN_LEAST_INPUT, HYSTGEN_LARGEST_INPUT, self->play[0], h};
    const hystgen_real_t here = hystgen_inverse_halve(self, &search);
    if (here < search.sum || here > search.sum) {
        unsigned int i;
        for (i = 0; i < HYSTGEN_HALVES; ++i) {
            (void)hystgen_inverse_halve(self, &search);
        }
    }
    return search.high;
}
