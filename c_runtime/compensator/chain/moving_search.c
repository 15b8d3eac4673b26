/* Operators of a model with effects: the input of moving or bent plays for a given sum. Called by
   chain_calls.c. */
#include "compensator/chain/model.h"
#ifndef HYSTGEN_CONFIGURED
#include "compensator/chain/moving_plays.c"
#endif
#include "compensator/chain/signals.c"

#ifdef HYSTGEN_HAS_ELEMENTS
/* Turns the elements if the input at which the sum is h lies behind them. Returns whether it does.
 */
static bool hystgen_inverse_turns(hystgen_inverse_t *self, hystgen_signal_t h) {
    const bool turns = self->moving && (self->upward ? h < self->level : h > self->level);
    if (turns) {
        hystgen_inverse_turn_elements(self);
#if defined(HYSTGEN_FIXED) && defined(HYSTGEN_HAS_SMOOTH_SUM)
        self->steep = -1;
#endif
    }
    return turns;
}

#ifndef HYSTGEN_FIXED
/* Slope of the sum right after a turn, when no play follows. */
static hystgen_real_t hystgen_inverse_turned_slope(const hystgen_inverse_t *self) {
    hystgen_real_t slope = hystgen_model_tables.weight[0];
    unsigned int j;
    for (j = 0; j < HYSTGEN_ELEMENTS; ++j) {
        slope = slope + hystgen_element_weight[j] * self->element[j].c[0];
    }
    return slope;
}
#endif
#endif

#ifdef HYSTGEN_FIXED
/* The search goes on from the input tried last by the slope of the sum, as long as this leads to an
   input inside the interval and has not been done too often; else it halves the interval. Both
   ends of the interval are known to be beyond the solution, so that a wrong slope costs tries and
   nothing else. */
static inline hystgen_sum_t hystgen_size(hystgen_sum_t x) {
    return x < 0 ? -x : x;
}

/* Takes the sum at the input tried last. The interval ends there from now on. Returns whether the
   search is over. */
HYSTGEN_APART bool hystgen_inverse_over(hystgen_search_t *search) {
    const hystgen_sum_t found = search->found;
    if (found < search->total) {
        search->low = search->input;
        search->short_of = search->total - found;
    } else {
        search->top = search->input - 1;
        search->over = found - search->total;
    }
    return hystgen_size(found - search->total) <= HYSTGEN_NEAR || search->top == search->low;
}

/* Updates the rate to that of an input which has gone `way` while the sum has gained this. */
HYSTGEN_APART void hystgen_inverse_rate(hystgen_search_t *search, hystgen_sum_t way,
                                        hystgen_sum_t gained) {
    const hystgen_sum_t some = gained > 1 ? gained : 1;
    const hystgen_sum_t rate = hystgen_quotient(way, some, HYSTGEN_RATE_BITS);
    const hystgen_sum_t inside = rate > HYSTGEN_FASTEST ? HYSTGEN_FASTEST : rate;
    search->rate = (uint32_t)(inside > 1 ? inside : 1);
}

#ifndef HYSTGEN_HAS_SMOOTH_SUM
/* Updates the rate to that of the secant through the last two inputs, once there are two. */
static void hystgen_inverse_turn(hystgen_search_t *search) {
    const hystgen_sum_t way = hystgen_size((hystgen_sum_t)search->input - search->prior);
    if (way > 0) {
        hystgen_inverse_rate(search, way, hystgen_size(search->found - search->last));
    }
}
#endif

