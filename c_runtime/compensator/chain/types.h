/* The types of models with effects, written from the structures in Python that the reference uses:
   HYSTGEN_UPDATE_GOLDEN=1 pytest tests/test_runtime.py -k declared */
#ifndef HYSTGEN_CHAIN
#define HYSTGEN_CHAIN
#endif
#include "arithmetic/numbers.h"
#ifndef HYSTGEN_CHAIN_TYPES_H
#define HYSTGEN_CHAIN_TYPES_H

/* A rate-limited drive: the value sent, and its rounding remainder. */
typedef struct {
    hystgen_reach_t drive;
    hystgen_play_t rest;
} hystgen_ramp_t;

/* A drive that stands still while the reference does. */
typedef struct {
    hystgen_signal_t arrived; /* last output of the drive side */
    hystgen_signal_t reference;
    uint32_t equal; /* equal references in a row, at most one more than needed to stand still */
} hystgen_quiet_t;

/* A lag in front of two branches. */
typedef struct {
    hystgen_signal_t way;   /* move of the lag's target in this sample, */
    hystgen_signal_t moved; /* and in the previous one */
    bool rises;             /* the lag arrives from below */
} hystgen_steady_t;

/* The tilted drive `1 + t w` of an element, over its largest value: change over a width, and where
   that is. */
typedef struct {
    hystgen_narrow_t lean;
    hystgen_play_t top;
} hystgen_tilt_t;

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

/* A smooth limit. */
typedef struct {
    hystgen_bend_curve_t forward;
    hystgen_bend_curve_t inverse;
} hystgen_bend_t;

/* What bending adds to the value of a play, as a piecewise polynomial of the same form. */
typedef struct {
    const int32_t *knot;
    const uint8_t *scale;
    const int32_t *coefficient;
    uint_least16_t pieces;
} hystgen_bump_t;

/* Stops, and the slope beyond them. */
typedef struct {
    int64_t lower;
    int64_t upper;
    hystgen_factor_t give;
    hystgen_factor_t inverse_give;
} hystgen_stops_t;

/* A piece of the yield of a nonlinear dashpot: its start, the left shift that scales its length to
   2^31, and the coefficients of its cubic, without their lowest `lift` bits. */
typedef struct {
    uint32_t begin;
    int32_t c[4];
    uint8_t scale;
    uint8_t lift;
} hystgen_yield_t;

/* A search between two inputs of the plays, `low` and one above `top`, which are not tried again,
   for the one at which their sum is `total`. It lies in the memory of an operator, not on its
   stack. */
typedef struct {
    int64_t total;
    int64_t short_of; /* shortfall of the sum at `low`, or 0 if `low` is below all inputs, */
    int64_t over;     /* and its excess above `top`, or -1 */
    int64_t found;    /* sum at the input tried last, */
    int64_t last;     /* and at the one before */
    uint32_t rate;    /* change in the input per unit change in the sum; kept for the next search */
    int32_t input;    /* the one tried last, */
    int32_t prior;    /* and the one before */
    int32_t low;
    int32_t top;
    uint8_t tries; /* by secants */
} hystgen_search_t;

/* A piece of the curve of elements in parallel with the plays: its begin and the curve's value
   there, both with 44 bits, coefficients of the mean slope from there on, and of the inverse over
   the share of the piece's rise. */
typedef struct {
    int64_t begin;
    int64_t level;
    hystgen_factor_t share;
    int32_t up[5];
    int32_t back[5];
    uint8_t scale; /* right shift from a distance to the share of the length in units of 2^-31 */
    uint8_t lift;  /* bits of a value that the product with `share` needs in addition */
} hystgen_piece_t;

/* An element: factors from a move of the input, at most `far`, to a distance on the curve, from
   there to the sum, and from a slope of the curve to that of the sum, with left shifts of the
   argument of the first and of the products of the others. */
typedef struct {
    hystgen_factor_t distance;
    hystgen_factor_t amplitude;
    hystgen_factor_t weight;
    int64_t far;
    uint8_t distance_lift;
    uint8_t amplitude_lift;
    uint8_t weight_lift;
} hystgen_element_table_t;

/* An element in parallel with the plays, at the last turn of its input. */
typedef struct {
    int64_t s;     /* z/width in the direction of the input, with a tilted drive plus `lean`, */
    int64_t place; /* on the curve, */
    int64_t level; /* the curve's value there, */
    int64_t until; /* the distance to the end of its piece, */
    int32_t c[5];  /* the coefficients of its mean slope from there on, */
    uint8_t scale; /* the right shift to the share of the piece's length, */
    int32_t lean;  /* and the change of the drive over a width from there on */
} hystgen_element_t;

