#include "hystgen_runtime.h"

/* A signal in front of the plays of a model with effects, limited to what the drive's range gives.
 */
static hystgen_fine_t hystgen_clamp_fine(hystgen_reach_t a) {
    if (a < HYSTGEN_FINE_MIN) {
        return (hystgen_fine_t)HYSTGEN_FINE_MIN;
    }
    if (a > HYSTGEN_FINE_MAX) {
        return (hystgen_fine_t)HYSTGEN_FINE_MAX;
    }
    return (hystgen_fine_t)a;
}
