/* Maps of the output and their inverses, in fixed point: piecewise polynomials, or stops, beyond
   which the output continues with another slope. Called by the functions that emission writes for a
   chain, see compensator/chain/model.h. */
#include "arithmetic/fixed.h"
#include "compensator/chain/model.h"
#include "arithmetic/factors.c"

/* The value of a curve at x; sets `limited` if x lies beyond its ends. */
static int64_t hystgen_bend(const hystgen_bend_curve_t *c, int64_t x, bool *limited) {
    const int64_t argument = hystgen_nearest(x, c->drop);
    int64_t inside;
    if (argument < c->least) {
        inside = c->least;
    } else if (argument > c->most) {
        inside = c->most;
    } else {
        inside = argument;
    }
    if (inside != argument) {
        *limited = true;
    }
    return hystgen_curve(c->knot, c->scale, c->coefficient, c->pieces, c->degree, (int32_t)inside) *
           ((int64_t)1 << c->lift);
}

static int64_t hystgen_bend_forward(const hystgen_bend_t *t, int64_t x) {
    bool limited = false; /* not reported */
    return hystgen_bend(&t->forward, x, &limited);
}

static int64_t hystgen_bend_inverse(const hystgen_bend_t *t, int64_t y, bool *limited) {
    return hystgen_bend(&t->inverse, y, limited);
}

/* x between the stops; beyond them the slope is f. */
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
