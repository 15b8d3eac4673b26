/* The constant tables of one model in fixed point. */
#include "arithmetic/fixed.h"
#include "plays/state_fixed.h"
#ifndef HYSTGEN_TABLES_FIXED_H
#define HYSTGEN_TABLES_FIXED_H

#define HYSTGEN_FAR ((int64_t)1 << 62) /* beyond every output */
#define HYSTGEN_LARGEST 2147483647     /* the largest input of the plays */
#define HYSTGEN_MOST_PLAYS 0x7fffu     /* the largest index of a play that a corner can store */

/* Straight segment k, and how far from a turning point it begins, where play k starts to follow. */
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
    int64_t offset;                   /* added to every output */
    int64_t range[2]; /* limits of the input in falling moves, sign changed, and in rising ones */
    uint_least16_t n; /* number of plays, not counting play 0 */
} hystgen_curve_t;

/* The drive of a start memory, within the drive range. */
typedef struct {
    int32_t drive;
    bool ascending;
} hystgen_drive_t;

/* Play operators of engine loop; n + 1 thresholds and weights, n + 2 sums. */
typedef struct {
    const hystgen_play_t *threshold; /* r_0 = 0 .. r_n, in the smallest steps of the plays' input */
    const int32_t *weight;           /* p_0 .. p_n, fractions of an output code per such step */
    const int32_t *slope;            /* slope[k] = p_0 + ... + p_(k-1) */
    const uint32_t *reciprocal;      /* 2^(32 + shift[k]) / slope[k]; entry 0 is not used */
    const uint8_t *shift;
    hystgen_reach_t least; /* limits of the input in a solution */
    hystgen_reach_t most;
    uint_least16_t n; /* number of plays, not counting r_0 */
} hystgen_tables_t;

/* Ends of one branch of the inverse from the input of the plays to the drive. */
typedef struct {
    int64_t envelope_least; /* limits of the input of the plays that an envelope can reach */
    int64_t envelope_most;
    hystgen_reach_t least; /* inputs between these and first .. last are out by rounding only */
    hystgen_reach_t most;
    int32_t first; /* inputs of the plays at the ends of the drive range */
    int32_t last;
} hystgen_ends_t;

#endif
