#include "hystgen_runtime.h"

/* The drive from which the lag behind the amplifier does not overshoot on its way to the answer v,
   of which `near` is the nearest that the amplifier reaches. */
static hystgen_reach_t hystgen_inverse_braked(const hystgen_inverse_t *self, hystgen_reach_t v,
                                              hystgen_reach_t near) {
    return hystgen_drive_code(
        hystgen_braked_drive(&hystgen_braked_1, &self->braked_1, hystgen_entered_drive(near),
                             hystgen_entered_drive(v > near ? v - near : near - v)));
}
