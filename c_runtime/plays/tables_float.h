/* The constant tables of one model in floating point. */
#include "plays/state_float.h"
#ifndef HYSTGEN_TABLES_FLOAT_H
#define HYSTGEN_TABLES_FLOAT_H

/* Straight segment k, and how far from a turning point it begins, where play k starts to follow. */
typedef struct {
    hystgen_real_t way;   /* of the input: 2 r_k in the forward operator, 2 z_k in the inverse */
    hystgen_real_t reach; /* of the output: 2 z_k in the forward operator, 2 r_k in the inverse */
    hystgen_real_t gain;  /* of the output over the input from there on */
    hystgen_real_t slope; /* 1 / gain */
} hystgen_segment_t;

/* One operator; of a pair of entries, the first is for falling moves, with its sign changed, the
   second for rising ones. */
typedef struct {
    const hystgen_segment_t *segment; /* plays 0 .. n, and one that never follows */
    hystgen_real_t limit[2];          /* of the output */
    hystgen_real_t inside[2]; /* outputs up to these stay within the limit despite rounding */
    hystgen_real_t range[2];  /* of the input */
} hystgen_curve_t;

/* A start memory. `center`: input and output of the sum with plays 0 .. k at play k's value. */
typedef struct {
    const hystgen_real_t (*center)[2];
    uint_least16_t step;     /* 1: a center for each play; 0: one for all, which start alike */
    uint_least16_t risen;    /* plays up to this one were left by rising moves, others by falling */
    hystgen_corner_t bottom; /* plays from its `top` on cannot move within the range */
} hystgen_start_t;

/* The drive of a start memory, within the drive range, and the input of the plays at this drive. */
typedef struct {
    hystgen_real_t drive;
    hystgen_real_t w;
    bool ascending;
} hystgen_drive_t;

/* Play operators of engine loop; n + 1 thresholds and weights, n + 2 sums. */
typedef struct {
    const hystgen_real_t *threshold;     /* r_0 = 0 .. r_n */
    const hystgen_real_t *weight;        /* p_0 .. p_n */
    const hystgen_real_t *lift;          /* lift[k] = p_0 r_0 + ... + p_(k-1) r_(k-1) */
    const hystgen_real_t *inverse_slope; /* 1 / (p_0 + ... + p_(k-1)); entry 0 is not used */
    uint_least16_t n;                    /* number of plays, not counting r_0 */
} hystgen_tables_t;

/* Hyperbolic tangent envelope a0 tanh(a1 x + a2) + a3, one branch. */
typedef struct {
    hystgen_real_t a0;
    hystgen_real_t a1;
    hystgen_real_t a2;
    hystgen_real_t a3;
    hystgen_real_t inverse_a0;
    hystgen_real_t inverse_a1;
    hystgen_real_t limit; /* largest |argument| of atanh */
} hystgen_envelope_t;

/* Dead-zone sum as straight pieces, piece j between break points j-1 and j. */
typedef struct {
    const hystgen_real_t *break_x; /* n break points, ascending */
    const hystgen_real_t *break_y;
    const hystgen_real_t *anchor_x; /* n + 1 pieces, each through its anchor */
    const hystgen_real_t *anchor_y;
    const hystgen_real_t *slope;
    const hystgen_real_t *inverse_slope;
    uint_least16_t n;
} hystgen_dead_zone_t;

#endif
