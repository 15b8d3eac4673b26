/* The forward operator without a memoryless part, in fixed point. Called by users. */
#include "arithmetic/fixed.h"
#ifndef HYSTGEN_CONFIGURED
#define HYSTGEN_HAS_CORNERS
#endif
#include "compensator/model.h"
#include "front/front.c"
#include "compensator/clamp.c"
#include "compensator/code.c"

/* One sample. */
hystgen_real_t hystgen_forward_step(hystgen_forward_t *self, hystgen_real_t v) {
    const hystgen_real_t inside = hystgen_clamp_drive(v);
    if (inside != v) {
        self->status |= HYSTGEN_STATUS_INPUT_CLAMPED;
    }
    const int32_t to = hystgen_front_forward(inside);
    const int64_t sum = hystgen_plays_step(&hystgen_model_curve, &self->here, self->corner,
                                           &self->kink, &self->next, to);
    return hystgen_code(sum, &self->status);
}

static void hystgen_forward_begin(hystgen_forward_t *self, const int32_t *play, unsigned int step) {
    hystgen_start(&hystgen_model_curve, &self->here, self->corner, play, step);
    self->next = self->here.input;
    self->status = 0;
}

void hystgen_forward_init(hystgen_forward_t *self) {
    hystgen_forward_begin(self, hystgen_model_start, HYSTGEN_START_STEP);
}

void hystgen_forward_reset(hystgen_forward_t *self, hystgen_real_t v) {
    hystgen_forward_begin(self, hystgen_model_zero, 0);
    (void)hystgen_forward_step(self, v);
}
