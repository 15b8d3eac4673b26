/* The memory of a model's effects in fixed point. */
#ifndef HYSTGEN_CHAIN_FIXED_STATE_H
#define HYSTGEN_CHAIN_FIXED_STATE_H

typedef struct {
    int64_t next; /* at the next sample for an unchanged input */
} hystgen_creep_state_t;

typedef struct {
    int64_t before; /* input of the last sample */
    int64_t ahead;  /* output of the next one for the same input */
} hystgen_creep_t;

typedef struct {
    int64_t high;
    int64_t wanted; /* output that the last solution led to */
    int64_t asked;  /* output asked for, */
    int64_t lead;   /* and the move that is to lead there */
} hystgen_lag_t;

typedef struct {
    int64_t next;   /* what arrives at the next sample for an unchanged input */
    int64_t before; /* input of the last sample */
} hystgen_lag_exact_t;

typedef struct {
    int64_t before; /* input of the last sample */
    int64_t off;    /* output less input */
    int64_t rate;   /* of that, per radian of the mode */
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
    int64_t rise; /* of the temperature */
    int32_t gain;
    int32_t inverse;
    int64_t offset;
} hystgen_heat_t;

typedef struct {
    int64_t whole;  /* drift in signals, */
    int64_t part;   /* and the part of one, in units of the table */
    int64_t lead;   /* samples that the next reference is ahead */
    int64_t gained; /* by the change in a sample since the start */
    int64_t count;
} hystgen_clock_t;

#endif
