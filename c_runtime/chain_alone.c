#include "hystgen_runtime.h"

/* Operators of a model without effects: the drive may move any distance in one step, and the same
   reference gets the same answer. */

/* The drive may move any distance in one step. */
static hystgen_reach_t hystgen_forward_slewed(hystgen_forward_t *self, hystgen_reach_t v) {
    (void)self;
    return v;
}

/* The drive may move any distance in one step. */
static hystgen_reach_t hystgen_inverse_slewed(hystgen_inverse_t *self, hystgen_reach_t v) {
    (void)self;
    return v;
}

/* The last answer once more. */
static hystgen_real_t hystgen_inverse_held(const hystgen_inverse_t *self) {
    return self->stepped ? self->answer : self->drive;
}

/* Whether the last answer still stands for reference u; u is the last reference from now on. */
static bool hystgen_inverse_stands(hystgen_inverse_t *self, hystgen_real_t u) {
    if (self->repeat && u >= self->reference && u <= self->reference) {
        self->status |= self->bits;
        return true;
    }
    self->reference = u;
    self->repeat = true;
    return false;
}
