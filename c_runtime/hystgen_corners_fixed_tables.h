#ifndef HYSTGEN_CORNERS_FIXED_TABLES_H
#define HYSTGEN_CORNERS_FIXED_TABLES_H

#define HYSTGEN_FAR ((int64_t)1 << 62) /* beyond every output */
#define HYSTGEN_LARGEST 2147483647     /* the largest input of the plays */
#define HYSTGEN_MOST_PLAYS 0x7fffu     /* the largest number of plays that a corner can name */

/* Play k begins to follow this far from a turning point; the curve is straight from there to where
   the next play does. */
typedef struct {
    int64_t reach;       /* of the output: 2 z_k */
    uint32_t way;        /* of the input: 2 r_k */
    uint32_t slope;      /* of the output over the input from there on: p_0 + ... + p_k */
    uint32_t reciprocal; /* 2^(32 + shift) / slope */
    uint8_t shift;
} hystgen_segment_t;

/* The plays of one model. */
typedef struct {
    const hystgen_segment_t *segment; /* plays 0 .. n, and one that never follows */
    int64_t offset;                   /* part of every output */
    int64_t range[2]; /* inputs at the end of falling moves, sign changed, and of rising ones */
    uint_least16_t n; /* plays without play 0 */
} hystgen_curve_t;

/* The drive that a start memory stands for, within its range. */
typedef struct {
    int32_t drive;
    bool ascending;
} hystgen_drive_t;

#endif
