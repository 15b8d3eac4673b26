/* Operators of a model with effects: the input of moving or bent plays for a given sum, by
   bisection. Called by chain_calls.c. */
#include "compensator/chain/model.h"
#ifndef HYSTGEN_CONFIGURED
#include "compensator/chain/moving_plays.c"
#endif
#include "compensator/chain/signals.c"

#ifdef HYSTGEN_FIXED
/* The input `low` or the one above it, whichever gives the sum of the plays nearer to `sum`; one
   input beyond if `sum` is out of reach. */
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

/* Input of the plays at which their sum is h, by bisection between the present input and the
   farthest: the nearer of two neighbours. The interval begins at `low` and is `size` long. */
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
#else
/* Sum of the plays at the middle of the search interval, which becomes one of its ends. A search in
   memory needs half as much stack as registers saved across a call. */
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
#endif