/* The input to which the rate leads from the one tried last: at least 1 further, and in range. */
HYSTGEN_APART hystgen_sum_t hystgen_inverse_further(const hystgen_search_t *search) {
    const hystgen_sum_t input = search->input;
    const hystgen_sum_t left = search->total - search->found;
    const hystgen_sum_t room = HYSTGEN_LARGEST_INPUT - (left > 0 ? input : -input);
    const uint64_t size = (uint64_t)hystgen_size(left);
    const uint64_t steps = hystgen_wide((uint32_t)(size >> HYSTGEN_WORD), search->rate) +
                           (hystgen_wide((uint32_t)size, search->rate) >> HYSTGEN_WORD);
    const unsigned int finer = HYSTGEN_RATE_BITS - HYSTGEN_WORD;
    const hystgen_sum_t on = (hystgen_sum_t)((steps + (((uint64_t)1 << finer) >> 1)) >> finer);
    const hystgen_sum_t some = on > 1 ? on : 1;
    const hystgen_sum_t inside = some > room ? room : some;
    return left > 0 ? input + inside : input - inside;
}

#ifdef HYSTGEN_HAS_SMOOTH_SUM
/* Updates the rate to that of the slope at the input tried last, unless this is the first in the
   same direction. Returns whether one step along that slope leads to the solution: the elements are
   straight on the way, and no play starts or stops to move. Goes there. */
HYSTGEN_APART bool hystgen_inverse_lands(hystgen_inverse_t *self) {
    const hystgen_play_t w = self->search.input;
    const hystgen_sum_t left = self->search.total - self->search.found;
    hystgen_sum_t slope = hystgen_model_tables.weight[0] + self->slope;
    unsigned int first;
    if (self->search.tries >= HYSTGEN_SECANTS || (self->search.tries == 0 && self->steep >= 0)) {
        return false;
    }
    HYSTGEN_ROLLED
    for (first = 1; first <= HYSTGEN_N_PLAYS && first <= self->released; ++first) {
        if (hystgen_resting(first, self->play, w) == self->play[first]) {
            break;
        }
        slope += hystgen_model_tables.weight[first];
    }
    if (slope != self->steep) {
        self->steep = slope;
        hystgen_inverse_rate(&self->search, 1, slope);
    }
    const hystgen_sum_t next = hystgen_inverse_further(&self->search);
    const hystgen_sum_t on = next - self->near;
    if (self->departs || on > HYSTGEN_STRAIGHT || on < -HYSTGEN_STRAIGHT) {
        return false;
    }
    if (first > 1u &&
        hystgen_resting(first - 1u, self->play, (hystgen_play_t)next) == self->play[first - 1u]) {
        return false;
    }
    if (first <= HYSTGEN_N_PLAYS &&
        hystgen_resting(first, self->play, (hystgen_play_t)next) != self->play[first]) {
        return false;
    }
    const hystgen_sum_t gained = slope * (next - w);
    if (hystgen_size(left - gained) < hystgen_size(left)) {
        self->search.input = (hystgen_play_t)next;
        self->search.found += gained;
    }
    return true;
}
#endif

/* Goes on to the next input: by the rate of a secant, if that leads inside the interval and has not
   been tried too often; else to the middle of the interval. */
