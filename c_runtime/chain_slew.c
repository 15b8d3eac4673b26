#include "hystgen_runtime.h"

/* The drive nearest to v that the amplifier reaches in one step; v itself in the first one. */
static hystgen_reach_t hystgen_forward_slewed(hystgen_forward_t *self, hystgen_reach_t v) {
    hystgen_reach_t reached = v;
    if (self->moving) {
        const hystgen_reach_t highest = (hystgen_reach_t)self->reached + HYSTGEN_SLEW_RISING;
        const hystgen_reach_t lowest = (hystgen_reach_t)self->reached - HYSTGEN_SLEW_FALLING;
        reached = v > highest ? highest : v < lowest ? lowest : v;
    }
    self->reached = (hystgen_real_t)reached;
    return reached;
}
