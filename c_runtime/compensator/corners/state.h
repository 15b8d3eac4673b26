/* The memory of operators without a memoryless part, in floating point. */
#ifndef HYSTGEN_CONFIGURED
#define HYSTGEN_HAS_CORNERS
#endif
#include "compensator/model.h"
#ifndef HYSTGEN_CORNERS_STATE_H
#define HYSTGEN_CORNERS_STATE_H

/* One forward operator: drive in, output out. Plain data, owned by the caller. */
typedef struct {
    hystgen_plays_t plays;
    unsigned int status;
    hystgen_corner_t corner[HYSTGEN_CORNERS];
} hystgen_forward_t;

/* One inverse operator: reference in, drive out. Plain data, owned by the caller. */
typedef struct {
    hystgen_plays_t plays;
    hystgen_place_t undo;    /* where the plays were before the last step, if not along a line */
    hystgen_real_t before;   /* input before such a step, else the present one */
    hystgen_real_t returned; /* by the last step, if another drive was committed since */
    bool stepped;            /* a step has answered */
    bool committed;          /* a drive was committed since */
    unsigned int status;
    hystgen_corner_t corner[HYSTGEN_CORNERS];
} hystgen_inverse_t;

#endif
