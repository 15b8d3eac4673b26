/* The memory of operators of engine corners without effects. Emission leaves out fields that no
   function of a model names. Needed by the operators beside it. */
#ifndef HYSTGEN_CONFIGURED
#define HYSTGEN_HAS_CORNERS
#endif
#include "compensator/model.h"
#ifndef HYSTGEN_CORNERS_STATE_H
#define HYSTGEN_CORNERS_STATE_H

/* One forward operator: drive in, output out. Plain data, owned by the caller. */
typedef struct {
#ifdef HYSTGEN_FIXED
    hystgen_place_t here;
    int32_t next; /* input of the plays at which another one begins to follow */
#else
    hystgen_plays_t plays;
#endif
    hystgen_real_t drive; /* of the last step */
    bool ascending;       /* direction of the drive's last move */
    unsigned int status;
#ifdef HYSTGEN_FIXED
    hystgen_kink_t kink; /* of the present step; here rather than on the stack */
#endif
    hystgen_corner_t corner[HYSTGEN_CORNERS];
} hystgen_forward_t;

#ifdef HYSTGEN_HAS_FRONT
/* One inverse operator: reference in, drive out. Plain data, owned by the caller. */
typedef struct {
#ifdef HYSTGEN_FIXED
    hystgen_place_t here;
    int64_t next; /* output, along the present move, at which another play begins to follow */
#else
    hystgen_plays_t plays;
    hystgen_place_t undo; /* where the plays were before the last step */
#endif
    hystgen_real_t drive; /* where the plays are */
    hystgen_real_t undo_drive;
#ifndef HYSTGEN_FIXED
    hystgen_real_t returned; /* by the last step, if another drive was committed since */
#endif
    hystgen_real_t reference; /* of the last step */
    hystgen_real_t last;      /* the same, limited: the next reference moves up or down from here */
    bool ascending;           /* direction of the drive's last move */
    bool undo_ascending;
#ifndef HYSTGEN_FIXED
    bool stepped;   /* a step has answered */
    bool committed; /* a drive was committed since */
#endif
    bool repeated; /* the last answer still stands for `reference` */
    bool limited;  /* no drive gives it; here rather than on the stack */
#ifdef HYSTGEN_FIXED
    uint_least8_t bits; /* status of that answer */
#else
    unsigned int bits; /* status of that answer */
#endif
    unsigned int status;
#ifdef HYSTGEN_FIXED
    hystgen_place_t undo; /* where the plays were before the last step */
    hystgen_kink_t kink;  /* of the present step; here rather than on the stack */
#endif
    hystgen_corner_t corner[HYSTGEN_CORNERS];
} hystgen_inverse_t;
#elif defined(HYSTGEN_FIXED)
/* One inverse operator: reference in, drive out. Plain data, owned by the caller. */
typedef struct {
    hystgen_place_t here;
    hystgen_real_t drive;
    int32_t before; /* input of the plays before the last step, if that was a usual one */
    int32_t next;   /* reference, along the present move, short of which steps are usual */
    hystgen_real_t reference; /* of the last step */
    bool usual;               /* in the last step the same plays followed */
    bool repeated;            /* the last answer still stands for `reference` */
    uint_least8_t bits;       /* status of that answer */
    unsigned int status;
    hystgen_place_t undo; /* where the plays were before the last step, if not a usual one */
    hystgen_kink_t kink;  /* of the present step; here rather than on the stack */
    hystgen_corner_t corner[HYSTGEN_CORNERS];
} hystgen_inverse_t;
#else
/* One inverse operator: reference in, drive out. Plain data, owned by the caller. */
typedef struct {
    hystgen_plays_t plays;
    hystgen_real_t drive;
    hystgen_place_t undo;    /* where the plays were before the last step, if not along a line */
    hystgen_real_t before;   /* input before such a step, else the present one */
    hystgen_real_t returned; /* by the last step, if another drive was committed since */
    bool stepped;            /* a step has answered */
    bool committed;          /* a drive was committed since */
    unsigned int status;
    hystgen_corner_t corner[HYSTGEN_CORNERS];
} hystgen_inverse_t;
#endif

#endif
