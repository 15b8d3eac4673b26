/* The memory of operators with a memoryless part, in fixed point. */
#include "arithmetic/fixed.h"
#ifndef HYSTGEN_CONFIGURED
#define HYSTGEN_HAS_CORNERS
#define HYSTGEN_HAS_FRONT
#endif
#include "compensator/model.h"
#ifndef HYSTGEN_CORNERS_STATE_FRONT_FIXED_H
#define HYSTGEN_CORNERS_STATE_FRONT_FIXED_H

/* One forward operator: drive in, output out. Plain data, owned by the caller. */
typedef struct {
    hystgen_place_t here;
    int32_t next;         /* input of the plays at which another one begins to follow */
    hystgen_real_t drive; /* of the last step */
    bool ascending;       /* direction of the drive's last move */
    unsigned int status;
    hystgen_kink_t kink; /* of the present step; here rather than on the stack */
    hystgen_corner_t corner[HYSTGEN_CORNERS];
} hystgen_forward_t;

/* One inverse operator: reference in, drive out. Plain data, owned by the caller. */
typedef struct {
    hystgen_place_t here;
    int64_t next; /* output, along the present move, at which another play begins to follow */
    hystgen_real_t drive; /* where the plays are */
    hystgen_real_t undo_drive;
    hystgen_real_t reference; /* of the last step */
    hystgen_real_t last;      /* the same, limited: the next reference moves up or down from here */
    bool ascending;           /* direction of the drive's last move */
    bool undo_ascending;
    bool repeat;        /* the last answer still stands for `reference` */
    bool limited;       /* no drive gives it; here rather than on the stack */
    uint_least8_t bits; /* status of that answer */
    unsigned int status;
    hystgen_place_t undo; /* where the plays were before the last step */
    hystgen_kink_t kink;  /* of the present step; here rather than on the stack */
    hystgen_corner_t corner[HYSTGEN_CORNERS];
} hystgen_inverse_t;

#endif