/* Lag before the plays: x += rate (v - x); the output lies theta of that step behind x. */
typedef struct {
    hystgen_factor_t rate;
    hystgen_factor_t theta;
    hystgen_factor_t inverse_rate;
    uint8_t bits; /* bits of the states below those of a signal, */
    uint8_t drop; /* and bits that products leave out */
} hystgen_lag_table_t;

/* A lag that is led. */
typedef struct {
    hystgen_signal_t high;   /* x, the response to a zero-order-hold drive; */
    hystgen_signal_t wanted; /* output for the last input */
    hystgen_signal_t asked;  /* requested output, */
    hystgen_signal_t lead;   /* and the move of x solved for it */
} hystgen_lag_t;

/* Lag shorter than half a step: a += early v_before + late v - rate a. In fixed point the output
   follows a share `late` of a move at once, and approaches the input by a share `rate` in the next
   step. */
typedef struct {
    hystgen_factor_t rate;
    hystgen_factor_t late;
    hystgen_factor_t inverse_late;
    uint8_t bits; /* bits of the state below those of a signal, */
    uint8_t drop; /* and bits that products leave out */
} hystgen_lag_exact_table_t;

/* A lag that is inverted exactly. */
typedef struct {
    hystgen_signal_t next;   /* output at the next sample for an unchanged input */
    hystgen_signal_t before; /* input of the last sample */
} hystgen_lag_exact_t;

#else
/* What a search for the input of the plays starts from. */
typedef struct {
    hystgen_real_t slope; /* change in their sum per unit change in their input, in steady motion */
} hystgen_search_t;

/* A piece of the curve of elements in parallel with the plays: its begin and the curve's value
   there, coefficients from there on, and those of the inverse. */
typedef struct {
    hystgen_real_t begin;
    hystgen_real_t level;
    hystgen_real_t up[7];
    hystgen_real_t back[7];
} hystgen_piece_t;

/* An element in parallel with the plays, at the last turn of its input. */
typedef struct {
    hystgen_real_t s; /* z/width in the direction of the input, with a tilted drive plus `lean`, */
    hystgen_real_t low;   /* and its rounding remainder */
    hystgen_real_t place; /* on the curve, */
    hystgen_real_t level; /* the curve's value there, */
    hystgen_real_t until; /* the distance to the end of its piece, */
    hystgen_real_t c[7];  /* its coefficients from there on, */
    hystgen_real_t lean;  /* and the change of the drive over a width from there on */
} hystgen_element_t;

/* Lag before the plays: x += rate (v - x); the output lies theta of that step behind x. */
typedef struct {
    hystgen_factor_t rate;
    hystgen_factor_t theta;
    hystgen_real_t late;
    hystgen_factor_t inverse_rate;
} hystgen_lag_table_t;

/* A lag that is led. */
typedef struct {
    hystgen_signal_t high;   /* x, the response to a zero-order-hold drive; */
    hystgen_signal_t low;    /* its rounding remainder */
    hystgen_signal_t wanted; /* output for the last input */
    hystgen_signal_t asked;  /* requested output, */
    hystgen_signal_t answer; /* and the input solved for it */
} hystgen_lag_t;

/* Lag shorter than half a step: a += early v_before + late v - rate a. In fixed point the output
   follows a share `late` of a move at once, and approaches the input by a share `rate` in the next
   step. */
typedef struct {
    hystgen_factor_t rate;
    hystgen_real_t early;
    hystgen_factor_t late;
    hystgen_factor_t inverse_late;
} hystgen_lag_exact_table_t;

/* A lag that is inverted exactly. */
typedef struct {
    hystgen_signal_t reached;
    hystgen_signal_t before; /* input of the last sample */
} hystgen_lag_exact_t;

#endif

/* A lag behind a slew limit. */
typedef struct {
    hystgen_lag_t lag;
    hystgen_signal_t earlier; /* output requested one sample before */
} hystgen_braked_t;

#ifdef HYSTGEN_FIXED
/* A state of creep: its contribution at the next sample approaches weight times the input by a
   share `rate` in each step. */
typedef struct {
    hystgen_factor_t rate;
    hystgen_factor_t late; /* share of an input change that takes effect at once */
    hystgen_factor_t weight;
    uint8_t lift; /* bits of a state that the product with `late` leaves out */
} hystgen_creep_term_t;

/* A state of creep. */
typedef struct {
    hystgen_signal_t next; /* at the next sample for an unchanged input */
} hystgen_creep_state_t;

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

