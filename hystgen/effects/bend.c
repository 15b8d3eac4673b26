/* A smooth limit behind the plays, in fixed point: piecewise polynomials for it and its inverse.
   Called by the functions that emission writes for a chain, see compensator/chain/model.h. */
#include "arithmetic/fixed.h"
#include "compensator/chain/model.h"

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
