#include "hystgen_runtime.h"

/* What play i contributes at z: more or less than z around a centre. Play 0 is the input itself. */
HYSTGEN_APART hystgen_real_t hystgen_bent(unsigned int i, hystgen_real_t z) {
    const hystgen_real_t x = (z - HYSTGEN_CENTRE) * HYSTGEN_INVERSE_WIDTH;
    return i == 0 ? z : z + HYSTGEN_BUMP * (hystgen_tanh(x) + HYSTGEN_TANH_CENTRE);
}
