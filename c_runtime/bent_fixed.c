#include "hystgen_runtime.h"

/* What play i contributes at z, in fixed point: z and the value of a curve, which several plays may
   have in common. Beyond where plays can be a curve stays at its end. */
HYSTGEN_APART int64_t hystgen_bent(unsigned int i, int64_t z) {
    bool limited = false; /* of inputs that a search tries */
    return z + hystgen_nearest(hystgen_bend(&hystgen_bump[hystgen_bump_of[i]], z, &limited),
                               HYSTGEN_BUMP_BITS);
}
