/* The memory of a model's effects in fixed point. */
#include "arithmetic/fixed.h"
#ifndef HYSTGEN_CHAIN
#define HYSTGEN_CHAIN
#endif
#include "arithmetic/numbers.h"
#ifndef HYSTGEN_CHAIN_STATE_FIXED_H
#define HYSTGEN_CHAIN_STATE_FIXED_H

/* A rate-limited drive: the value sent, and its rounding remainder. */
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
    int64_t high;   /* x, the response to a zero-order-hold drive */
    int64_t wanted; /* output for the last input */
    int64_t asked;  /* requested output, */
    int64_t lead;   /* and the move of x solved for it */
} hystgen_lag_t;

typedef struct {
    hystgen_lag_t lag;
    int64_t earlier; /* output requested one sample before */
} hystgen_braked_t;

/* Numbers of the search for a lead, with fewer bits than signals. */
typedef struct {
    int32_t left; /* distance that the lag is to gain beyond its target's move */
    int32_t back; /* decrease of the lead in a step */
    int32_t lead; /* lead before a cut */
    int32_t room; /* largest cut of the lead */
} hystgen_brake_t;

typedef struct {
    int64_t way;   /* move of the lag's target in this sample, */
    int64_t moved; /* and in the previous one */
    bool rises;    /* the lag arrives from below */
} hystgen_steady_t;

typedef struct {
    int64_t next;   /* output at the next sample for an unchanged input */
    int64_t before; /* input of the last sample */
} hystgen_lag_exact_t;

typedef struct {
    int64_t arrived; /* last output of the drive side */
    int64_t reference;
    uint32_t equal; /* equal references in a row, at most one more than needed to stand still */
} hystgen_quiet_t;

typedef struct {
    int64_t before; /* input of the last sample */
    int64_t off;    /* output minus input */
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
    bool own; /* the gain depends on the travel */
} hystgen_ageing_t;

typedef struct {
    int64_t rise; /* of the temperature over the surroundings */
    int32_t gain;
    int32_t inverse;
    int64_t offset;
} hystgen_heat_t;

typedef struct {
    int32_t at; /* value of a friction play */
} hystgen_friction_state_t;

typedef struct {
    bool begun; /* the friction plays have values */
} hystgen_friction_t;

/* A search between two inputs of the plays, `low` and one above `top`, which are not tried again,
   for the one at which their sum is `sum`. It lies in the memory of an operator, not on its stack.
 */
typedef struct {
    int64_t sum;
    int64_t short_of; /* what the sum lacks at `low`, or 0 if `low` is below all inputs, */
    int64_t over;     /* and what it has too much above `top`, or -1 */
    int64_t found;    /* sum at the input tried last, */
    int64_t last;     /* and at the one before */
    uint32_t rate;    /* change of the input per change of the sum; kept from search to search */
    int32_t input;    /* the one tried last, */
    int32_t before;   /* and the one before */
    int32_t low;
    int32_t top;
    uint8_t tries; /* by secants */
} hystgen_search_t;

typedef struct {
    int64_t whole;  /* drift, in units of signals, */
    int64_t part;   /* and the fraction below, in units of the table */
    int64_t lead;   /* samples by which the next reference is ahead */
    int64_t gained; /* growth of the change in a sample since the start */
    int64_t count;  /* samples since the start */
} hystgen_clock_t;

#endif
