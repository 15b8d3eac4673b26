/* The memory of a model's effects in fixed point. */
#include "arithmetic/fixed.h"
#ifndef HYSTGEN_CHAIN
#define HYSTGEN_CHAIN
#endif
#include "arithmetic/numbers.h"
#ifndef HYSTGEN_CHAIN_STATE_FIXED_H
#define HYSTGEN_CHAIN_STATE_FIXED_H

/* A drive on its way at a limited rate: as it is sent, and what rounding took from it. */
typedef struct {
    hystgen_reach_t drive;
    hystgen_play_t rest;
} hystgen_ramp_t;

typedef struct {
    int64_t next; /* at the next sample for an unchanged input */
} hystgen_creep_state_t;

typedef struct {
    int64_t before; /* input of the last sample */
    int64_t ahead;  /* output of the next one for the same input */
} hystgen_creep_t;

typedef struct {
    int64_t high;   /* x, a lag on a drive that holds */
    int64_t wanted; /* output that the last input leads to */
    int64_t asked;  /* output asked for, */
    int64_t lead;   /* and the move that is to lead there */
} hystgen_lag_t;

typedef struct {
    hystgen_lag_t lag;
    int64_t earlier; /* asked for a sample before */
} hystgen_braked_t;

/* How a lead is to shrink, in numbers to search with. */
typedef struct {
    int32_t left; /* that the lag is to gain beyond its target's way */
    int32_t back; /* by which the lead shrinks in a step */
    int32_t lead; /* as it would be */
    int32_t room; /* by which it may shrink at once */
} hystgen_brake_t;

typedef struct {
    int64_t way;   /* of what the lag is led to, in this sample, */
    int64_t moved; /* and in the one before */
    bool rises;    /* it arrives from below */
} hystgen_steady_t;

typedef struct {
    int64_t next;   /* output at the next sample for an unchanged input */
    int64_t before; /* input of the last sample */
} hystgen_lag_exact_t;

typedef struct {
    int64_t arrived; /* in front of the plays */
    int64_t reference;
    uint32_t equal; /* references in a row, up to one more than a drive waits for to stand still */
} hystgen_quiet_t;

typedef struct {
    int64_t before; /* input of the last sample */
    int64_t off;    /* output less input */
    int64_t rate;   /* of `off`, per radian of the mode */
} hystgen_mode_t;

typedef struct {
    int32_t gain;
    int32_t inverse;
    int64_t offset;
} hystgen_gain_t;

typedef struct {
    int64_t high; /* travel, drive codes */
    int32_t gain;
    int32_t inverse;
    bool own; /* the gain follows the travel */
} hystgen_ageing_t;

typedef struct {
    int64_t rise; /* of the temperature over the surroundings */
    int32_t gain;
    int32_t inverse;
    int64_t offset;
} hystgen_heat_t;

typedef struct {
    int32_t at; /* a play that rubs */
} hystgen_friction_state_t;

typedef struct {
    bool begun; /* the plays that rub are somewhere */
} hystgen_friction_t;

typedef struct {
    int64_t whole;  /* drift, in units of signals, */
    int64_t part;   /* and the fraction below, in units of the table */
    int64_t lead;   /* samples by which the next reference is ahead */
    int64_t gained; /* growth of the change in a sample since the start */
    int64_t count;  /* samples since the start */
} hystgen_clock_t;

#endif
