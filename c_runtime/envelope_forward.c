#include "hystgen_runtime.h"

/* a0 tanh(a1 x + a2) + a3 */
HYSTGEN_API hystgen_real_t hystgen_envelope_forward(const hystgen_envelope_t *e, hystgen_real_t x) {
    return e->a0 * hystgen_tanh(e->a1 * x + e->a2) + e->a3;
}
