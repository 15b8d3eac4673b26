#ifndef HYSTGEN_CORNERS_FIXED_STATE_H
#define HYSTGEN_CORNERS_FIXED_STATE_H

/* The direction of a move, which has an entry of its own where both directions are listed. */
typedef enum {
    HYSTGEN_FALLING = 0,
    HYSTGEN_RISING = 1
} hystgen_direction_t;

/* Where the plays are: plays 0 .. k follow the present move, `depth` corners hold the others. */
typedef struct {
    int64_t output; /* sum of the plays and the offset, not rounded to a code */
    int32_t input;  /* of the plays */
    uint_least16_t k;
    uint_least16_t depth;
    bool rising; /* direction of the present move */
} hystgen_place_t;

/* A place along the present move where another play begins to follow, or the present one: from
   there on plays 0 .. k follow and `depth` corners hold the others. */
typedef struct {
    int64_t output;
    int64_t input;
    uint_least16_t k;
    uint_least16_t depth;
} hystgen_kink_t;

#endif
