/* The constants of a model's effects, for steps of HYSTGEN_SAMPLE_TIME, in every arithmetic. */
#ifndef HYSTGEN_CHAIN
#define HYSTGEN_CHAIN
#endif
#include "arithmetic/numbers.h"
#ifndef HYSTGEN_CHAIN_TABLES_H
#define HYSTGEN_CHAIN_TABLES_H

#ifdef HYSTGEN_FIXED
/* A real factor: mantissa / 2^shift. */
typedef struct {
    int32_t mantissa;
    uint8_t shift;
} hystgen_factor_t;

/* A factor of a user's own block, and the low-order bits that a product omits from its argument and
   from its result. */
typedef struct {
    hystgen_factor_t factor;
    uint8_t drop;
    uint8_t lift;
} hystgen_number_t;

/* A state of creep: its contribution at the next sample approaches weight times the input by a
   share `rate` in each step. */
typedef struct {
    hystgen_factor_t rate;
    hystgen_factor_t late; /* share of an input change that takes effect at once */
    hystgen_factor_t weight;
    uint8_t lift; /* bits of a state that the product with `late` leaves out */
} hystgen_creep_term_t;

/* Creep after the plays: y = d h + X_1 + X_2 + ... */
typedef struct {
    const hystgen_creep_term_t *term;
    hystgen_factor_t direct;        /* d */
    hystgen_factor_t inverse_slope; /* 1 / (immediate change in y with h) */
    hystgen_factor_t inverse_rest;  /* h over y at rest */
    uint8_t bits;                   /* bits of the states below those of a signal, */
    uint8_t drop;                   /* and bits that products leave out */
    uint_least16_t n;
} hystgen_creep_table_t;
#else
/* Creep state X, the contribution of past inputs to the next output: X += rate (share h - X). */
typedef struct {
    hystgen_real_t rate;
    hystgen_real_t share;
} hystgen_creep_term_t;

/* Creep after the plays: y = slope h + X_1 + X_2 + ..., with the X of the previous sample. */
typedef struct {
    const hystgen_creep_term_t *term;
    hystgen_real_t slope; /* immediate change in y with h */
    hystgen_real_t inverse_slope;
    hystgen_real_t rest; /* y over h at rest */
    hystgen_real_t inverse_rest;
    uint_least16_t n;
} hystgen_creep_table_t;
#endif

/* Lag before the plays: x += rate (v - x); the output lies theta of that step behind x. */
typedef struct {
    hystgen_factor_t rate;
    hystgen_factor_t theta;
#ifndef HYSTGEN_FIXED
    hystgen_factor_t late;
#endif
    hystgen_factor_t inverse_rate;
#ifdef HYSTGEN_FIXED
    uint8_t bits; /* bits of the states below those of a signal, */
    uint8_t drop; /* and bits that products leave out */
#endif
} hystgen_lag_table_t;

#ifdef HYSTGEN_FIXED
/* Lag shorter than half a step: the output follows a share `late` of a move at once, and approaches
   the input by a share `rate` in the next step. */
#else
/* Lag shorter than half a step: a += early v_before + late v - rate a. */
#endif
typedef struct {
    hystgen_factor_t rate;
#ifndef HYSTGEN_FIXED
    hystgen_factor_t early;
#endif
    hystgen_factor_t late;
    hystgen_factor_t inverse_late;
#ifdef HYSTGEN_FIXED
    uint8_t bits; /* bits of the state below those of a signal, */
    uint8_t drop; /* and bits that products leave out */
#endif
} hystgen_lag_exact_table_t;

/* Mode of the stage. Its two states are output minus input, and the rate of this difference; in a
   step they change by shares of themselves (keep, swing), of each other (turn), and of a change in
   the input (lead, in fixed point late minus the change itself, and push). */
typedef struct {
    hystgen_factor_t keep;
    hystgen_factor_t turn;
    hystgen_factor_t swing;
#ifdef HYSTGEN_FIXED
    hystgen_factor_t late;
#else
    hystgen_factor_t lead;
#endif
    hystgen_factor_t push;
#ifdef HYSTGEN_FIXED
    uint8_t bits; /* bits of the states below those of a signal, */
    uint8_t drop; /* bits that products with states leave out, */
    uint8_t lift; /* and bits that products with a change in the input leave out */
#endif
} hystgen_mode_table_t;

/* Gain and offset per degree above the reference, between two temperatures. */
typedef struct {
    hystgen_factor_t per_degree;
    hystgen_factor_t offset_per_degree;
    hystgen_signal_t reference;
    hystgen_signal_t coldest;
    hystgen_signal_t hottest;
#ifdef HYSTGEN_FIXED
    uint8_t bits; /* of a temperature below a code */
#endif
} hystgen_gain_table_t;

