/* The memory of operators without a memoryless part, in fixed point. */
#include "arithmetic/fixed.h"
#ifndef HYSTGEN_CONFIGURED
#define HYSTGEN_HAS_CORNERS
#endif
#include "compensator/model.h"
#ifndef HYSTGEN_CORNERS_STATE_FIXED_H
#define HYSTGEN_CORNERS_STATE_FIXED_H

/* One forward operator: drive in, output out. Plain data, owned by the caller. */
typedef struct {
    hystgen_place_t here;
    int32_t next; /* input of the plays at which another one begins to follow */
    unsigned int status;
    hystgen_kink_t kink; /* of the present step; here rather than on the stack */
    hystgen_corner_t corner[HYSTGEN_CORNERS];
} hystgen_forward_t;

/* One inverse operator: reference in, drive out. Plain data, owned by the caller. */
typedef struct {
    hystgen_place_t here;
    int32_t before; /* input of the plays before the last step, if that was a usual one */
    int32_t next;   /* reference, along the present move, short of which steps are usual */
    hystgen_real_t reference; /* of the last step */
    bool usual;               /* in the last step the same plays followed */
    bool repeat;              /* the last answer still stands for `reference` */
    uint_least8_t bits;       /* status of that answer */
    unsigned int status;
    hystgen_place_t undo; /* where the plays were before the last step, if not a usual one */
    hystgen_kink_t kink;  /* of the present step; here rather than on the stack */
    hystgen_corner_t corner[HYSTGEN_CORNERS];
} hystgen_inverse_t;

#endif
