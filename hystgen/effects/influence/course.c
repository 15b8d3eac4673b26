/* Gain and offset after the plays that follow a column behind a lag, along a curve, or with plays
   of it. Called by the functions that emission writes for a chain, see
   compensator/chain/model.h. */
#include "compensator/chain/model.h"
#include "effects/influence/gain.c"

static void hystgen_course_init(const hystgen_course_table_t *t, hystgen_course_t *self,
                                hystgen_course_state_t *state) {
    unsigned int i;
    self->high = 0;
#ifndef HYSTGEN_FIXED
    self->low = 0;
#endif
    self->now = 0;
    self->seen = 0;
    self->begun = false;
    for (i = 0; i < t->n; ++i) {
        state[i].at = 0;
    }
}

/* The offset of a column's curve and plays, which follow the column. */
static hystgen_signal_t hystgen_course_bent(const hystgen_course_table_t *t,
                                            hystgen_course_state_t *state, hystgen_signal_t above) {
    const hystgen_narrow_t share =
        (hystgen_narrow_t)hystgen_times(above, &t->inverse_reach); /* of the reach */
    hystgen_signal_t total = t->square + hystgen_gain_times(t->cube, share);
    unsigned int i;
    total = hystgen_gain_times(hystgen_gain_times(total, share), share);
    for (i = 0; i < t->n; ++i) {
        const hystgen_signal_t low = above - t->play[i].threshold;
        const hystgen_signal_t high = above + t->play[i].threshold;
        if (state[i].at < low) {
            state[i].at = low;
        } else if (state[i].at > high) {
            state[i].at = high;
        } else {
            /* the play stays */
        }
        total += hystgen_times(state[i].at, &t->play[i].weight);
    }
    return total;
}

/* Follows a column, but for the reciprocal of the gain. Returns whether the gain had to be
   limited. */
static bool hystgen_course_follow(const hystgen_gain_table_t *line, hystgen_gain_t *gain,
                                  const hystgen_course_table_t *t, hystgen_course_state_t *state,
                                  hystgen_signal_t above) {
    const bool limited = hystgen_gain_line(line, gain, above);
    gain->offset += hystgen_course_bent(t, state, above);
    return limited;
}

/* Sets a column, which is at rest where it is set first. Returns whether its value or the gain had
   to be limited. */
static bool hystgen_course_set(const hystgen_gain_table_t *line, hystgen_gain_t *gain,
                               const hystgen_course_table_t *t, hystgen_course_t *self,
                               hystgen_course_state_t *state, hystgen_real_t value) {
    bool limited = false;
    const hystgen_signal_t above = hystgen_gain_above(line, value, &limited);
    self->now = above;
    if (t->lags != 0u && self->begun) {
        return limited;
    }
    self->begun = true;
    self->seen = above;
    self->high = above;
#ifndef HYSTGEN_FIXED
    self->low = 0;
#endif
    limited = hystgen_course_follow(line, gain, t, state, above) || limited;
    gain->inverse = hystgen_gain_reciprocal(gain->gain);
    return limited;
}

/* A sample has passed: the lag moves on. */
HYSTGEN_APART_IN_FIXED_BLOCK void hystgen_course_tick(const hystgen_gain_table_t *line,
                                                      hystgen_gain_t *gain,
                                                      const hystgen_course_table_t *t,
                                                      hystgen_course_t *self,
                                                      hystgen_course_state_t *state) {
    if (self->begun) {
        const hystgen_signal_t seen = self->seen;
        const hystgen_signal_t high = self->high;
        const hystgen_signal_t way =
            hystgen_times(seen - high, &t->rate) + hystgen_times(self->now - seen, &t->late);
        self->seen = self->now;
#ifdef HYSTGEN_FIXED
        self->high = high + way;
#else
        const hystgen_signal_t change = way + self->low;
        self->high = high + change;
        self->low = change - (self->high - high); /* rounding remainder of the sum */
#endif
        (void)hystgen_course_follow(line, gain, t, state, self->high);
        gain->inverse = hystgen_gain_followed(gain->gain, gain->inverse, t->turns);
    }
}