/* A piece of the gain over travel: a cubic in the travelled share of its length. */
typedef struct {
    hystgen_signal_t begin;
    hystgen_factor_t share; /* of the travel since `begin` in the piece, */
#ifdef HYSTGEN_FIXED
    uint8_t drop; /* without the bits that the product leaves out */
#endif
    hystgen_narrow_t c[4];
} hystgen_ageing_piece_t;

/* Gain over travel up to `last`. */
typedef struct {
    const hystgen_ageing_piece_t *piece;
    hystgen_signal_t last;
    uint_least16_t n;
    uint_least8_t turns; /* Newton steps for the reciprocal of a gain that has changed */
#ifdef HYSTGEN_FIXED
    uint8_t bits; /* of a gain below a code that sets it */
#endif
} hystgen_ageing_table_t;

/* Self-heating: degrees gained per amount of heating, the share lost in a step, and the rise up to
   which gain and offset follow. */
typedef struct {
    hystgen_factor_t rate;
    hystgen_factor_t per_amount;
    hystgen_factor_t per_degree;
    hystgen_factor_t offset_per_degree;
    hystgen_signal_t hottest;
    uint_least16_t turns; /* Newton steps for the reciprocal of a gain that has changed */
#ifdef HYSTGEN_FIXED
    uint8_t coarse; /* bits of an amount that its product leaves out, */
    uint8_t lift;   /* bits of the temperature that the same product leaves out, */
    uint8_t drop;   /* and bits that products of the temperature leave out */
#endif
} hystgen_heat_table_t;

/* Friction plays, the smallest threshold first. */
typedef struct {
    hystgen_signal_t threshold;
} hystgen_friction_play_t;

typedef struct {
    const hystgen_friction_play_t *play;
    uint_least16_t n;
#ifdef HYSTGEN_FIXED
    uint8_t bits; /* of a play below a drive code */
#endif
} hystgen_friction_table_t;

#ifdef HYSTGEN_FIXED
/* Drift over time: its change in the first sample, and the growth of this change per sample. */
typedef struct {
    hystgen_signal_t slope;
    hystgen_signal_t change;
    hystgen_signal_t samples; /* after which the drift is constant */
    hystgen_signal_t farthest;
    uint8_t bits; /* bits of slope and change below those of a signal */
} hystgen_clock_table_t;

/* A smooth limit, or its inverse, as a piecewise polynomial. */
typedef struct {
    const int32_t *knot;
    const uint8_t *scale;
    const int32_t *coefficient;
    int32_t least; /* argument */
    int32_t most;
    uint_least16_t pieces;
    uint8_t degree;
    uint8_t drop; /* bits of a signal that an argument leaves out, */
    uint8_t lift; /* and bits that a value leaves out */
} hystgen_bend_curve_t;

/* What bending adds to the value of a play, as a piecewise polynomial of the same form. */
typedef struct {
    const int32_t *knot;
    const uint8_t *scale;
    const int32_t *coefficient;
    uint_least16_t pieces;
} hystgen_bump_t;

typedef struct {
    hystgen_bend_curve_t forward;
    hystgen_bend_curve_t inverse;
} hystgen_bend_t;

/* A piece of the yield of a nonlinear dashpot: its start, the left shift that scales its length to
   2^31, and the coefficients of its cubic, without their lowest `lift` bits. */
typedef struct {
    uint32_t begin;
    int32_t c[4];
    uint8_t scale;
    uint8_t lift;
} hystgen_yield_t;

/* A piece of the curve of elements in parallel with the plays: coefficients of its mean
   slope from its begin on, and of the inverse over the share of its rise. */
typedef struct {
    int64_t begin;
    int64_t level;
    hystgen_factor_t share;
    int32_t up[5];
    int32_t back[5];
    uint8_t scale; /* right shift from a distance to the share of the length in units of 2^-31 */
    uint8_t lift;  /* bits of a value that the product with `share` needs in addition */
} hystgen_piece_t;

/* An element: factors from a move of the input, of at most `far`, to a distance on the curve, and
   from there to the sum, with left shifts of the argument of the first and of the product of the
   second. */
typedef struct {
    hystgen_factor_t distance;
    hystgen_factor_t amplitude;
    int64_t far;
    uint8_t distance_lift;
    uint8_t amplitude_lift;
} hystgen_element_table_t;

/* Stops, and the slope beyond them. */
typedef struct {
    int64_t lower;
    int64_t upper;
    hystgen_factor_t give;
    hystgen_factor_t inverse_give;
} hystgen_stops_t;
#else
/* Drift over time: its rate, and half the change in the rate per second. */
typedef struct {
    hystgen_real_t sample; /* duration in s of one sample, and of `carry` of them */
    hystgen_real_t block;
    hystgen_real_t carry;
    hystgen_real_t rate;
    hystgen_real_t half_change;
    hystgen_real_t farthest;
} hystgen_clock_table_t;
#endif

#endif
