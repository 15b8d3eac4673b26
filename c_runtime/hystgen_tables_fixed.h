/* The constant tables of one model in fixed point. */
#ifndef HYSTGEN_TABLES_FIXED_H
#define HYSTGEN_TABLES_FIXED_H

/* Play operators; n + 1 thresholds and weights, n + 2 sums. */
typedef struct {
    const hystgen_play_t *threshold;  /* r_0 = 0 .. r_n, in least steps of the input of the plays */
    const int32_t *weight;            /* p_0 .. p_n, parts of an output code per such step */
    const int32_t *slope;             /* slope[k] = p_0 + ... + p_(k-1) */
    const hystgen_sum_t *lift;        /* lift[k] = p_0 r_0 + ... + p_(k-1) r_(k-1) */
    const hystgen_sum_t *start_level; /* output gained by the time play k starts to follow: z_0 .. z_n */
    const uint32_t *reciprocal;       /* 2^(32 + shift[k]) / slope[k]; entry 0 is not used */
    const uint8_t *shift;
    hystgen_reach_t least, most;      /* no input of the plays is asked for beyond these */
    uint_least16_t n;                 /* plays without r_0 */
} hystgen_tables_t;

/* A function of whole numbers as polynomials on pieces: c_0 + c_1 h + c_2 h^2 + ..., h = 0 .. 1 along a piece. */
typedef struct {
    const int32_t *knot;         /* where the pieces begin, rising */
    const uint8_t *scale;        /* left shift that stretches a piece to 2^31 */
    const int32_t *coefficient;  /* from degree 0, piece after piece */
    uint_least16_t pieces;
    uint_least8_t degree;
} hystgen_curve_t;

/* The way back from the input of the plays to the drive, one branch. */
typedef struct {
    hystgen_curve_t curve;
    int32_t first, last;            /* arguments that the curve covers */
    hystgen_reach_t least, most;    /* up to here an argument beyond them is no more than rounding */
    int64_t envelope_least, envelope_most; /* arguments that an envelope can take */
    uint8_t below;                  /* values are parts of 2^-below drive codes */
} hystgen_back_t;

#endif
