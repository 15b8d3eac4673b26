#include "hystgen_runtime.h"

/* A drive between those that the amplifier reaches in one step. */
HYSTGEN_APART_IN_FIXED hystgen_reach_t hystgen_inverse_within(const hystgen_inverse_t *self,
                                                              hystgen_reach_t v) {
    const hystgen_reach_t highest = (hystgen_reach_t)self->applied + HYSTGEN_SLEW_RISING;
    const hystgen_reach_t lowest = (hystgen_reach_t)self->applied - HYSTGEN_SLEW_FALLING;
    return v > highest ? highest : v < lowest ? lowest : v;
}
