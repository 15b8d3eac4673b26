/* The constant tables of the corner engine, in floating point. */
#ifndef HYSTGEN_CORNERS_TABLES_H
#define HYSTGEN_CORNERS_TABLES_H

/* Play k begins to follow when a move has come this far from its turning point; until play k + 1 does, outputs lie on a
   line. The ways are 2 r_k of the drive and 2 z_k of the output. */
typedef struct {
    hystgen_real_t way;      /* of the input */
    hystgen_real_t reach;    /* of the output */
    hystgen_real_t gain;     /* of the output over the input from there on */
    hystgen_real_t slope;    /* 1 / gain */
} hystgen_segment_t;

/* One operator; [0] is for falling moves, with signs changed, [1] for rising ones. */
typedef struct {
    const hystgen_segment_t *segment; /* plays 0 .. n, and one that never follows */
    hystgen_real_t limit[2];          /* of the output */
    hystgen_real_t inside[2];         /* outputs up to here stay within the limit whatever rounding does */
    hystgen_real_t range[2];          /* of the input */
} hystgen_curve_t;

/* A start memory. Plays below the last corner's block are at rest at `output`. */
typedef struct {
    const hystgen_corner_t *corner;   /* largest plays first; those from the first one's `top` on cannot move */
    uint_least16_t depth;
    hystgen_real_t input;
    hystgen_real_t output;
} hystgen_start_t;

/* The drive that a start memory stands for, within its range, and the input of the plays there. */
typedef struct {
    hystgen_real_t drive;
    hystgen_real_t w;
    bool ascending;
} hystgen_drive_t;

#endif
