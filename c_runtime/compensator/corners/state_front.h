/* The memory of operators with a memoryless part, in floating point. */
#ifndef HYSTGEN_CONFIGURED
#define HYSTGEN_HAS_CORNERS
#define HYSTGEN_HAS_FRONT
#endif
#include "compensator/model.h"
#ifndef HYSTGEN_CORNERS_STATE_FRONT_H
#define HYSTGEN_CORNERS_STATE_FRONT_H

/* One forward operator: drive in, output out. Plain data, owned by the caller. */
typedef struct {
    hystgen_plays_t plays;
    hystgen_real_t drive; /* of the last step */
    bool ascending;       /* direction of the drive's last move */
    unsigned int status;
    hystgen_corner_t corner[HYSTGEN_CORNERS];
} hystgen_forward_t;

/* One inverse operator: reference in, drive out. Plain data, owned by the caller. */
typedef struct {
    hystgen_plays_t plays;
    hystgen_place_t undo; /* where the plays were before the last step */
    hystgen_real_t drive; /* where the plays are */
    hystgen_real_t undo_drive;
    hystgen_real_t returned;  /* by the last step, if another drive was committed since */
    hystgen_real_t reference; /* of the last step */
    hystgen_real_t last;      /* the same, limited: the next reference moves up or down from here */
    bool ascending;           /* direction of the drive's last move */
    bool undo_ascending;
    bool stepped;      /* a step has answered */
    bool committed;    /* a drive was committed since */
    bool repeat;       /* the last answer still stands for `reference` */
    bool limited;      /* no drive gives it; here rather than on the stack */
    unsigned int bits; /* status of that answer */
    unsigned int status;
    hystgen_corner_t corner[HYSTGEN_CORNERS];
} hystgen_inverse_t;

#endif
