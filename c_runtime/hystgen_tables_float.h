/* The constant tables of one model in floating point. */
#ifndef HYSTGEN_TABLES_FLOAT_H
#define HYSTGEN_TABLES_FLOAT_H

/* Play operators of engine loop; n + 1 thresholds and weights, n + 2 sums. */
typedef struct {
    const hystgen_real_t *threshold;     /* r_0 = 0 .. r_n */
    const hystgen_real_t *weight;        /* p_0 .. p_n */
    const hystgen_real_t *lift;          /* lift[k] = p_0 r_0 + ... + p_(k-1) r_(k-1) */
    const hystgen_real_t *inverse_slope; /* 1 / (p_0 + ... + p_(k-1)); entry 0 is not used */
    uint_least16_t n;                    /* plays without r_0 */
} hystgen_tables_t;

/* Hyperbolic tangent envelope a0 tanh(a1 x + a2) + a3, one branch. */
typedef struct {
    hystgen_real_t a0;
    hystgen_real_t a1;
    hystgen_real_t a2;
    hystgen_real_t a3;
    hystgen_real_t inverse_a0;
    hystgen_real_t inverse_a1;
    hystgen_real_t limit; /* largest |argument| that atanh is given */
} hystgen_envelope_t;

/* Dead-zone sum as straight pieces, piece j between break points j-1 and j. */
typedef struct {
    const hystgen_real_t *break_x; /* n break points, rising */
    const hystgen_real_t *break_y;
    const hystgen_real_t *anchor_x; /* n + 1 pieces, each through its anchor */
    const hystgen_real_t *anchor_y;
    const hystgen_real_t *slope;
    const hystgen_real_t *inverse_slope;
    uint_least16_t n;
} hystgen_dead_zone_t;

#endif
