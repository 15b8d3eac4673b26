/* A lag after a slew limit. A drive far ahead of the lag takes time to come back, so that its lead
   has to shrink before the lag arrives. Called by slew_limit/brake.c and by the functions that
   emission writes for a chain. */
#ifndef HYSTGEN_LAG_BRAKED_C
#define HYSTGEN_LAG_BRAKED_C
#include "compensator/chain/model.h"
#include "effects/lag/lag.c"

/* Bisection steps of the search for a lead, which end within 2^-16 of the interval. */
#define HYSTGEN_BRAKED_HALVES 16u

/* Settles everything at the input v. Returns the output. */
static hystgen_real_t hystgen_braked_rest(hystgen_braked_t *self, hystgen_real_t v) {
    self->earlier = v;
    return hystgen_lag_rest(&self->lag, v);
}

/* The input for the output y at this sample. */
static hystgen_real_t hystgen_braked_solve(const hystgen_lag_table_t *t, hystgen_braked_t *self,
                                           hystgen_real_t y) {
    return hystgen_lag_solve(t, &self->lag, y);
}

/* Takes the input v at this sample. Returns the output. */
static hystgen_real_t hystgen_braked_absorb(const hystgen_lag_table_t *t, hystgen_braked_t *self,
                                            hystgen_real_t v) {
    self->earlier = self->lag.asked;
    return hystgen_lag_absorb(t, &self->lag, v);
}

/* Excess of `lead` over the largest lead that comes back in time, limited to `room`. The lag is to
   gain `size`; a lead of `most` gains this in one step. With a lead m that shrinks by `back` in a
   step, the lag gains at most (m + back/2)^2 / (2 back most) of `size` until the lead is gone. */
static hystgen_real_t hystgen_braked_over(hystgen_real_t size, hystgen_real_t most,
                                          hystgen_real_t lead, hystgen_real_t back,
                                          hystgen_real_t room) {
    const hystgen_real_t margin = back / 2;
    hystgen_real_t over = lead - most;
    if (most > margin) {
        const hystgen_real_t limit = (most + most) * back;
        hystgen_real_t low = size;
        hystgen_real_t high = lead;
        unsigned int i;
        if (lead <= size || (lead + margin) * (lead + margin) <= limit) {
            return 0;
        }
        for (i = 0; i < HYSTGEN_BRAKED_HALVES; ++i) {
            const hystgen_real_t middle = low + (high - low) / 2;
            if ((middle + margin) * (middle + margin) <= limit) {
                low = middle;
            } else {
                high = middle;
            }
        }
        over = lead - low;
    }
    if (over > room) {
        return room;
    }
    return over < -room ? -room : over;
}

/* The drive from which the lag does not overshoot. `reachable` is the drive nearest to the
   solution that the amplifier reaches, `beyond` their distance. The lead is cut at most by the
   present and the previous shortfall of the drive. A target moving by `way` in a step needs a
   lead of way/(1 - E). */
HYSTGEN_APART hystgen_real_t hystgen_braked_drive(const hystgen_lag_table_t *t,
                                                  const hystgen_braked_t *self,
                                                  hystgen_real_t reachable, hystgen_real_t beyond) {
    const hystgen_lag_t *lag = &self->lag;
    const hystgen_real_t missed = self->earlier - lag->wanted;
    const hystgen_real_t room = beyond + (missed < 0 ? -missed : missed) * t->inverse_rate;
    if (!(room > 0)) {
        return reachable;
    }
    const hystgen_real_t move = lag->asked - self->earlier;
    const hystgen_real_t most = move > HYSTGEN_SLEW_RISING ? HYSTGEN_SLEW_RISING : move;
    const hystgen_real_t way = most < -HYSTGEN_SLEW_FALLING ? -HYSTGEN_SLEW_FALLING : most;
    const hystgen_real_t left = (lag->asked - lag->high) + (t->theta * way - way);
    const hystgen_real_t ahead = reachable - (lag->high + way * t->inverse_rate);
    return left < 0 ? reachable + hystgen_braked_over(-left, -left * t->inverse_rate, -ahead,
                                                      HYSTGEN_SLEW_RISING - way, room)
                    : reachable - hystgen_braked_over(left, left * t->inverse_rate, ahead,
                                                      HYSTGEN_SLEW_FALLING + way, room);
}

#endif
