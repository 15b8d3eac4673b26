/* A tanh stage of the memoryless part in floating point and its inverse. Called by the functions
   that emission writes for a model's stages. */
#include "hystgen_runtime.h"

/* a0 tanh(a1 x + a2) + a3 */
HYSTGEN_API hystgen_real_t hystgen_envelope_forward(const hystgen_envelope_t *e, hystgen_real_t x) {
    return e->a0 * hystgen_tanh(e->a1 * x + e->a2) + e->a3;
}

/* (atanh((y - a3) / a0) - a2) / a1. If no x gives y, limits the argument and sets `limited`. */
HYSTGEN_API hystgen_real_t hystgen_envelope_inverse(const hystgen_envelope_t *e, hystgen_real_t y,
                                                    bool *limited) {
    hystgen_real_t argument = (y - e->a3) * e->inverse_a0;
    if (argument > e->limit) {
        argument = e->limit;
        *limited = true;
    } else if (argument < -e->limit) {
        argument = -e->limit;
        *limited = true;
    }
    return (hystgen_atanh(argument) - e->a2) * e->inverse_a1;
}
