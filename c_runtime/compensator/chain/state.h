/* The memory of a model's effects in floating point. */
#ifndef HYSTGEN_CHAIN
#define HYSTGEN_CHAIN
#endif
#include "arithmetic/numbers.h"
#ifndef HYSTGEN_CHAIN_STATE_H
#define HYSTGEN_CHAIN_STATE_H

/* A drive on its way at a limited rate: as it is sent, and what rounding took from it. */
typedef struct {
    hystgen_reach_t drive;
    hystgen_play_t rest;
} hystgen_ramp_t;

/* A number in two parts, since it grows in steps far below its last bit. */
typedef struct {
    hystgen_real_t high;
    hystgen_real_t low;
} hystgen_creep_state_t;

typedef struct {
    hystgen_real_t ahead; /* output of the next sample for an input of 0 */
} hystgen_creep_t;

typedef struct {
    hystgen_real_t high; /* x, a lag on a drive that holds, in two parts */
    hystgen_real_t low;
    hystgen_real_t wanted; /* output that the last input leads to */
    hystgen_real_t asked;  /* output asked for, */
    hystgen_real_t answer; /* and the input that was to lead there */
} hystgen_lag_t;

typedef struct {
    hystgen_lag_t lag;
    hystgen_real_t earlier; /* asked for a sample before */
} hystgen_braked_t;

typedef struct {
    hystgen_real_t way;   /* of what the lag is led to, in this sample, */
    hystgen_real_t moved; /* and in the one before */
    bool rises;           /* it arrives from below */
} hystgen_steady_t;

typedef struct {
    hystgen_real_t reached;
    hystgen_real_t before; /* input of the last sample */
} hystgen_lag_exact_t;

typedef struct {
    hystgen_real_t arrived; /* in front of the plays */
    hystgen_real_t reference;
    uint32_t equal; /* references in a row, up to one more than a drive waits for to stand still */
} hystgen_quiet_t;

typedef struct {
    hystgen_real_t before; /* input of the last sample */
    hystgen_real_t off;    /* output less input */
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
    bool own; /* the gain follows the travel */
} hystgen_ageing_t;

typedef struct {
    hystgen_real_t high; /* rise of the temperature, in two parts */
    hystgen_real_t low;
    hystgen_real_t gain;
    hystgen_real_t inverse;
    hystgen_real_t offset;
} hystgen_heat_t;

typedef struct {
    hystgen_real_t at; /* a play that rubs */
} hystgen_friction_state_t;

typedef struct {
    bool begun; /* the plays that rub are somewhere */
} hystgen_friction_t;

typedef struct {
    hystgen_real_t high; /* samples, in units of the table's carry and of one */
    hystgen_real_t low;
    hystgen_real_t lead; /* samples by which the next reference is ahead */
} hystgen_clock_t;

/* A search for an input of the plays between two others, at which they have a sum. */
typedef struct {
    hystgen_real_t low;
    hystgen_real_t high;
    hystgen_real_t middle;
    hystgen_real_t sum;
} hystgen_search_t;

#endif
