/* A lag after a slew limit, in fixed point. A drive far ahead of the lag takes time to come back,
   so that its lead has to shrink before the lag arrives. Called by slew_limit/brake.c and by the
   functions that emission writes for a chain. */
#ifndef HYSTGEN_LAG_BRAKED_FIXED_C
#define HYSTGEN_LAG_BRAKED_FIXED_C
#include "arithmetic/fixed.h"
#include "compensator/chain/model.h"
#include "effects/lag/lag_fixed.c"

/* Bisection steps of the search for a lead, which end within 2^-16 of the interval. */
#define HYSTGEN_BRAKED_HALVES 16u

/* Largest number in the search for a lead: the square of a sum of two fits 64 bits. */
#define HYSTGEN_BRAKED_MOST (((int32_t)1 << 30) - 1)

/* Settles everything at the input v. Returns the output. */
static int64_t hystgen_braked_rest(const hystgen_lag_table_t *t, hystgen_braked_t *self,
                                   int64_t v) {
    const int64_t output = hystgen_lag_rest(t, &self->lag, v);
    self->earlier = self->lag.asked;
    return output;
}

/* The input for the output y at this sample. */
static int64_t hystgen_braked_solve(const hystgen_lag_table_t *t, hystgen_braked_t *self,
                                    int64_t y) {
    return hystgen_lag_solve(t, &self->lag, y);
}

/* Takes the input v at this sample. Returns the output. */
static int64_t hystgen_braked_absorb(const hystgen_lag_table_t *t, hystgen_braked_t *self,
                                     int64_t v) {
    self->earlier = self->lag.asked;
    return hystgen_lag_absorb(t, &self->lag, v);
}

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

/* Move of the lag's target in this step, in units of its state, limited to the drive's rate. Sets
   the distance that the lag is to gain beyond this move, and the decrease of its lead in a step. */
HYSTGEN_APART int64_t hystgen_braked_along(const hystgen_lag_table_t *t,
                                           const hystgen_braked_t *self, hystgen_brake_t *brake) {
    const int64_t rising = (int64_t)HYSTGEN_SLEW_RISING * ((int64_t)1 << HYSTGEN_DRIVE_BITS);
    const int64_t falling = (int64_t)HYSTGEN_SLEW_FALLING * ((int64_t)1 << HYSTGEN_DRIVE_BITS);
    const int64_t most = rising * ((int64_t)1 << t->bits);
    const int64_t least = -falling * ((int64_t)1 << t->bits);
    const int64_t move = self->lag.asked - self->earlier;
    const int64_t inside = move > most ? most : move;
    const int64_t way = inside < least ? least : inside;
    const int64_t left =
        self->lag.asked - self->lag.high + hystgen_lag_scaled(t, way, &t->theta) - way;
    const int64_t down = hystgen_nearest(way, t->bits) + falling;
    brake->left = hystgen_braked_coarse(hystgen_nearest(left, t->bits));
    brake->back = hystgen_braked_coarse(left < 0 ? rising + falling - down : down);
    return way;
}

/* The largest lead m, up to `lead`, with which the lag gains no more than `size` until the lead is
   gone: (m + back/2)^2 / (2 way), where `way` is back/(1 - E). */
HYSTGEN_APART int32_t hystgen_braked_lead(int32_t size, int32_t lead, int32_t margin, int32_t way) {
    const int64_t limit = (int64_t)2 * size * way;
    int32_t low = size;
    int32_t high = lead;
    unsigned int i;
    if (lead <= size || (int64_t)(lead + margin) * (lead + margin) <= limit) {
        return lead;
    }
    for (i = 0; i < HYSTGEN_BRAKED_HALVES; ++i) {
        const int32_t middle = low + ((high - low) >> 1);
        if ((int64_t)(middle + margin) * (middle + margin) <= limit) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
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

/* Cut of the lead: its excess over the largest that comes back in time, limited to `room`. */
static int32_t hystgen_braked_over(const hystgen_lag_table_t *t, const hystgen_brake_t *brake) {
    const int32_t over = brake->lead - hystgen_braked_most(t, brake);
    if (over > brake->room) {
        return brake->room;
    }
    return over < -brake->room ? -brake->room : over;
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
    const int64_t ahead = reachable - hystgen_nearest(self->lag.high, t->bits) - along;
    brake.lead = hystgen_braked_coarse(brake.left < 0 ? -ahead : ahead);
    const int64_t less =
        (int64_t)hystgen_braked_over(t, &brake) * ((int64_t)1 << HYSTGEN_BRAKED_DROP);
    return brake.left < 0 ? reachable + less : reachable - less;
}

#endif
