/* The status of an operator, which reading clears. Called by users. */
#include "compensator/model.h"

unsigned int hystgen_operator_status(hystgen_operator_t *self) {
    const unsigned int status = self->status;
    self->status = 0;
    return status;
}
