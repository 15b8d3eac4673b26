/* A lag before a memoryless part with two branches, as in floating point. `little` is at least a
   drive code, so that a drive is still ahead of x after rounding to a code. Called by the functions
   that emission writes for a chain, see compensator/chain/model.h. */
#ifndef HYSTGEN_LAG_STEADY_FIXED_C
#define HYSTGEN_LAG_STEADY_FIXED_C
#include "arithmetic/fixed.h"
#include "compensator/chain/model.h"
#include "effects/lag/lag_fixed.c"

/* Everything has settled. */
static void hystgen_steady_rest(hystgen_steady_t *self) {
    self->way = 0;
    self->moved = 0;
    self->rises = true;
}

/* The part of a move that the lag misses in its first sample. */
static int64_t hystgen_steady_missed(const hystgen_lag_table_t *t, int64_t way) {
    return hystgen_nearest(hystgen_lag_scaled(t, way * ((int64_t)1 << t->bits), &t->theta),
                           t->bits);
}

/* The part of a target's move that is led, at most twice the previous move. */
static int64_t hystgen_steady_led(int64_t way, int64_t moved) {
    const int64_t twice = moved + moved;
    const int64_t least = twice < 0 ? twice : 0;
    const int64_t most = twice < 0 ? 0 : twice;
    if (way < least) {
        return least;
    }
    if (way > most) {
        return most;
    }
    return way;
}

/* The input v if ahead of x by `little` or more. Otherwise an input with which x comes to rest
   without going back: the last input, `applied`, or the input ahead of x by `little`. */
static int64_t hystgen_steady_kept(const hystgen_steady_t *self, const hystgen_lag_table_t *t,
                                   const hystgen_lag_t *lag, int64_t v, int64_t applied,
                                   int64_t little) {
    const bool rises = self->rises;
    const int64_t x = hystgen_nearest(lag->high, t->bits);
    const int64_t left = applied * ((int64_t)1 << t->bits) - lag->high;
    const int64_t kept = rises ? left : -left;
    if ((rises ? v - x : x - v) >= little) {
        return v;
    }
    if (kept >= 0 && kept <= (little + little) * ((int64_t)1 << t->bits)) {
        return applied;
    }
    return rises ? x + little : x - little;
}

/* The input for the output y that does not take x back from the direction `rises`. */
static int64_t hystgen_steady_solve(hystgen_steady_t *self, const hystgen_lag_table_t *t,
                                    hystgen_lag_t *lag, int64_t y, bool rises, int64_t applied,
                                    int64_t little) {
    const int64_t unit = (int64_t)1 << t->bits;
    self->rises = rises;
    self->way = y - (lag->asked >> t->bits);
    lag->wanted = (y - hystgen_steady_led(self->way, self->moved)) * unit;
    const int64_t led = hystgen_lag_solve(t, lag, y);
    const int64_t v = hystgen_steady_kept(self, t, lag, led, applied, little);
    if (v < led || v > led) {
        lag->lead = 0; /* v is not the solution: no move is requested */
    }
    return v;
}

/* The same for a lag after a brake, which takes the led part of the target's move and the shortfall
   of the previous input into account. */
static int64_t hystgen_steady_braked(hystgen_steady_t *self, const hystgen_lag_table_t *t,
                                     hystgen_braked_t *braked, int64_t y, bool rises,
                                     int64_t applied, int64_t little) {
    const int64_t missed = braked->earlier - braked->lag.wanted;
    const int64_t v = hystgen_steady_solve(self, t, &braked->lag, y, rises, applied, little);
    braked->earlier = braked->lag.wanted;
    braked->lag.wanted -= missed;
    return v;
}

/* The lag has followed. */
static void hystgen_steady_absorb(hystgen_steady_t *self, const hystgen_lag_t *lag,
                                  int64_t before) {
    (void)lag; /* no rounding remainder: the sum is exact */
    (void)before;
    self->moved = self->way;
    self->way = 0;
}

#endif
