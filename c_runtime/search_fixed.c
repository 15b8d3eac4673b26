#include "hystgen_runtime.h"

/* Which of `low` and the input beside it is nearer to where the sum of the plays is `sum`; one
   beyond them where they are the farthest and not far enough. */
HYSTGEN_APART hystgen_reach_t hystgen_inverse_nearer(const hystgen_inverse_t *self,
                                                     hystgen_play_t low, hystgen_sum_t sum) {
    const hystgen_sum_t above = sum - hystgen_inverse_sum(self, low);
    if (low == HYSTGEN_LARGEST_INPUT) {
        return (hystgen_reach_t)low + (above > 0 ? 1 : 0);
    }
    const hystgen_sum_t below = hystgen_inverse_sum(self, low + 1) - sum;
    if (above < 0) {
        return (hystgen_reach_t)low - 1;
    }
    if (below < 0) {
        return (hystgen_reach_t)low + 2;
    }
    return (hystgen_reach_t)low + (above > below ? 1 : 0);
}

/* Input of the plays at which their sum is h, by halves between where it is and the farthest: the
   nearer of two neighbours, the lower one of which is `low` while they are `size` apart. */
HYSTGEN_APART hystgen_reach_t hystgen_inverse_input(const hystgen_inverse_t *self,
                                                    hystgen_signal_t h) {
    const hystgen_sum_t sum = hystgen_asked(h);
    hystgen_play_t low = self->play[0];
    const hystgen_sum_t here = hystgen_inverse_sum(self, low);
    uint32_t size = here < sum ? (uint32_t)((hystgen_sum_t)HYSTGEN_LARGEST_INPUT - low) : 0u;
    if (here > sum) {
        size = (uint32_t)((hystgen_sum_t)low + HYSTGEN_LARGEST_INPUT);
        low = -HYSTGEN_LARGEST_INPUT;
    }
    while (size > 1u) {
        const hystgen_play_t middle = low + (hystgen_play_t)(size / 2u);
        size = size / 2u + size % 2u;
        if (hystgen_inverse_sum(self, middle) < sum) {
            low = middle;
        }
    }
    return hystgen_inverse_nearer(self, low, sum);
}