HYSTGEN_APART void hystgen_inverse_advance(hystgen_search_t *search) {
    hystgen_sum_t next = search->input; /* an end of the interval */
    if (search->tries < HYSTGEN_SECANTS) {
        ++search->tries;
#ifndef HYSTGEN_HAS_SMOOTH_SUM
        hystgen_inverse_turn(search);
#endif
        next = hystgen_inverse_further(search);
    }
    if (next <= search->low || next > search->top) {
        next = search->low + ((hystgen_sum_t)search->top - search->low + 1) / 2;
    }
    search->prior = search->input;
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
    self->search.total = hystgen_asked(h);
    self->search.tries = 0;
    self->search.input = self->play[0];
    self->search.prior = self->play[0];
#ifndef HYSTGEN_HAS_PLAIN_PLAYS
#ifdef HYSTGEN_HAS_ELEMENTS
    (void)hystgen_inverse_turns(self, h);
    hystgen_inverse_approach(self, self->search.input);
#endif
    self->search.found = hystgen_inverse_sum(self, self->search.input);
#elif defined(HYSTGEN_HAS_ELEMENTS)
    const bool turned = hystgen_inverse_turns(self, h);
    hystgen_inverse_approach(self, self->search.input);
    if (turned) {
        self->search.found = hystgen_inverse_sum(self, self->search.input);
    }
#endif /* plain plays have just followed an input, at which their sum is known */
    while (!hystgen_inverse_over(&self->search)) {
#ifdef HYSTGEN_HAS_SMOOTH_SUM
        if (hystgen_inverse_lands(self)) {
            return self->search.input;
        }
#endif
        hystgen_inverse_advance(&self->search);
#ifdef HYSTGEN_HAS_PLAIN_PLAYS
        hystgen_inverse_release(self, self->search.input);
#endif
#ifdef HYSTGEN_HAS_ELEMENTS
        hystgen_inverse_approach(self, self->search.input);
#endif
        self->search.found = hystgen_inverse_sum(self, self->search.input);
    }
    if (hystgen_size(self->search.found - self->search.total) <= HYSTGEN_NEAR) {
        return self->search.input;
    }
    return (hystgen_reach_t)self->search.low + (self->search.short_of > self->search.over ? 1 : 0);
}
#else
/* Adds play i, which moves, to the sum at the input tried, and to the sum's slope. */
HYSTGEN_APART_IF_MOVED void hystgen_inverse_add(hystgen_attempt_t *at, unsigned int i,
                                                hystgen_real_t bump) {
    hystgen_real_t change;
    const hystgen_real_t value = hystgen_bent_steep(i, at->reached, bump, &change);
    const hystgen_real_t weight = hystgen_model_tables.weight[i];
    const hystgen_real_t more = weight * change;
    at->sum = at->sum + weight * value;
    at->steady = at->steady + more;
    at->slope = at->slope + more * at->share;
}

/* The same, if play i moves. Returns whether it does. */
#if defined(HYSTGEN_HAS_BENT_PLAYS) && !defined(HYSTGEN_HAS_MOVES_APART)
HYSTGEN_APART
#else
static inline
#endif
bool hystgen_inverse_tries(const hystgen_inverse_t *self, hystgen_attempt_t *at, unsigned int i) {
    if (!hystgen_tried(self, at, i)) {
        return false;
    }
    hystgen_inverse_add(at, i, hystgen_bump_at(at->reached));
    return true;
}

/* Sums up the plays after their input has moved to the one tried, or at rest there; the sum
   increases with it. */
static inline void hystgen_inverse_try(hystgen_inverse_t *self, hystgen_attempt_t *at) {
    const hystgen_real_t *bent = hystgen_operator_bent(self);
    unsigned int i;
#ifdef HYSTGEN_HAS_ORDERED_PLAYS
    HYSTGEN_ROLLED
    for (i = 1; i <= HYSTGEN_N_PLAYS && hystgen_inverse_tries(self, at, i); ++i) {
    }
    at->first = i;
    at->sum = hystgen_with_staying(i, self->play, bent, at->sum);
#else
    HYSTGEN_ROLLED
    for (i = 1; i <= HYSTGEN_N_PLAYS; ++i) {
        if (!hystgen_inverse_tries(self, at, i)) {
            at->sum =
                at->sum + hystgen_model_tables.weight[i] * hystgen_staying(i, self->play, bent);
        }
    }
#endif
#ifdef HYSTGEN_HAS_ELEMENTS
    hystgen_sum_t more;
    at->sum = at->sum + hystgen_operator_joined(self, at->input, &more);
    at->steady = at->steady + more;
    at->slope = at->slope + more;
#endif
}

/* left/slope. */
static inline hystgen_real_t hystgen_led(hystgen_real_t left, hystgen_real_t slope) {
    hystgen_real_t rate = HYSTGEN_RATE;
    unsigned int i;
    for (i = 0; i < HYSTGEN_TURNS; ++i) {
        rate = rate + rate - slope * rate * rate;
    }
    return left * rate;
}

