#include "hystgen_runtime.h"

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
