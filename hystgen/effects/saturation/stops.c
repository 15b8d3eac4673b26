/* Stops behind the plays, in fixed point: beyond them the output continues with another slope.
   Called by the functions that emission writes for a chain, see compensator/chain/model.h. */
#include "arithmetic/fixed.h"
#include "compensator/chain/model.h"
#include "arithmetic/factors.c"

/* x between the stops, and a slope of f beyond them. */
static int64_t hystgen_stops_beyond(const hystgen_stops_t *t, int64_t x,
                                    const hystgen_factor_t *f) {
    int64_t inside;
    if (x < t->lower) {
        inside = t->lower;
    } else if (x > t->upper) {
        inside = t->upper;
    } else {
        inside = x;
    }
    return inside + hystgen_times(x - inside, f);
}

static int64_t hystgen_stops_forward(const hystgen_stops_t *t, int64_t x) {
    return hystgen_stops_beyond(t, x, &t->give);
}

static int64_t hystgen_stops_inverse(const hystgen_stops_t *t, int64_t y) {
    return hystgen_stops_beyond(t, y, &t->inverse_give);
}
