/* The memory of engine corners in floating point. */
#include "arithmetic/numbers.h"
#ifndef HYSTGEN_STATE_FLOAT_H
#define HYSTGEN_STATE_FLOAT_H

/* The direction of a move, which indexes arrays with one entry per direction. */
typedef enum {
    HYSTGEN_FALLING = 0,
    HYSTGEN_RISING = 1,
    HYSTGEN_BOTTOM = 2 /* no move: the corner that holds the plays that never follow */
} hystgen_direction_t;

/* The place of the plays: plays 0 .. k follow the present move, `depth` corners hold the others. */
typedef struct {
    hystgen_real_t input; /* of the play sum (forward: drive, inverse: output) */
    hystgen_real_t output;
    uint_least16_t k;
    uint_least16_t depth;
    bool rising; /* direction of the present move */
} hystgen_place_t;

/* A turning point, which holds the plays of its block: those above the plays of the next corner, up
   to play `top`. `pass`: inputs at which a falling and a rising move have taken the whole block
   along, sign changed for falling; one of these is the input at the turning point itself. */
typedef struct {
    hystgen_real_t output; /* at the turning point */
    hystgen_real_t pass[2];
    uint_least16_t top;
    uint_least8_t rose; /* a hystgen_direction_t: direction of the move that ended here */
} hystgen_corner_t;

/* The place of the play sum, and the straight line of its next outputs. */
typedef struct {
    hystgen_place_t here;
    hystgen_real_t next;       /* input up to which the same plays follow within the limits */
    hystgen_real_t cap;        /* input up to which the same corner applies within the limits */
    hystgen_real_t behind;     /* while no play follows: the same as `next`, on the other side */
    hystgen_real_t from_input; /* origin of the top corner's block: input and output */
    hystgen_real_t from_output;
    hystgen_real_t begin; /* output = start + (input - begin) gain */
    hystgen_real_t start;
    hystgen_real_t gain;
    hystgen_real_t sign; /* 1 for rising, -1 for falling */
    bool limited; /* the output is a limit, and the input may lie beyond the one for this output */
} hystgen_plays_t;

#endif
