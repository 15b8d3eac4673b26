/* A lag before a memoryless part with two branches has to arrive from the side of its branch: x and
   the output, between two values of x, move in one direction while drives lie ahead of x. In fixed
   point `little` is at least a drive code, so that a drive is still ahead of x after rounding to a
   code. Called by the functions that emission writes for a chain, see compensator/chain/model.h. */
#ifndef HYSTGEN_LAG_STEADY_C
#define HYSTGEN_LAG_STEADY_C
#include "compensator/chain/model.h"
#include "effects/lag/lag.c"

/* Everything has settled. */
static void hystgen_steady_rest(hystgen_steady_t *self) {
    self->way = 0;
    self->moved = 0;
    self->rises = true;
}

/* The part of a move that the lag misses in its first sample. */
static hystgen_signal_t hystgen_steady_missed(const hystgen_lag_table_t *t, hystgen_signal_t way) {
    return hystgen_lag_rounded(t, hystgen_lag_scaled(t, hystgen_lag_raised(t, way), &t->theta));
}

/* The part of a target's move that is led, at most twice the previous move. */
static hystgen_signal_t hystgen_steady_led(hystgen_signal_t way, hystgen_signal_t moved) {
    const hystgen_signal_t twice = moved + moved;
    const hystgen_signal_t least = twice < 0 ? twice : 0;
    const hystgen_signal_t most = twice < 0 ? 0 : twice;
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
static hystgen_signal_t hystgen_steady_kept(const hystgen_steady_t *self,
                                            const hystgen_lag_table_t *t, const hystgen_lag_t *lag,
                                            hystgen_signal_t v, hystgen_signal_t applied,
                                            hystgen_signal_t little) {
    const bool rises = self->rises;
    const hystgen_signal_t x = hystgen_lag_rounded(t, lag->high);
    const hystgen_signal_t left = hystgen_lag_raised(t, applied) - lag->high;
    const hystgen_signal_t kept = rises ? left : -left;
    const hystgen_signal_t twice = little + little;
    if ((rises ? v - x : x - v) >= little) {
        return v;
    }
    if (kept >= 0 && kept <= hystgen_lag_raised(t, twice)) {
        return applied;
    }
    return rises ? x + little : x - little;
}

/* The input for the output y that does not take x back from the direction `rises`. */
static hystgen_signal_t hystgen_steady_solve(hystgen_steady_t *self, const hystgen_lag_table_t *t,
                                             hystgen_lag_t *lag, hystgen_signal_t y, bool rises,
                                             hystgen_signal_t applied, hystgen_signal_t little) {
    self->rises = rises;
#ifdef HYSTGEN_FIXED
    self->way = y - (lag->asked >> t->bits);
#else
    self->way = y - lag->asked;
#endif
    lag->wanted = hystgen_lag_raised(t, y - hystgen_steady_led(self->way, self->moved));
    const hystgen_signal_t led = hystgen_lag_solve(t, lag, y);
    const hystgen_signal_t v = hystgen_steady_kept(self, t, lag, led, applied, little);
    hystgen_lag_replace(lag, v, v < led || v > led);
    return v;
}

/* The same for a lag after a brake, which takes the led part of the target's move and the shortfall
   of the previous input into account. */
static hystgen_signal_t hystgen_steady_braked(hystgen_steady_t *self, const hystgen_lag_table_t *t,
                                              hystgen_braked_t *braked, hystgen_signal_t y,
                                              bool rises, hystgen_signal_t applied,
                                              hystgen_signal_t little) {
    const hystgen_signal_t missed = braked->earlier - braked->lag.wanted;
    const hystgen_signal_t v =
        hystgen_steady_solve(self, t, &braked->lag, y, rises, applied, little);
    braked->earlier = braked->lag.wanted;
    braked->lag.wanted -= missed;
    return v;
}

/* The lag has followed from x = `before`. In floating point the rounding remainder of the sum is
   exact unless x has moved by its own size or more; it could then take x back and is dropped. */
static void hystgen_steady_absorb(hystgen_steady_t *self, hystgen_lag_t *lag,
                                  hystgen_signal_t before) {
    self->moved = self->way;
    self->way = 0;
#ifdef HYSTGEN_FIXED
    (void)lag;
    (void)before;
#else
    const hystgen_signal_t way = lag->high - before;
    const hystgen_signal_t size = before < 0 ? -before : before;
    if ((way < 0 ? -way : way) >= size) {
        lag->low = 0;
    }
#endif
}

#endif
