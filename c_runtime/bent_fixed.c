#include "hystgen_runtime.h"

/* What play i contributes at z, in fixed point: z plus the value of a curve, which plays may share.
   Beyond the range of the plays a curve keeps its end value. */
HYSTGEN_APART int64_t hystgen_bent(unsigned int i, int64_t z) {
    bool limited = false; /* not reported: only inputs tried by a search go that far */
    return z + hystgen_nearest(hystgen_bend(&hystgen_bump[hystgen_bump_of[i]], z, &limited),
                               HYSTGEN_BUMP_BITS);
}
