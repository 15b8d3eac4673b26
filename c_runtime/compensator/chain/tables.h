/* The constants of a model's effects in floating point, for steps of HYSTGEN_SAMPLE_TIME. */
#ifndef HYSTGEN_CHAIN
#define HYSTGEN_CHAIN
#endif
#include "arithmetic/numbers.h"
#ifndef HYSTGEN_CHAIN_TABLES_H
#define HYSTGEN_CHAIN_TABLES_H

/* Creep state X, the contribution of past inputs to the next output: X += rate (share h - X). */
typedef struct {
    hystgen_real_t rate;
    hystgen_real_t share;
} hystgen_creep_term_t;

/* Creep after the plays: y = slope h + X_1 + X_2 + ..., with the X of the previous sample. */
typedef struct {
    const hystgen_creep_term_t *term;
    hystgen_real_t slope; /* immediate change of y with h */
    hystgen_real_t inverse_slope;
    hystgen_real_t rest; /* y over h at rest */
    hystgen_real_t inverse_rest;
    uint_least16_t n;
} hystgen_creep_table_t;

/* Lag before the plays: x += rate (v - x); the output lies theta of that step behind x. */
typedef struct {
    hystgen_real_t rate;
    hystgen_real_t theta;
    hystgen_real_t late;
    hystgen_real_t inverse_rate;
} hystgen_lag_table_t;

/* Lag shorter than half a step: a += early v_before + late v - rate a. */
typedef struct {
    hystgen_real_t rate;
    hystgen_real_t early;
    hystgen_real_t late;
    hystgen_real_t inverse_late;
} hystgen_lag_exact_table_t;

/* Mode of the stage. Its two states are output minus input, and the rate of this difference; in a
   step they change by shares of themselves (keep, swing), of each other (turn), and of a change of
   the input (lead, push). */
typedef struct {
    hystgen_real_t keep;
    hystgen_real_t turn;
    hystgen_real_t swing;
    hystgen_real_t lead;
    hystgen_real_t push;
} hystgen_mode_table_t;

/* Gain and offset per degree above the reference, between two temperatures. */
typedef struct {
    hystgen_real_t per_degree;
    hystgen_real_t offset_per_degree;
    hystgen_real_t reference;
    hystgen_real_t coldest;
    hystgen_real_t hottest;
    hystgen_real_t least;
    hystgen_real_t largest;
} hystgen_gain_table_t;

/* A piece of the gain over travel: a cubic in the travelled share of its length. */
typedef struct {
    hystgen_real_t begin;
    hystgen_real_t inverse_length;
    hystgen_real_t c0;
    hystgen_real_t c1;
    hystgen_real_t c2;
    hystgen_real_t c3;
} hystgen_ageing_piece_t;

/* Gain over travel up to `last`; a gain set from outside lies between `least` and `largest`. */
typedef struct {
    const hystgen_ageing_piece_t *piece;
    hystgen_real_t least;
    hystgen_real_t largest;
    hystgen_real_t last;
    uint_least16_t n;
    uint_least8_t turns; /* Newton steps for the reciprocal of a gain that has changed */
} hystgen_ageing_table_t;

/* Self-heating: degrees per amount of heating, and the share lost in a step. */
typedef struct {
    hystgen_real_t rate;
    hystgen_real_t per_amount;
    hystgen_real_t per_degree;
    hystgen_real_t offset_per_degree;
    hystgen_real_t hottest; /* rise up to which gain and offset follow */
    uint_least16_t turns;   /* Newton steps for the reciprocal of a gain that has changed */
} hystgen_heat_table_t;

/* Friction plays, the smallest threshold first. */
typedef struct {
    hystgen_real_t threshold;
} hystgen_friction_play_t;

typedef struct {
    const hystgen_friction_play_t *play;
    uint_least16_t n;
} hystgen_friction_table_t;

/* Drift over time: its rate, and half the change of the rate per second. */
typedef struct {
    hystgen_real_t sample; /* duration in s of one sample, and of `carry` of them */
    hystgen_real_t block;
    hystgen_real_t carry;
    hystgen_real_t rate;
    hystgen_real_t half_change;
    hystgen_real_t farthest;
} hystgen_clock_table_t;

#endif