/* Creep after the plays. */
typedef struct {
    hystgen_signal_t before; /* input of the last sample */
    hystgen_signal_t ahead;  /* output of the next one for the same input */
} hystgen_creep_t;

/* A piece of the gain over travel: a cubic in the travelled share of its length. */
typedef struct {
    hystgen_signal_t begin;
    hystgen_factor_t share; /* of the travel since `begin` in the piece, */
    uint8_t drop;           /* without the bits that the product leaves out */
    hystgen_narrow_t c[4];
} hystgen_ageing_piece_t;

/* Gain over travel up to `last`. */
typedef struct {
    const hystgen_ageing_piece_t *piece;
    hystgen_signal_t last;
    uint_least16_t n;
    uint_least8_t turns; /* Newton steps for the reciprocal of a gain that has changed */
    uint8_t bits;        /* of a gain below a code that sets it */
} hystgen_ageing_table_t;

/* A gain that depends on the travel. */
typedef struct {
    hystgen_signal_t high; /* travel, in fixed point in drive codes; */
    hystgen_narrow_t gain;
    hystgen_narrow_t inverse;
    bool own; /* the gain depends on the travel */
} hystgen_ageing_t;

/* Self-heating: degrees gained per amount of heating, the share lost in a step, and the rise up to
   which gain and offset follow. */
typedef struct {
    hystgen_factor_t rate;
    hystgen_factor_t per_amount;
    hystgen_factor_t per_degree;
    hystgen_factor_t offset_per_degree;
    hystgen_signal_t hottest;
    uint_least16_t turns; /* Newton steps for the reciprocal of a gain that has changed */
    uint8_t coarse;       /* bits of an amount that its product leaves out, */
    uint8_t lift;         /* bits of the temperature that the same product leaves out, */
    uint8_t drop;         /* and bits that products of the temperature leave out */
} hystgen_heat_table_t;

/* Self-heating. */
typedef struct {
    hystgen_signal_t high; /* rise of the temperature over the surroundings; */
    hystgen_narrow_t gain;
    hystgen_narrow_t inverse;
    hystgen_signal_t offset;
} hystgen_heat_t;

#else
/* Creep state X, the contribution of past inputs to the next output: X += rate (share h - X). */
typedef struct {
    hystgen_real_t rate;
    hystgen_real_t share;
} hystgen_creep_term_t;

/* A number in two parts, since its steps may be far smaller than its last bit. */
typedef struct {
    hystgen_real_t high;
    hystgen_real_t low;
} hystgen_creep_state_t;

/* Creep after the plays: y = slope h + X_1 + X_2 + ..., with the X of the previous sample. */
typedef struct {
    const hystgen_creep_term_t *term;
    hystgen_real_t slope; /* immediate change in y with h */
    hystgen_real_t inverse_slope;
    hystgen_real_t rest; /* y over h at rest */
    hystgen_real_t inverse_rest;
    uint_least16_t n;
} hystgen_creep_table_t;

/* Creep after the plays. */
typedef struct {
    hystgen_real_t ahead; /* output of the next sample for an input of 0 */
} hystgen_creep_t;

/* A piece of the gain over travel: a cubic in the travelled share of its length. */
typedef struct {
    hystgen_signal_t begin;
    hystgen_factor_t share; /* of the travel since `begin` in the piece, */
    hystgen_narrow_t c[4];
} hystgen_ageing_piece_t;

/* Gain over travel up to `last`. */
typedef struct {
    const hystgen_ageing_piece_t *piece;
    hystgen_signal_t last;
    uint_least16_t n;
    uint_least8_t turns; /* Newton steps for the reciprocal of a gain that has changed */
} hystgen_ageing_table_t;

/* A gain that depends on the travel. */
typedef struct {
    hystgen_signal_t high; /* travel, in fixed point in drive codes; */
    hystgen_signal_t low;  /* its rounding remainder */
    hystgen_narrow_t gain;
    hystgen_narrow_t inverse;
    bool own; /* the gain depends on the travel */
} hystgen_ageing_t;

/* Self-heating: degrees gained per amount of heating, the share lost in a step, and the rise up to
   which gain and offset follow. */
typedef struct {
    hystgen_factor_t rate;
    hystgen_factor_t per_amount;
    hystgen_factor_t per_degree;
    hystgen_factor_t offset_per_degree;
    hystgen_signal_t hottest;
    uint_least16_t turns; /* Newton steps for the reciprocal of a gain that has changed */
} hystgen_heat_table_t;

