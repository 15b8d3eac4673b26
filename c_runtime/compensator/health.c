/* Watches the error of the model over windows of samples. Called by users. */
#ifndef HYSTGEN_HEALTH_C
#define HYSTGEN_HEALTH_C
#include "compensator/model.h"
#ifndef HYSTGEN_CONFIGURED
#include "compensator/api.h"
#endif

void hystgen_health_init(hystgen_health_t *self) {
    self->sum = 0;
    self->squares = 0;
    self->mean = 0;
    self->mean_square = 0;
    self->left = HYSTGEN_HEALTH_WINDOW;
    self->status = 0;
}

/* Few instructions at the end of a window, which costs most: sums stay in registers until the
   branch, and the square of the mean needs one comparison instead of two. */
unsigned int hystgen_health_update(hystgen_health_t *self, hystgen_real_t expected,
                                   hystgen_real_t measured) {
#ifdef HYSTGEN_FIXED
    const int32_t error =
        (int32_t)(measured >> HYSTGEN_HEALTH_HALVED) - (int32_t)(expected >> HYSTGEN_HEALTH_HALVED);
    const int32_t part = error >> HYSTGEN_HEALTH_SHIFT;
    const int64_t sum = self->sum + error;
    const int64_t squares = self->squares + (int64_t)part * part;
#else
    const hystgen_real_t error = measured - expected;
    if (!(error >= -HYSTGEN_REAL_MAX && error <= HYSTGEN_REAL_MAX)) { /* NaN too */
        return self->status;
    }
    const hystgen_real_t sum = self->sum + error;
    const hystgen_real_t squares = self->squares + error * error;
#endif
    const uint32_t left = self->left - 1u;
    if (left != 0) {
        self->sum = sum;
        self->squares = squares;
        self->left = left;
        return self->status;
    }
    self->sum = 0;
    self->squares = 0;
    self->left = HYSTGEN_HEALTH_WINDOW;
#ifdef HYSTGEN_FIXED
    const int32_t mean = (int32_t)(sum >> HYSTGEN_HEALTH_BITS);
    const int64_t mean_square = squares; /* HYSTGEN_HEALTH_SQUARE_LSB divides by the window */
    const bool centred = mean >= -HYSTGEN_HEALTH_MEAN_MOST && mean <= HYSTGEN_HEALTH_MEAN_MOST;
#else
    const hystgen_real_t mean = sum * HYSTGEN_HEALTH_SHARE;
    const hystgen_real_t mean_square = squares * HYSTGEN_HEALTH_SHARE;
    const bool centred = mean * mean <= HYSTGEN_HEALTH_MEAN_MOST;
#endif
    self->mean = mean;
    self->mean_square = mean_square;
    if (centred && mean_square <= HYSTGEN_HEALTH_SQUARE_MOST) {
        self->status = 0;
        return 0;
    }
    self->status = HYSTGEN_STATUS_MODEL_LEFT;
    return HYSTGEN_STATUS_MODEL_LEFT;
}

#endif
