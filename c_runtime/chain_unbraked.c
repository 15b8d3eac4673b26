#include "hystgen_runtime.h"

/* The drive nearest to v that the amplifier reaches in one step; v itself in the first one. */
static hystgen_reach_t hystgen_inverse_slewed(const hystgen_inverse_t *self, hystgen_reach_t v) {
    const hystgen_reach_t highest = (hystgen_reach_t)self->applied + HYSTGEN_SLEW_RISING;
    const hystgen_reach_t lowest = (hystgen_reach_t)self->applied - HYSTGEN_SLEW_FALLING;
    return !self->moving ? v : v > highest ? highest : v < lowest ? lowest : v;
}
