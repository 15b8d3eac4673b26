/* The memory of engine corners in fixed point. */
#include "arithmetic/fixed.h"
#include "arithmetic/numbers.h"
#ifndef HYSTGEN_STATE_FIXED_H
#define HYSTGEN_STATE_FIXED_H

/* The direction of a move, which indexes arrays with one entry per direction. */
typedef enum {
    HYSTGEN_FALLING = 0,
    HYSTGEN_RISING = 1
} hystgen_direction_t;

/* The place of the plays: plays 0 .. k follow the present move, `depth` corners hold the others. */
typedef struct {
    int64_t output; /* sum of the plays and the offset, not rounded to a code */
    int32_t input;  /* of the plays */
    uint_least16_t k;
    uint_least16_t depth;
    bool rising; /* direction of the present move */
} hystgen_place_t;

/* A point along the present move where another play begins to follow, or the present point: from
   this point on plays 0 .. k follow and `depth` corners hold the others. */
typedef struct {
    int64_t output;
    int64_t input;
    uint_least16_t k;
    uint_least16_t depth;
} hystgen_kink_t;

#ifdef HYSTGEN_REAL_IS_SHORT
/* A turning point, which holds the plays of its block: those above the plays of the next corner, up
   to play `top`. */
typedef struct {
    int32_t high; /* output at the turning point: high 2^16 + low */
    int32_t input;
    unsigned int low : 16;
    unsigned int top : 15;
    bool rose : 1; /* true: a rising move ended here; false: a falling one */
} hystgen_corner_t;
#else
/* A turning point, which holds the plays of its block: those above the plays of the next corner, up
   to play `top`. */
typedef struct {
    int32_t high; /* output at the turning point: high 2^32 + low */
    int32_t input;
    uint32_t low;
    uint_least16_t top;
    bool rose; /* true: a rising move ended here; false: a falling one */
} hystgen_corner_t;
#endif

#endif