/* Self-heating. */
typedef struct {
    hystgen_signal_t high; /* rise of the temperature over the surroundings; */
    hystgen_signal_t low;  /* its rounding remainder */
    hystgen_narrow_t gain;
    hystgen_narrow_t inverse;
    hystgen_signal_t offset;
} hystgen_heat_t;

#endif

/* A friction play. */
typedef struct {
    hystgen_signal_t threshold;
} hystgen_friction_play_t;

/* A friction play. */
typedef struct {
    hystgen_narrow_t at; /* value of the play */
} hystgen_friction_state_t;

#ifdef HYSTGEN_FIXED
/* Friction plays, the smallest threshold first. */
typedef struct {
    const hystgen_friction_play_t *play;
    uint_least16_t n;
    uint8_t bits; /* of a play below a drive code */
} hystgen_friction_table_t;

#else
/* Friction plays, the smallest threshold first. */
typedef struct {
    const hystgen_friction_play_t *play;
    uint_least16_t n;
} hystgen_friction_table_t;

#endif

/* Friction plays. */
typedef struct {
    bool begun; /* the plays have values */
} hystgen_friction_t;

#ifdef HYSTGEN_FIXED
/* Gain and offset per unit of a column above the reference, between two values of the column. */
typedef struct {
    hystgen_factor_t per_unit;
    hystgen_factor_t offset_per_unit;
    hystgen_signal_t reference;
    hystgen_signal_t lowest;
    hystgen_signal_t highest;
    uint8_t bits; /* of a value below a code */
} hystgen_gain_table_t;

#else
/* Gain and offset per unit of a column above the reference, between two values of the column. */
typedef struct {
    hystgen_factor_t per_unit;
    hystgen_factor_t offset_per_unit;
    hystgen_signal_t reference;
    hystgen_signal_t lowest;
    hystgen_signal_t highest;
} hystgen_gain_table_t;

#endif

/* A gain with an offset behind it. */
typedef struct {
    hystgen_narrow_t gain;
    hystgen_narrow_t inverse;
    hystgen_signal_t offset;
} hystgen_gain_t;

/* A play of a column. */
typedef struct {
    hystgen_signal_t threshold;
    hystgen_factor_t weight;
} hystgen_course_play_t;

/* A play of a column. */
typedef struct {
    hystgen_signal_t at; /* value of the play */
} hystgen_course_state_t;

/* How gain and offset follow a column other than at once and along a line. */
typedef struct {
    const hystgen_course_play_t *play;
    uint_least16_t n;      /* plays of the column */
    uint_least16_t turns;  /* Newton steps for the reciprocal of a gain that has changed */
    uint_least8_t lags;    /* 1 if the column acts through a first-order lag */
    hystgen_factor_t rate; /* share of the distance that the lag covers in a step, */
    hystgen_factor_t late; /* and of a change within the step */
    hystgen_factor_t inverse_reach;
    hystgen_signal_t square; /* offset at the reach, of the column's square */
    hystgen_signal_t cube;   /* and cube */
} hystgen_course_table_t;

#ifdef HYSTGEN_FIXED
/* A column that has been set. */
typedef struct {
    hystgen_signal_t high; /* the column above its reference, behind the lag; */
    hystgen_signal_t now;  /* the column, set last, */
    hystgen_signal_t seen; /* and at the previous sample */
    bool begun;            /* it has been set */
} hystgen_course_t;

/* Mode of the stage. Its two states are output minus input, and the rate of this difference; in a
   step they change by shares of themselves (keep, swing), of each other (turn), and of a change in
   the input (lead, in fixed point late minus the change itself, and push). */
typedef struct {
    hystgen_factor_t keep;
    hystgen_factor_t turn;
    hystgen_factor_t swing;
    hystgen_factor_t late;
    hystgen_factor_t push;
    uint8_t bits; /* bits of the states below those of a signal, */
    uint8_t drop; /* bits that products with states leave out, */
    uint8_t lift; /* and bits that products with a change in the input leave out */
} hystgen_mode_table_t;

#else
/* A column that has been set. */
typedef struct {
    hystgen_signal_t high; /* the column above its reference, behind the lag; */
    hystgen_signal_t low;  /* its rounding remainder */
    hystgen_signal_t now;  /* the column, set last, */
    hystgen_signal_t seen; /* and at the previous sample */
    bool begun;            /* it has been set */
} hystgen_course_t;

/* Mode of the stage. Its two states are output minus input, and the rate of this difference; in a
   step they change by shares of themselves (keep, swing), of each other (turn), and of a change in
   the input (lead, in fixed point late minus the change itself, and push). */
typedef struct {
    hystgen_factor_t keep;
    hystgen_factor_t turn;
    hystgen_factor_t swing;
    hystgen_real_t lead;
    hystgen_factor_t push;
} hystgen_mode_table_t;

