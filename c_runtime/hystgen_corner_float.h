/* A corner in floating point. */
#ifndef HYSTGEN_CORNER_FLOAT_H
#define HYSTGEN_CORNER_FLOAT_H

/* A corner: the plays of its block, from the corner above it (or the plays that follow) up to `end` - 1,
   hold extremum + side * threshold. Corners lie in a stack, the block with the largest thresholds first. */
typedef struct {
    hystgen_sum_t pass[2];    /* output at which a falling move, its sign changed, and a rising one have taken along the
                                 whole block, so that a search reads nothing else; one of them is that of the corner's
                                 own moment. For side 0 both are, less what a move has changed since the start. */
    hystgen_play_t extremum;  /* input of the plays at which the move that left this corner ended */
    uint_least16_t end;       /* first play beyond the block */
    int_least8_t side;        /* -1 left by a rising move, +1 by a falling one, 0 never moved since the start */
} hystgen_corner_t;

#endif
