#ifndef HYSTGEN_CORNERS_FIXED_STATE_H
#define HYSTGEN_CORNERS_FIXED_STATE_H

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
