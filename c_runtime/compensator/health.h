/* Memory of the watch over the model's error. Called by users. */
#include "compensator/model.h"
#ifndef HYSTGEN_HEALTH_H
#define HYSTGEN_HEALTH_H

#ifdef HYSTGEN_FIXED
/* Error of the model, measured minus expected, over windows of samples. Plain data, owned by the
   caller. */
typedef struct {
    int64_t sum; /* of the present window */
    int64_t squares;
    int64_t mean_square; /* of the last whole window, in HYSTGEN_HEALTH_SQUARE_LSB */
    int32_t mean;        /* in HYSTGEN_HEALTH_MEAN_LSB */
    uint32_t left;       /* samples until the present window ends */
    unsigned int status;
} hystgen_health_t;
#else
/* Error of the model, measured minus expected, over windows of samples. Plain data, owned by the
   caller. */
typedef struct {
    hystgen_real_t sum; /* of the present window */
    hystgen_real_t squares;
    hystgen_real_t mean; /* of the last whole window */
    hystgen_real_t mean_square;
    uint32_t left; /* samples until the present window ends */
    unsigned int status;
} hystgen_health_t;
#endif

#endif
