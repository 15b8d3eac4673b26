/* Memory of the corner engine's operators for models without effects. Emission omits fields that no
   function of a model uses. Needed by the operators in this folder. */
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
    int32_t next; /* input at which another play begins to follow */
#else
    hystgen_plays_t plays;
#endif
    hystgen_real_t drive; /* of the last step */
    bool ascending;       /* direction of the drive's last move */
    unsigned int status;
#ifdef HYSTGEN_FIXED
    hystgen_kink_t kink; /* of the present step; kept here rather than on the stack */
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
    hystgen_place_t undo; /* position of the plays before the last step */
#endif
    hystgen_real_t drive; /* present drive */
    hystgen_real_t undo_drive;
#ifndef HYSTGEN_FIXED
    hystgen_real_t returned; /* the last step's drive, if another was committed since */
#endif
    hystgen_real_t reference; /* of the last step */
    hystgen_real_t last;      /* `reference`, limited: the next one moves up or down from here */
    bool ascending;           /* direction of the drive's last move */
    bool undo_ascending;
#ifndef HYSTGEN_FIXED
    bool stepped;   /* a step has returned a drive */
    bool committed; /* a drive was committed since */
#endif
    bool repeated;  /* the last returned drive is still valid for `reference` */
    bool unreached; /* no drive reaches `reference`; kept here rather than on the stack */
#ifdef HYSTGEN_FIXED
    uint_least8_t bits; /* status of the last returned drive */
#else
    unsigned int bits; /* status of the last returned drive */
#endif
    unsigned int status;
#ifdef HYSTGEN_FIXED
    hystgen_place_t undo; /* position of the plays before the last step */
    hystgen_kink_t kink;  /* of the present step; kept here rather than on the stack */
#endif
    hystgen_corner_t corner[HYSTGEN_CORNERS];
} hystgen_inverse_t;
#elif defined(HYSTGEN_FIXED)
/* One inverse operator: reference in, drive out. Plain data, owned by the caller. */
typedef struct {
    hystgen_place_t here;
    hystgen_real_t drive;
    int32_t before;           /* input of the plays before the last step, if that was usual */
    int32_t next;             /* reference, along the present move, below which steps are usual */
    hystgen_real_t reference; /* of the last step */
    bool usual;               /* in the last step the same plays followed */
    bool repeated;            /* the last returned drive is still valid for `reference` */
    uint_least8_t bits;       /* status of the last returned drive */
    unsigned int status;
    hystgen_place_t undo; /* position of the plays before the last step, if not a usual one */
    hystgen_kink_t kink;  /* of the present step; kept here rather than on the stack */
    hystgen_corner_t corner[HYSTGEN_CORNERS];
} hystgen_inverse_t;
#else
/* One inverse operator: reference in, drive out. Plain data, owned by the caller. */
typedef struct {
    hystgen_plays_t plays;
    hystgen_real_t drive;
    hystgen_place_t undo;    /* position of the plays before the last step, if not along a line */
    hystgen_real_t before;   /* input before a step along a line, else the present input */
    hystgen_real_t returned; /* the last step's drive, if another was committed since */
    bool stepped;            /* a step has returned a drive */
    bool committed;          /* a drive was committed since */
    unsigned int status;
    hystgen_corner_t corner[HYSTGEN_CORNERS];
} hystgen_inverse_t;
#endif

#endif
