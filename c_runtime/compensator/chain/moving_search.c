/* Operators of a model with effects: the input of moving or bent plays for a given sum. Called by
   chain_calls.c. */
#include "compensator/chain/model.h"
#ifndef HYSTGEN_CONFIGURED
#include "compensator/chain/moving_plays.c"
#endif
#include "compensator/chain/signals.c"

/* The search goes on from the input tried last by the slope of the sum, as long as that leads to an
   input inside the interval and it has not done so too often; else it halves the interval. Both
   ends of the interval are known to be beyond the solution, so that a wrong slope costs tries and
   nothing else. */
#ifdef HYSTGEN_FIXED
static inline hystgen_sum_t hystgen_size(hystgen_sum_t x) {
    return x < 0 ? -x : x;
}

/* Tries an input. The interval ends there from now on. */
HYSTGEN_APART void hystgen_inverse_try(const hystgen_inverse_t *self, hystgen_search_t *search) {
    const hystgen_sum_t found = hystgen_inverse_sum(self, search->input);
    search->found = found;
    if (found < search->sum) {
        search->low = search->input;
        search->short_of = search->sum - found;
    } else {
        search->high = search->input;
        search->over = found - search->sum;
    }
}

/* The input that `slope` leads to from the last one, at least one on and none beyond all. */
static hystgen_sum_t hystgen_inverse_next_input(const hystgen_search_t *search,
                                                hystgen_sum_t slope) {
    const bool rising = search->found < search->sum;
    const hystgen_sum_t input = search->input;
    const hystgen_sum_t room = HYSTGEN_LARGEST_INPUT - (rising ? input : -input);
    const hystgen_sum_t step = hystgen_quotient(rising ? search->short_of : search->over, slope);
    const hystgen_sum_t some = step > 1 ? step : 1;
    const hystgen_sum_t way = some > room ? room : some;
    return rising ? input + way : input - way;
}

/* Tries the next input; `secant`: by the slope. Updates the slope. */
HYSTGEN_APART void hystgen_inverse_proceed(hystgen_inverse_t *self, hystgen_search_t *search,
                                           bool secant) {
    const hystgen_play_t before = search->input;
    const hystgen_sum_t last = search->found;
    const hystgen_sum_t next = secant ? hystgen_inverse_next_input(search, self->bent[0]) : before;
    if (next > search->low && next < search->high) {
        search->input = (hystgen_play_t)next;
    } else {
        const uint32_t size = (uint32_t)(search->high - search->low);
        search->input = (hystgen_play_t)(search->low + (hystgen_sum_t)(size / 2u));
    }
    hystgen_inverse_try(self, search);
    const hystgen_sum_t way = hystgen_size((hystgen_sum_t)search->input - before);
    if (secant && way >= HYSTGEN_SECANT) {
        const hystgen_sum_t slope = hystgen_quotient(hystgen_size(search->found - last), way);
        self->bent[0] = slope > 1 ? slope : 1;
    }
}

/* Input of the plays at which their sum is h: the nearer of two neighbours, or one input beyond all
   if the sum is out of reach. */
HYSTGEN_APART hystgen_reach_t hystgen_inverse_input(hystgen_inverse_t *self, hystgen_signal_t h) {
    hystgen_search_t search;
    unsigned int tries = 0;
    search.low = -(hystgen_sum_t)HYSTGEN_LARGEST_INPUT - 1;
    search.high = (hystgen_sum_t)HYSTGEN_LARGEST_INPUT + 1;
    search.short_of = 0;
    search.over = -1;
    search.sum = hystgen_asked(h);
    search.input = self->play[0];
    hystgen_inverse_try(self, &search);
    while (hystgen_size(search.found - search.sum) > HYSTGEN_NEAR) {
        if (search.high - search.low == 1) {
            return (hystgen_reach_t)(search.short_of > search.over ? search.high : search.low);
        }
        hystgen_inverse_proceed(self, &search, tries < HYSTGEN_SECANTS);
        ++tries;
    }
    return search.input;
}
#else
/* Tries an input. The interval ends there from now on. A search in memory needs half as much stack
   as registers saved across a call. */
HYSTGEN_APART bool hystgen_inverse_found(const hystgen_inverse_t *self, hystgen_search_t *search) {
    search->left = search->sum - hystgen_inverse_sum(self, search->input, &search->slope);
    if (search->left <= HYSTGEN_CLOSE && search->left >= -HYSTGEN_CLOSE) {
        return true;
    }
    if (search->left > 0) {
        search->low = search->input;
    } else {
        search->high = search->input;
    }
    return false;
}

/* The next input by Newton's method. */
static hystgen_real_t hystgen_inverse_newton(const hystgen_search_t *search) {
    hystgen_real_t rate = HYSTGEN_RATE;
    unsigned int i;
    for (i = 0; i < HYSTGEN_TURNS; ++i) {
        rate = rate + rate - search->slope * rate * rate;
    }
    return search->input + search->left * rate;
}

/* Input of the plays at which their sum is h. The last step is by the reciprocal of a slope that is
   right in the middle, and takes the sum no farther away for any other. */
HYSTGEN_APART hystgen_real_t hystgen_inverse_input(const hystgen_inverse_t *self,
                                                   hystgen_real_t h) {
    hystgen_search_t search = {HYSTGEN_LEAST_INPUT, HYSTGEN_LARGEST_INPUT, self->play[0], h, 0, 0};
    unsigned int i;
    for (i = 0; i < HYSTGEN_NEWTON_TRIES + HYSTGEN_HALVES; ++i) {
        if (hystgen_inverse_found(self, &search)) {
            return search.input + search.left * HYSTGEN_RATE;
        }
        if (i < HYSTGEN_NEWTON_TRIES) {
            search.input = hystgen_inverse_newton(&search);
        }
        if (!(search.input > search.low && search.input < search.high)) {
            search.input = search.low + (search.high - search.low) / 2;
        }
    }
    return search.high;
}
#endif
