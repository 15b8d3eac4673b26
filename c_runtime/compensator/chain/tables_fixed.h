/* The constants of a model's effects in fixed point, for steps of HYSTGEN_SAMPLE_TIME. */
#include "arithmetic/fixed.h"
#ifndef HYSTGEN_CHAIN
#define HYSTGEN_CHAIN
#endif
#include "arithmetic/numbers.h"
#ifndef HYSTGEN_CHAIN_TABLES_FIXED_H
#define HYSTGEN_CHAIN_TABLES_FIXED_H

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

/* A state of creep: its contribution at the next sample approaches weight times the input by `rate`
   in each step. */
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
    hystgen_factor_t inverse_slope; /* 1 / (immediate change of y with h) */
    hystgen_factor_t inverse_rest;  /* h over y at rest */
    uint8_t bits;                   /* bits of the states below those of a signal, */
    uint8_t drop;                   /* and bits that products leave out */
    uint_least16_t n;
} hystgen_creep_table_t;

/* Lag before the plays: x += rate (v - x); the output lies theta of that step behind x. */
typedef struct {
    hystgen_factor_t rate;
    hystgen_factor_t theta;
    hystgen_factor_t inverse_rate;
    uint8_t bits; /* bits of the states below those of a signal, */
    uint8_t drop; /* and bits that products leave out */
} hystgen_lag_table_t;

/* Lag shorter than half a step: the output follows a share `late` of a move at once, and approaches
   the input by a share `rate` in the next step. */
typedef struct {
    hystgen_factor_t rate;
    hystgen_factor_t late;
    hystgen_factor_t inverse_late;
    uint8_t bits; /* bits of the state below those of a signal, */
    uint8_t drop; /* and bits that products leave out */
} hystgen_lag_exact_table_t;

/* Mode of the stage. Its two states are output minus input, and the rate of this difference; in a
   step they change by shares of themselves (keep, swing), of each other (turn), and of a change of
   the input (late, minus the change itself, and push). */
typedef struct {
    hystgen_factor_t keep;
    hystgen_factor_t turn;
    hystgen_factor_t swing;
    hystgen_factor_t late;
    hystgen_factor_t push;
    uint8_t bits; /* bits of the states below those of a signal, */
    uint8_t drop; /* bits that products with states leave out, */
    uint8_t lift; /* and bits that products with a change of the input leave out */
} hystgen_mode_table_t;

/* Gain and offset per degree above the reference, between two temperatures. */
typedef struct {
    hystgen_factor_t per_degree;
    hystgen_factor_t offset_per_degree;
    int64_t reference;
    int64_t coldest;
    int64_t hottest;
    uint8_t bits; /* of a temperature below a code */
} hystgen_gain_table_t;

/* A piece of the gain over travel: a cubic in the travelled share of its length. */
typedef struct {
    int64_t begin;
    hystgen_factor_t
        share; /* of the travel since `begin`, minus the bits that the product leaves out */
    uint8_t drop;
    int32_t c[4];
} hystgen_ageing_piece_t;

/* Gain over travel up to `last`. */
typedef struct {
    const hystgen_ageing_piece_t *piece;
    int64_t last;
    uint_least16_t n;
    uint8_t turns; /* Newton steps for the reciprocal of a gain that has changed */
    uint8_t bits;  /* of a gain below a code that sets it */
} hystgen_ageing_table_t;

/* Self-heating: degrees gained per amount of heating, the share lost in a step, and the rise up to
   which gain and offset follow. */
typedef struct {
    hystgen_factor_t rate;
    hystgen_factor_t per_amount;
    hystgen_factor_t per_degree;
    hystgen_factor_t offset_per_degree;
    int64_t hottest;
    uint_least16_t turns; /* Newton steps for the reciprocal of a gain that has changed */
    uint8_t coarse;       /* bits of an amount that its product leaves out, */
    uint8_t lift;         /* bits of the temperature that the same product leaves out, */
    uint8_t drop;         /* and bits that products of the temperature leave out */
} hystgen_heat_table_t;

/* Friction plays, the smallest threshold first. */
typedef struct {
    int64_t threshold;
} hystgen_friction_play_t;

typedef struct {
    const hystgen_friction_play_t *play;
    uint_least16_t n;
    uint8_t bits; /* of a play below a drive code */
} hystgen_friction_table_t;

/* Drift over time: its change in the first sample, and the growth of this change per sample. */
typedef struct {
    int64_t slope;
    int64_t change;
    int64_t samples; /* after which the drift is constant */
    int64_t farthest;
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

/* Stops, and the slope beyond them. */
typedef struct {
    int64_t lower;
    int64_t upper;
    hystgen_factor_t give;
    hystgen_factor_t inverse_give;
} hystgen_stops_t;

#endif
