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

/* Takes the sum at the input tried last. The interval ends there from now on. Returns whether the
   search is over. */
HYSTGEN_APART bool hystgen_inverse_over(hystgen_search_t *search) {
    const hystgen_sum_t found = search->found;
    if (found < search->sum) {
        search->low = search->input;
        search->short_of = search->sum - found;
    } else {
        search->top = search->input - 1;
        search->over = found - search->sum;
    }
    return hystgen_size(found - search->sum) <= HYSTGEN_NEAR || search->top == search->low;
}

/* Updates the rate to that of the secant through the last two inputs, once there are two. */
HYSTGEN_APART void hystgen_inverse_turn(hystgen_search_t *search) {
    const hystgen_sum_t way = hystgen_size((hystgen_sum_t)search->input - search->before);
    if (way > 0) {
        const hystgen_sum_t gained = hystgen_size(search->found - search->last);
        const hystgen_sum_t rate = hystgen_quotient(way, gained > 1 ? gained : 1, HYSTGEN_RATE_BITS);
        search->rate = (uint32_t)(rate < 1 ? 1 : rate > INT32_MAX ? INT32_MAX : rate);
    }
}

/* The input to which the rate leads from the one tried last, at least one on and not beyond all. */
HYSTGEN_APART hystgen_sum_t hystgen_inverse_further(const hystgen_search_t *search) {
    const hystgen_sum_t input = search->input;
    const hystgen_sum_t left = search->sum - search->found;
    const hystgen_sum_t room = HYSTGEN_LARGEST_INPUT - (left > 0 ? input : -input);
    const uint64_t size = (uint64_t)hystgen_size(left);
    const uint64_t steps = hystgen_wide((uint32_t)(size >> HYSTGEN_WORD), search->rate) +
                           (hystgen_wide((uint32_t)size, search->rate) >> HYSTGEN_WORD);
    const hystgen_sum_t on =
        (hystgen_sum_t)((steps + (((uint64_t)1 << (HYSTGEN_RATE_BITS - HYSTGEN_WORD)) >> 1)) >> (HYSTGEN_RATE_BITS - HYSTGEN_WORD));
    const hystgen_sum_t some = on > 1 ? on : 1;
    const hystgen_sum_t inside = some > room ? room : some;
    return left > 0 ? input + inside : input - inside;
}

/* Goes on to the next input: by the rate of a secant, if that leads inside the interval and has not
   been tried too often; else to the middle of the interval. */
HYSTGEN_APART void hystgen_inverse_advance(hystgen_search_t *search) {
    hystgen_sum_t next = search->input; /* an end of the interval */
    if (search->tries < HYSTGEN_SECANTS) {
        ++search->tries;
        hystgen_inverse_turn(search);
        next = hystgen_inverse_further(search);
    }
    if (next <= search->low || next > search->top) {
        next = search->low + ((hystgen_sum_t)search->top - search->low + 1) / 2;
    }
    search->before = search->input;
    search->last = search->found;
    search->input = (hystgen_play_t)next;
}

/* Input of the plays at which their sum is h: the nearer of two neighbours, or one input beyond all
   if the sum is out of reach. */
HYSTGEN_APART hystgen_reach_t hystgen_inverse_input(hystgen_inverse_t *self, hystgen_signal_t h) {
    self->search.low = -HYSTGEN_LARGEST_INPUT - 1;
    self->search.top = HYSTGEN_LARGEST_INPUT;
    self->search.short_of = 0;
    self->search.over = -1;
    self->search.sum = hystgen_asked(h);
    self->search.tries = 0;
    self->search.input = self->play[0];
    self->search.before = self->play[0];
#ifndef HYSTGEN_HAS_PLAIN_PLAYS
    self->search.found = hystgen_inverse_sum(self, self->search.input);
#endif /* they have just followed an input, at which their sum is known */
    while (!hystgen_inverse_over(&self->search)) {
        hystgen_inverse_advance(&self->search);
#ifdef HYSTGEN_HAS_PLAIN_PLAYS
        hystgen_inverse_release(self, self->search.input);
#endif
        self->search.found = hystgen_inverse_sum(self, self->search.input);
    }
    if (hystgen_size(self->search.found - self->search.sum) <= HYSTGEN_NEAR) {
        return self->search.input;
    }
    return (hystgen_reach_t)self->search.low + (self->search.short_of > self->search.over ? 1 : 0);
}
#else
/* Tries an input. The interval ends there from now on. */
HYSTGEN_APART bool hystgen_inverse_found(hystgen_inverse_t *self) {
    hystgen_search_t *search = &self->search;
    search->left = search->sum - hystgen_inverse_sum(self, search->input);
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

/* Goes on to the next input; `newton`: by the slope. */
HYSTGEN_APART void hystgen_inverse_advance(hystgen_inverse_t *self, bool newton) {
    hystgen_search_t *search = &self->search;
    if (newton) {
        hystgen_real_t rate = HYSTGEN_RATE;
        unsigned int i;
        for (i = 0; i < HYSTGEN_TURNS; ++i) {
            rate = rate + rate - search->slope * rate * rate;
        }
        search->input = search->input + search->left * rate;
    }
    if (!(search->input > search->low && search->input < search->high)) {
        search->input = search->low + (search->high - search->low) / 2;
    }
}

/* Input of the plays at which their sum is h. The last step is by the reciprocal of a slope that is
   right in the middle, and takes the sum no farther away for any other. */
HYSTGEN_APART hystgen_real_t hystgen_inverse_input(hystgen_inverse_t *self, hystgen_real_t h) {
    unsigned int i;
    self->search.low = HYSTGEN_LEAST_INPUT;
    self->search.high = HYSTGEN_LARGEST_INPUT;
    self->search.input = self->play[0];
    self->search.sum = h;
    for (i = 0; i < HYSTGEN_NEWTON_TRIES + HYSTGEN_HALVES; ++i) {
        if (hystgen_inverse_found(self)) {
            return self->search.input + self->search.left * HYSTGEN_RATE;
        }
        hystgen_inverse_advance(self, i < HYSTGEN_NEWTON_TRIES);
    }
    return self->search.high;
}
#endif
