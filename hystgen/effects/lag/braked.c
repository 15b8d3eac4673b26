/* A lag after a slew limit. A drive far ahead of the lag takes time to come back, so that its lead
   has to shrink before the lag arrives. Called by slew_limit/brake.c and by the functions that
   emission writes for a chain. */
#ifndef HYSTGEN_LAG_BRAKED_C
#define HYSTGEN_LAG_BRAKED_C
#include "compensator/chain/model.h"
#include "compensator/chain/drive_signal.c"
#include "effects/lag/lag.c"

/* Bisection steps of the search for a lead, which end within 2^-16 of the interval. */
#define HYSTGEN_BRAKED_HALVES 16u

/* Settles everything at the input v. Returns the output. */
static hystgen_signal_t hystgen_braked_rest(const hystgen_lag_table_t *t, hystgen_braked_t *self,
                                            hystgen_signal_t v) {
    self->earlier = hystgen_lag_raised(t, v);
    return hystgen_lag_rest(t, &self->lag, v);
}

/* The input for the output y at this sample. */
static hystgen_signal_t hystgen_braked_solve(const hystgen_lag_table_t *t, hystgen_braked_t *self,
                                             hystgen_signal_t y) {
    return hystgen_lag_solve(t, &self->lag, y);
}

/* Takes the input v at this sample. Returns the output. */
static hystgen_signal_t hystgen_braked_absorb(const hystgen_lag_table_t *t, hystgen_braked_t *self,
                                              hystgen_signal_t v) {
    self->earlier = self->lag.asked;
    return hystgen_lag_absorb(t, &self->lag, v);
}

/* Move of the lag's target in this step, limited to the drive's rate. */
static hystgen_signal_t hystgen_braked_way(const hystgen_lag_table_t *t,
                                           const hystgen_braked_t *self) {
    const hystgen_signal_t most = hystgen_lag_raised(t, hystgen_drive_signal(HYSTGEN_SLEW_RISING));
    const hystgen_signal_t least =
        hystgen_lag_raised(t, hystgen_drive_signal(-HYSTGEN_SLEW_FALLING));
    const hystgen_signal_t move = self->lag.asked - self->earlier;
    const hystgen_signal_t inside = move > most ? most : move;
    return inside < least ? least : inside;
}

/* The largest lead m, up to `lead`, with which the lag gains no more than `size` until the lead is
   gone: the square of m plus `margin`, half of what m shrinks by in a step, is at most a limit, 2
   size times the lead with which the lag gains in one step what m shrinks by. `once`: that lead in
   fixed point, where it takes less stack than the limit, which it is in floating point. */
