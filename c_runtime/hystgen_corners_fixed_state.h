#ifndef HYSTGEN_CORNERS_FIXED_STATE_H
#define HYSTGEN_CORNERS_FIXED_STATE_H

/* Where the plays are: plays 0 .. k follow the present move, `depth` corners hold the others. */
typedef struct {
    int64_t output; /* the sum of the plays, with the offset, before it is rounded to a code */
    int32_t input;  /* of the plays */
    uint_least16_t k;
    uint_least16_t depth;
    bool rising; /* direction of the present move */
} hystgen_place_t;

/* A place, as the present move sees it, where another play begins to follow, or where the move is
   now: from there on plays 0 .. k do and `depth` corners hold the others. */
typedef struct {
    int64_t output;
    int64_t input;
    uint_least16_t k;
    uint_least16_t depth;
} hystgen_kink_t;

#endif
