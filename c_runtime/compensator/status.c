/* The status of an operator, which reading clears. Called by users. */
#include "compensator/model.h"

unsigned int hystgen_forward_status(hystgen_forward_t *self) {
    const unsigned int status = self->status;
    self->status = 0;
    return status;
}

unsigned int hystgen_inverse_status(hystgen_inverse_t *self) {
    const unsigned int status = self->status;
    self->status = 0;
    return status;
}
