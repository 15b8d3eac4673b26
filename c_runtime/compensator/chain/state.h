/* The memory of a model's effects in floating point. */
#ifndef HYSTGEN_CHAIN
#define HYSTGEN_CHAIN
#endif
#include "arithmetic/numbers.h"
#ifndef HYSTGEN_CHAIN_STATE_H
#define HYSTGEN_CHAIN_STATE_H

/* A rate-limited drive: the value sent, and its rounding remainder. */
typedef struct {
    hystgen_reach_t drive;
    hystgen_play_t rest;
} hystgen_ramp_t;

/* A number in two parts, since its steps may be far smaller than its last bit. */
typedef struct {
    hystgen_real_t high;
    hystgen_real_t low;
} hystgen_creep_state_t;

typedef struct {
    hystgen_real_t ahead; /* output of the next sample for an input of 0 */
} hystgen_creep_t;

typedef struct {
    hystgen_real_t high; /* x, the response to a zero-order-hold drive, in two parts */
    hystgen_real_t low;
    hystgen_real_t wanted; /* output for the last input */
    hystgen_real_t asked;  /* requested output, */
    hystgen_real_t answer; /* and the input solved for it */
} hystgen_lag_t;

typedef struct {
    hystgen_lag_t lag;
    hystgen_real_t earlier; /* output requested one sample before */
} hystgen_braked_t;

typedef struct {
    hystgen_real_t way;   /* move of the lag's target in this sample, */
    hystgen_real_t moved; /* and in the previous one */
    bool rises;           /* the lag arrives from below */
} hystgen_steady_t;

typedef struct {
    hystgen_real_t reached;
    hystgen_real_t before; /* input of the last sample */
} hystgen_lag_exact_t;

typedef struct {
    hystgen_real_t arrived; /* last output of the drive side */
    hystgen_real_t reference;
    uint32_t equal; /* equal references in a row, at most one more than needed to stand still */
} hystgen_quiet_t;

typedef struct {
    hystgen_real_t before; /* input of the last sample */
    hystgen_real_t off;    /* output minus input */
    hystgen_real_t rate;   /* of `off`, per radian of the mode */
} hystgen_mode_t;

typedef struct {
    hystgen_real_t gain;
    hystgen_real_t inverse;
    hystgen_real_t offset;
} hystgen_gain_t;

typedef struct {
    hystgen_real_t high; /* travel, in two parts */
    hystgen_real_t low;
    hystgen_real_t gain;
    hystgen_real_t inverse;
    bool own; /* the gain depends on the travel */
} hystgen_ageing_t;

typedef struct {
    hystgen_real_t high; /* rise of the temperature, in two parts */
    hystgen_real_t low;
    hystgen_real_t gain;
    hystgen_real_t inverse;
    hystgen_real_t offset;
} hystgen_heat_t;

typedef struct {
    hystgen_real_t at; /* value of a friction play */
} hystgen_friction_state_t;

typedef struct {
    bool begun; /* the friction plays have values */
} hystgen_friction_t;

typedef struct {
    hystgen_real_t high; /* samples counted: multiples of the table's carry, and the rest */
    hystgen_real_t low;
    hystgen_real_t lead; /* samples by which the next reference is ahead */
} hystgen_clock_t;

/* An input of the plays that a search has tried. */
typedef struct {
    hystgen_real_t low; /* the solution lies between these */
    hystgen_real_t high;
    hystgen_real_t input;
    hystgen_real_t asked; /* sum of the plays that the solution has */
    hystgen_real_t sum;   /* their sum at the input tried, */
    hystgen_real_t slope; /* its change per change of the input, */
    hystgen_real_t steady; /* and that in steady motion, in which plays follow in full; */
    hystgen_real_t reached; /* value that one of them reaches there, */
    hystgen_real_t share; /* and its share of a further change of the input */
} hystgen_attempt_t;

/* What a search for the input of the plays begins with. */
typedef struct {
    hystgen_real_t slope; /* change of their sum per change of their input, in steady motion */
} hystgen_search_t;

#endif
