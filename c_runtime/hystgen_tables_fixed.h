/* The constant tables of one model in fixed point. */
#ifndef HYSTGEN_TABLES_FIXED_H
#define HYSTGEN_TABLES_FIXED_H

/* Play operators of engine loop; n + 1 thresholds and weights, n + 2 sums. */
typedef struct {
    const hystgen_play_t *threshold; /* r_0 = 0 .. r_n, in least steps of the input of the plays */
    const int32_t *weight;           /* p_0 .. p_n, fractions of an output code per such step */
    const int32_t *slope;            /* slope[k] = p_0 + ... + p_(k-1) */
    const uint32_t *reciprocal;      /* 2^(32 + shift[k]) / slope[k]; entry 0 is not used */
    const uint8_t *shift;
    hystgen_reach_t least; /* inputs of the plays to look for lie between these */
    hystgen_reach_t most;
    uint_least16_t n; /* plays without r_0 */
} hystgen_tables_t;

/* Ends of one branch of the inverse from the input of the plays to the drive. */
typedef struct {
    int64_t envelope_least; /* inputs of the plays that an envelope can give */
    int64_t envelope_most;
    hystgen_reach_t least; /* up to here an input outside first .. last is off by rounding only */
    hystgen_reach_t most;
    int32_t first; /* inputs of the plays that the drive range gives */
    int32_t last;
} hystgen_ends_t;

#endif