HYSTGEN_APART_IN_FIXED_BLOCK hystgen_narrow_t hystgen_braked_lead(hystgen_narrow_t size,
                                                                  hystgen_narrow_t lead,
                                                                  hystgen_narrow_t margin,
                                                                  hystgen_narrow_t once) {
#ifdef HYSTGEN_FIXED
    const hystgen_signal_t limit = (hystgen_signal_t)2 * size * once;
#else
    const hystgen_signal_t limit = once;
#endif
    hystgen_narrow_t low = size;
    hystgen_narrow_t high = lead;
    unsigned int i;
    if (lead <= size || (hystgen_signal_t)(lead + margin) * (lead + margin) <= limit) {
        return lead;
    }
    for (i = 0; i < HYSTGEN_BRAKED_HALVES; ++i) {
        const hystgen_narrow_t middle = low + (high - low) / 2;
        if ((hystgen_signal_t)(middle + margin) * (middle + margin) <= limit) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

/* The cut `over` of a lead, limited to `room`. */
static hystgen_narrow_t hystgen_braked_cut(hystgen_narrow_t over, hystgen_narrow_t room) {
    if (over > room) {
        return room;
    }
    return over < -room ? -room : over;
}

#ifdef HYSTGEN_FIXED
/* Largest number in the search for a lead: the square of a sum of two fits 64 bits. */
#define HYSTGEN_BRAKED_MOST (((int32_t)1 << 30) - 1)

/* Numbers of the search for a lead, with fewer bits than signals. */
typedef struct {
    int32_t left; /* distance that the lag is to gain beyond its target's move */
    int32_t back; /* decrease in the lead per step */
    int32_t lead; /* lead before a cut */
    int32_t room; /* largest cut in the lead */
} hystgen_brake_t;

/* A signal as a number of the search, which has fewer bits. */
static int32_t hystgen_braked_coarse(int64_t x) {
    const int64_t coarse = x >> HYSTGEN_BRAKED_DROP;
    if (coarse > HYSTGEN_BRAKED_MOST) {
        return HYSTGEN_BRAKED_MOST;
    }
    return coarse < -HYSTGEN_BRAKED_MOST ? -HYSTGEN_BRAKED_MOST : (int32_t)coarse;
}

/* Lead, a signal, with which the lag moves by x, in units of its state, in a step: x/(1 - E). */
HYSTGEN_APART int64_t hystgen_braked_led(const hystgen_lag_table_t *t, int64_t x) {
    return hystgen_lag_scaled(t, x, &t->inverse_rate);
}

/* The same for numbers of the search. */
static int32_t hystgen_braked_coarsely(const hystgen_lag_table_t *t, int32_t x) {
    const int64_t state = (int64_t)x * ((int64_t)1 << (t->bits + HYSTGEN_BRAKED_DROP));
    return hystgen_braked_coarse(hystgen_braked_led(t, state));
}

/* Sets the largest cut of the lead: the present and the previous shortfall of the drive. Returns
   whether this cut is half a code or more; less would not change a drive. */
HYSTGEN_APART bool hystgen_braked_room(const hystgen_lag_table_t *t, const hystgen_braked_t *self,
                                       hystgen_brake_t *brake, int64_t beyond) {
    const int64_t missed = self->earlier - self->lag.wanted;
    const int64_t room = beyond + hystgen_braked_led(t, missed < 0 ? -missed : missed);
    brake->room = hystgen_braked_coarse(room);
    return room + room >= (int64_t)1 << HYSTGEN_DRIVE_BITS;
}

/* Move of the lag's target in this step. Sets the distance that the lag is to gain beyond this
   move, and the decrease of its lead in a step. */
HYSTGEN_APART int64_t hystgen_braked_along(const hystgen_lag_table_t *t,
                                           const hystgen_braked_t *self, hystgen_brake_t *brake) {
    const int64_t way = hystgen_braked_way(t, self);
    const int64_t left =
        self->lag.asked - self->lag.high + hystgen_lag_scaled(t, way, &t->theta) - way;
    const int64_t down = hystgen_lag_rounded(t, way);
    brake->left = hystgen_braked_coarse(hystgen_lag_rounded(t, left));
    brake->back =
        hystgen_braked_coarse(left < 0 ? hystgen_drive_signal(HYSTGEN_SLEW_RISING) - down
                                       : hystgen_drive_signal(HYSTGEN_SLEW_FALLING) + down);
    return way;
}

/* The largest lead that still comes back in time. */
HYSTGEN_APART int32_t hystgen_braked_most(const hystgen_lag_table_t *t,
                                          const hystgen_brake_t *brake) {
    const int32_t size = brake->left < 0 ? -brake->left : brake->left;
    const int32_t margin = brake->back >> 1;
    const int32_t most = size <= margin ? hystgen_braked_coarsely(t, size) : size;
    if (most > margin) {
        return hystgen_braked_lead(size, brake->lead, margin,
                                   hystgen_braked_coarsely(t, brake->back));
    }
    return most;
}

/* The drive from which the lag does not overshoot. `reachable` is the drive nearest to the
   solution that the amplifier reaches, `beyond` their distance. The lead is cut at most by the
   present and the previous shortfall of the drive. */
static int64_t hystgen_braked_drive(const hystgen_lag_table_t *t, const hystgen_braked_t *self,
                                    int64_t reachable, int64_t beyond) {
    hystgen_brake_t brake;
    if (!hystgen_braked_room(t, self, &brake, beyond)) {
        return reachable;
    }
    const int64_t along = hystgen_braked_led(t, hystgen_braked_along(t, self, &brake));
    const int64_t ahead = reachable - hystgen_lag_rounded(t, self->lag.high) - along;
    brake.lead = hystgen_braked_coarse(brake.left < 0 ? -ahead : ahead);
    const int64_t less =
        (int64_t)hystgen_braked_cut(brake.lead - hystgen_braked_most(t, &brake), brake.room) *
        ((int64_t)1 << HYSTGEN_BRAKED_DROP);
    return brake.left < 0 ? reachable + less : reachable - less;
}
#else
/* Cut of `lead`, limited to `room`: its excess over the largest lead that comes back in time. The
   lag is to gain `size`; a lead of `most` gains this in one step. A lead shrinks by `back` in a
   step. */
static hystgen_real_t hystgen_braked_over(hystgen_real_t size, hystgen_real_t most,
                                          hystgen_real_t lead, hystgen_real_t back,
                                          hystgen_real_t room) {
    const hystgen_real_t margin = back / 2;
    const hystgen_real_t longest =
        most > margin ? hystgen_braked_lead(size, lead, margin, (most + most) * back) : most;
    return hystgen_braked_cut(lead - longest, room);
}

/* The drive from which the lag does not overshoot. `reachable` is the drive nearest to the
   solution that the amplifier reaches, `beyond` their distance. The lead is cut at most by the
   present and the previous shortfall of the drive. A target moving by `way` in a step needs a lead
   of way/(1 - E). */
HYSTGEN_APART hystgen_real_t hystgen_braked_drive(const hystgen_lag_table_t *t,
                                                  const hystgen_braked_t *self,
                                                  hystgen_real_t reachable, hystgen_real_t beyond) {
    const hystgen_lag_t *lag = &self->lag;
    const hystgen_real_t missed = self->earlier - lag->wanted;
    const hystgen_real_t room = beyond + (missed < 0 ? -missed : missed) * t->inverse_rate;
    if (!(room > 0)) {
        return reachable;
    }
    const hystgen_real_t way = hystgen_braked_way(t, self);
    const hystgen_real_t left = (lag->asked - lag->high) + (t->theta * way - way);
    const hystgen_real_t ahead = reachable - (lag->high + way * t->inverse_rate);
    return left < 0 ? reachable + hystgen_braked_over(-left, -left * t->inverse_rate, -ahead,
                                                      HYSTGEN_SLEW_RISING - way, room)
                    : reachable - hystgen_braked_over(left, left * t->inverse_rate, ahead,
                                                      HYSTGEN_SLEW_FALLING + way, room);
}
#endif

#endif
