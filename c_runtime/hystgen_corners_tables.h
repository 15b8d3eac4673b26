#ifndef HYSTGEN_CORNERS_TABLES_H
#define HYSTGEN_CORNERS_TABLES_H

/* Play k begins to follow this far from a turning point; the curve is straight up to the next. */
typedef struct {
    hystgen_real_t way;   /* of the input: 2 r_k if that is the drive, 2 z_k if it is the output */
    hystgen_real_t reach; /* of the output: the other of the two */
    hystgen_real_t gain;  /* of the output over the input from there on */
    hystgen_real_t slope; /* 1 / gain */
} hystgen_segment_t;

/* One operator; of two entries one is for falling moves, with signs changed, one for rising ones.
 */
typedef struct {
    const hystgen_segment_t *segment; /* plays 0 .. n, and one that never follows */
    hystgen_real_t limit[2];          /* of the output */
    hystgen_real_t inside[2]; /* outputs up to here stay within the limit in spite of rounding */
    hystgen_real_t range[2];  /* of the input */
} hystgen_curve_t;

/* A start memory. `center`: input and output of the sum if plays 0 .. k hold what play k holds. */
typedef struct {
    const hystgen_real_t (*center)[2];
    uint_least16_t step;  /* 1: a center for each play, 0: one for all, if all hold the same */
    uint_least16_t risen; /* plays up to this one are left by rising moves, the others by falling */
    hystgen_corner_t bottom; /* plays from its `top` on cannot move within the range */
} hystgen_start_t;

/* The drive that a start memory stands for, within its range, and the input of the plays there. */
typedef struct {
    hystgen_real_t drive;
    hystgen_real_t w;
    bool ascending;
} hystgen_drive_t;

#endif
