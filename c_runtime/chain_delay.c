#include "hystgen_runtime.h"

/* The drive is v at this sample. Returns the delayed drive. */
static hystgen_reach_t hystgen_forward_waited(hystgen_forward_t *self, hystgen_real_t v) {
    if (self->moving) {
        hystgen_delay_put(self->waiting, &self->oldest, v);
    } else {
        hystgen_delay_rest(self->waiting, &self->oldest, v);
    }
    return hystgen_delayed(self->waiting, self->oldest);
}
