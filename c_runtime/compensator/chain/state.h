/* The memory of a model's effects, in every arithmetic. */
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

#ifdef HYSTGEN_FIXED
typedef struct {
    hystgen_signal_t next; /* at the next sample for an unchanged input */
} hystgen_creep_state_t;

typedef struct {
    hystgen_signal_t before; /* input of the last sample */
    hystgen_signal_t ahead;  /* output of the next one for the same input */
} hystgen_creep_t;
#else
/* A number in two parts, since its steps may be far smaller than its last bit. */
typedef struct {
    hystgen_real_t high;
    hystgen_real_t low;
} hystgen_creep_state_t;

typedef struct {
    hystgen_real_t ahead; /* output of the next sample for an input of 0 */
} hystgen_creep_t;
#endif

typedef struct {
    hystgen_signal_t high; /* x, the response to a zero-order-hold drive; */
#ifndef HYSTGEN_FIXED
    hystgen_signal_t low; /* its rounding remainder */
#endif
    hystgen_signal_t wanted; /* output for the last input */
    hystgen_signal_t asked;  /* requested output, */
#ifdef HYSTGEN_FIXED
    hystgen_signal_t lead; /* and the move of x solved for it */
#else
    hystgen_signal_t answer; /* and the input solved for it */
#endif
} hystgen_lag_t;

typedef struct {
    hystgen_lag_t lag;
    hystgen_signal_t earlier; /* output requested one sample before */
} hystgen_braked_t;

#ifdef HYSTGEN_FIXED
/* Numbers of the search for a lead, with fewer bits than signals. */
typedef struct {
    int32_t left; /* distance that the lag is to gain beyond its target's move */
    int32_t back; /* decrease in the lead per step */
    int32_t lead; /* lead before a cut */
    int32_t room; /* largest cut in the lead */
} hystgen_brake_t;
#endif

typedef struct {
    hystgen_signal_t way;   /* move of the lag's target in this sample, */
    hystgen_signal_t moved; /* and in the previous one */
    bool rises;             /* the lag arrives from below */
} hystgen_steady_t;

typedef struct {
#ifdef HYSTGEN_FIXED
    hystgen_signal_t next; /* output at the next sample for an unchanged input */
#else
    hystgen_signal_t reached;
#endif
    hystgen_signal_t before; /* input of the last sample */
} hystgen_lag_exact_t;

typedef struct {
    hystgen_signal_t arrived; /* last output of the drive side */
    hystgen_signal_t reference;
    uint32_t equal; /* equal references in a row, at most one more than needed to stand still */
} hystgen_quiet_t;

typedef struct {
    hystgen_signal_t before; /* input of the last sample */
    hystgen_signal_t off;    /* output minus input */
    hystgen_signal_t rate;   /* of `off`, per radian of the mode */
} hystgen_mode_t;

typedef struct {
    hystgen_narrow_t gain;
    hystgen_narrow_t inverse;
    hystgen_signal_t offset;
} hystgen_gain_t;

typedef struct {
    hystgen_signal_t high; /* travel, in fixed point in drive codes; */
#ifndef HYSTGEN_FIXED
    hystgen_signal_t low; /* its rounding remainder */
#endif
    hystgen_narrow_t gain;
    hystgen_narrow_t inverse;
    bool own; /* the gain depends on the travel */
} hystgen_ageing_t;

typedef struct {
    hystgen_signal_t high; /* rise of the temperature over the surroundings; */
#ifndef HYSTGEN_FIXED
    hystgen_signal_t low; /* its rounding remainder */
#endif
    hystgen_narrow_t gain;
    hystgen_narrow_t inverse;
    hystgen_signal_t offset;
} hystgen_heat_t;

typedef struct {
    hystgen_narrow_t at; /* value of a friction play */
} hystgen_friction_state_t;

typedef struct {
    bool begun; /* the friction plays have values */
} hystgen_friction_t;

#ifdef HYSTGEN_FIXED
typedef struct {
    hystgen_signal_t whole;  /* drift, in units of signals, */
    hystgen_signal_t part;   /* and the fraction below, in units of the table */
    hystgen_signal_t lead;   /* samples by which the next reference is ahead */
    hystgen_signal_t gained; /* growth of the change in a sample since the start */
    hystgen_signal_t count;  /* samples since the start */
} hystgen_clock_t;

/* An element in parallel with the plays, at the last turn of its input. */
typedef struct {
    int64_t s;     /* z/width in the direction of the input, */
    int64_t place; /* on the curve, */
    int64_t level; /* the curve's value there, */
    int64_t until; /* the distance to the end of its piece, */
    int32_t c[5];  /* the coefficients of its mean slope from there on, */
    uint8_t scale; /* and the right shift to the share of the piece's length */
} hystgen_element_t;

/* A search between two inputs of the plays, `low` and one above `top`, which are not tried again,
   for the one at which their sum is `sum`. It lies in the memory of an operator, not on its stack.
 */
typedef struct {
    int64_t sum;
    int64_t short_of; /* shortfall of the sum at `low`, or 0 if `low` is below all inputs, */
    int64_t over;     /* and its excess above `top`, or -1 */
    int64_t found;    /* sum at the input tried last, */
    int64_t last;     /* and at the one before */
    uint32_t rate;    /* change in the input per unit change in the sum; kept for the next search */
    int32_t input;    /* the one tried last, */
    int32_t before;   /* and the one before */
    int32_t low;
    int32_t top;
    uint8_t tries; /* by secants */
} hystgen_search_t;
#else
typedef struct {
    hystgen_real_t high; /* samples counted: multiples of the table's carry, and the rest */
    hystgen_real_t low;
    hystgen_real_t lead; /* samples by which the next reference is ahead */
} hystgen_clock_t;

/* An element in parallel with the plays, at the last turn of its input. */
typedef struct {
    hystgen_real_t high;  /* z/width in the direction of the input, */
    hystgen_real_t low;   /* and its rounding remainder */
    hystgen_real_t place; /* on the curve, */
    hystgen_real_t level; /* the curve's value there, */
    hystgen_real_t until; /* the distance to the end of its piece, */
    hystgen_real_t c[7];  /* and its coefficients from there on */
} hystgen_element_t;

/* An input of the plays that a search has tried. */
typedef struct {
    hystgen_real_t low; /* the solution lies between these */
    hystgen_real_t high;
    hystgen_real_t input;
    hystgen_real_t asked;   /* sum of the plays that the solution has */
    hystgen_real_t sum;     /* their sum at the input tried, */
    hystgen_real_t slope;   /* its change per unit change in the input, */
    hystgen_real_t steady;  /* and that in steady motion, in which plays follow in full; */
    hystgen_real_t reached; /* value that one of them reaches there, */
    hystgen_real_t share;   /* and its share of a further change in the input */
} hystgen_attempt_t;

/* What a search for the input of the plays starts from. */
typedef struct {
    hystgen_real_t slope; /* change in their sum per unit change in their input, in steady motion */
} hystgen_search_t;
#endif

#endif