#ifdef HYSTGEN_HAS_SMOOTH_SUM
/* Whether one more step along the slope leads from the input tried to the solution: the elements
   bend little on the way, and no play starts or stops to move. Goes there. */
static bool hystgen_inverse_lands(const hystgen_inverse_t *self, hystgen_attempt_t *at) {
    const hystgen_real_t left = at->asked - at->sum;
    const hystgen_real_t from = at->input;
    const unsigned int first = at->first;
    if (!(left < HYSTGEN_SMOOTH && left > -HYSTGEN_SMOOTH) || !self->moving) {
        return false;
    }
    at->input = from + hystgen_led(left, at->slope);
    if ((first == 1u || hystgen_tried(self, at, first - 1u)) &&
        (first > HYSTGEN_N_PLAYS || !hystgen_tried(self, at, first))) {
        return true;
    }
    at->input = from;
    return false;
}
#endif

/* Goes on from try k to the next input: by the slope there, if it leads to an input inside the
   interval and k is not too large; else to the middle. A wrong slope costs only tries. Returns
   whether that input is the solution, by a last step along the slope there if plays start to move
   softly, else along the middle of all slopes. */
#ifdef HYSTGEN_HAS_BENT_PLAYS
HYSTGEN_APART
#elif defined(HYSTGEN_HAS_DASHPOT_PLAYS)
HYSTGEN_APART
#else
static inline
#endif
bool hystgen_inverse_solves(hystgen_attempt_t *at, unsigned int k) {
    const hystgen_real_t left = at->asked - at->sum;
    if (k > 0) {
        if ((left <= HYSTGEN_CLOSE && left >= -HYSTGEN_CLOSE) ||
            k == HYSTGEN_NEWTON_TRIES + HYSTGEN_HALVES) {
#ifdef HYSTGEN_HAS_DASHPOT_PLAYS
            at->input = at->input + hystgen_led(left, at->slope);
#else
            at->input = at->input + left * HYSTGEN_RATE;
#endif
            return true;
        }
        if (left > 0) {
            at->low = at->input;
        } else {
            at->high = at->input;
        }
    }
    if (k <= HYSTGEN_NEWTON_TRIES) {
        at->input = at->input + hystgen_led(left, at->slope);
    }
    if (!(at->input > at->low && at->input < at->high)) {
        at->input = at->low + (at->high - at->low) / 2;
    }
    at->slope = hystgen_model_tables.weight[0];
    at->steady = at->slope;
    at->sum = at->slope * at->input;
    return false;
}

/* Input of the plays at which their sum is h. The search begins where the slope of the last
   search leads. */
HYSTGEN_APART hystgen_real_t hystgen_inverse_input(hystgen_inverse_t *self, hystgen_real_t h) {
    hystgen_attempt_t at;
    unsigned int k;
#ifdef HYSTGEN_HAS_ELEMENTS
    if (hystgen_inverse_turns(self, h)) {
        self->search.slope = hystgen_inverse_turned_slope(self);
    }
#endif
    at.low = HYSTGEN_LEAST_INPUT;
    at.high = HYSTGEN_LARGEST_INPUT;
    at.input = self->play[0];
    at.asked = h;
    at.sum = self->level;
    at.slope = self->search.slope;
    at.steady = at.slope;
    for (k = 0; !hystgen_inverse_solves(&at, k); ++k) {
        hystgen_inverse_try(self, &at);
#ifdef HYSTGEN_HAS_SMOOTH_SUM
        if (hystgen_inverse_lands(self, &at)) {
            break;
        }
#endif
    }
    self->search.slope = at.steady;
#ifdef HYSTGEN_HAS_ELEMENTS
    if (k < HYSTGEN_NEWTON_TRIES + HYSTGEN_HALVES) { /* the sum there is h but for rounding */
        self->found = at.input;
        self->asked = h;
    }
#endif
    return at.input;
}
#endif