#endif

/* A mode of the stage. */
typedef struct {
    hystgen_signal_t before; /* input of the last sample */
    hystgen_signal_t off;    /* output minus input */
    hystgen_signal_t rate;   /* of `off`, per radian of the mode */
} hystgen_mode_t;

#ifdef HYSTGEN_FIXED
/* Drift over time: its change in the first sample, and the growth of this change per sample. */
typedef struct {
    hystgen_signal_t slope;
    hystgen_signal_t change;
    hystgen_signal_t samples; /* after which the drift is constant */
    hystgen_signal_t farthest;
    uint8_t bits; /* bits of slope and change below those of a signal */
} hystgen_clock_table_t;

/* A clock. */
typedef struct {
    hystgen_signal_t whole;  /* drift, in units of signals, */
    hystgen_signal_t part;   /* and the fraction below, in units of the table */
    hystgen_signal_t lead;   /* samples by which the next reference is ahead */
    hystgen_signal_t gained; /* growth of the change in a sample since the start */
    hystgen_signal_t count;  /* samples since the start */
} hystgen_clock_t;

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

/* A clock. */
typedef struct {
    hystgen_real_t high; /* samples counted: multiples of the table's carry, and the rest */
    hystgen_real_t low;
    hystgen_real_t lead; /* samples by which the next reference is ahead */
} hystgen_clock_t;

#endif

#if defined(HYSTGEN_N_PLAYS) && !defined(HYSTGEN_CONFIGURED)
/* Either operator: the members of both. */
typedef struct {
    hystgen_braked_t braked_1;
    hystgen_ageing_t ageing_1;
    hystgen_real_t waiting[3]; /* drives */
    unsigned int oldest;       /* drive */
    hystgen_real_t pending;    /* drive sent but not yet in the memory */
    hystgen_real_t applied;    /* last applied drive */
    hystgen_ramp_t reached;    /* drive at a limited rate */
    hystgen_fine_t drive;      /* last output of the drive side */
    hystgen_real_t reference;  /* of the last step */
    hystgen_real_t last;     /* the same, limited: the next reference moves up or down from here */
    hystgen_signal_t level;  /* sum of the plays */
    hystgen_signal_t output; /* last output of the output side */
    hystgen_real_t answer;   /* last returned displacement */
    hystgen_signal_t offset; /* set in addition to the model's */
    hystgen_quiet_t quiet;
    hystgen_steady_t steady;
    hystgen_signal_t line[3]; /* references, the newest last */
    bool ascending;           /* direction of the drive's last move */
    bool moving;              /* a drive has been applied */
    bool has_pending;
    bool repeated;     /* the last returned drive is still valid for `reference` */
    bool stepped;      /* a step has returned a drive */
    bool filled;       /* the line holds references */
    unsigned int bits; /* of the last step */
    unsigned int status;
#ifdef HYSTGEN_HAS_CORNERS
    bool sought; /* a solution has been found since the plays last followed */
#ifdef HYSTGEN_FIXED
    hystgen_place_t here;
    hystgen_signal_t next; /* output, along the move, at which another play begins to follow */
    hystgen_kink_t kink;   /* of the present step; kept here rather than on the stack */
    hystgen_corner_t corner[6];
#else
    hystgen_plays_t plays;
    hystgen_place_t undo; /* place of the plays before the solution */
    hystgen_corner_t corner[7];
#endif
#else
    hystgen_signal_t bent[HYSTGEN_N_PLAYS]; /* contribution of each play */
    hystgen_search_t search;                /* for the input of the plays */
    hystgen_play_t
        play[13]; /* play 0 is the input of the plays; the rounding remainder of each follows */
    hystgen_signal_t staying; /* sum of the plays that have not moved lately */
    unsigned int released;    /* the last of the plays that have */
    hystgen_play_t turned; /* input of the elements in parallel with the plays at their last turn */
    bool upward;           /* their input has risen since */
    hystgen_element_t element[2];
#ifdef HYSTGEN_FIXED
    hystgen_play_t near;  /* input for which the sum of the elements was last computed, */
    hystgen_sum_t joined; /* that sum, */
    hystgen_sum_t slope;  /* its slope, and whether */
    bool departs;         /* they have turned there */
    hystgen_sum_t steep;  /* slope that the rate of a search has, or -1 after a turn */
#else
    hystgen_play_t found;   /* input to which a search has led, */
    hystgen_signal_t asked; /* and the sum of the plays there */
#endif
#endif
} hystgen_operator_t;
#endif

#endif
