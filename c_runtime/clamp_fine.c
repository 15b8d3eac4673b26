#include "hystgen_runtime.h"

/* A signal in front of the plays of a model with effects, limited to what the drive's range gives.
 */
static hystgen_fine_t hystgen_clamp_fine(hystgen_reach_t a) {
    hystgen_reach_t inside = a;
    if (a < HYSTGEN_FINE_MIN) {
        inside = HYSTGEN_FINE_MIN;
    }
    if (a > HYSTGEN_FINE_MAX) {
        inside = HYSTGEN_FINE_MAX;
    }
    return (hystgen_fine_t)inside;
}
