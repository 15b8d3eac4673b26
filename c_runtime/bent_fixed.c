#include "hystgen_runtime.h"

/* What a play bent by curve c contributes at z, in fixed point: z and the value of the curve.
   Beyond where plays can be a curve stays at its end. */
HYSTGEN_APART int64_t hystgen_bent_by(const hystgen_bump_t *c, int32_t z) {
    int32_t inside;
    if (z < -HYSTGEN_BUMP_END) {
        inside = -HYSTGEN_BUMP_END;
    } else if (z > HYSTGEN_BUMP_END) {
        inside = HYSTGEN_BUMP_END;
    } else {
        inside = z;
    }
    const int64_t value =
        hystgen_curve(c->knot, c->scale, c->coefficient, c->pieces, HYSTGEN_BUMP_DEGREE, inside);
    return z + hystgen_nearest(value * ((int64_t)1 << HYSTGEN_BUMP_LIFT), HYSTGEN_BUMP_BITS);
}

/* What play i contributes at z; several plays may have a curve in common. */
HYSTGEN_APART int64_t hystgen_bent(unsigned int i, int32_t z) {
    const uint16_t curve = hystgen_bump_of[i];
    return hystgen_bent_by(&hystgen_bump[curve], z);
}
