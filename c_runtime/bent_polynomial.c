#include "hystgen_runtime.h"

/* What play i contributes at z: a polynomial for each play. Play 0 is the input itself. */
static hystgen_real_t hystgen_bent(unsigned int i, hystgen_real_t z) {
    const hystgen_real_t x = z * HYSTGEN_INVERSE_SCALE;
    hystgen_real_t sum = 0;
    unsigned int k;
    for (k = HYSTGEN_TERMS; k > 0; --k) {
        sum = (sum + hystgen_curve[i][k - 1u]) * x;
    }
    return z + HYSTGEN_SCALE * (sum * x);
}
