/* What the corner list of one instance looks like in memory. */
#ifndef HYSTGEN_STATE_H
#define HYSTGEN_STATE_H

/* A corner: the plays of its block, from the corner above it (or the plays that follow) up to `end` - 1,
   hold extremum + side * threshold. Corners lie in a stack, the block with the largest thresholds first. */
typedef struct {
    hystgen_sum_t output;     /* output at that moment; for side 0, less what a move has changed since the start */
    hystgen_play_t extremum;  /* input of the plays at which the move that left this corner ended */
    uint_least16_t end;       /* first play beyond the block */
    int_least8_t side;        /* -1 left by a rising move, +1 by a falling one, 0 never moved since the start */
} hystgen_corner_t;

/* Where a move has come to: plays 0 .. k-1 follow the input w, `depth` corners hold the others. */
typedef struct {
    hystgen_sum_t anchor_output; /* while the same plays follow, output = anchor_output + (w - anchor) slope[k] */
    hystgen_sum_t next_output;   /* output at which play k starts to follow */
    hystgen_reach_t anchor;
    hystgen_reach_t next;        /* w at which it does */
    uint_least16_t k;
    uint_least16_t depth;
    bool rising;                 /* direction of w */
} hystgen_place_t;

/* The plays of one instance, with its corners. */
typedef struct {
    hystgen_place_t here;
    hystgen_place_t there; /* where the answer that solving found last lies; k = 0 where the same plays follow */
    hystgen_play_t w;      /* input of the plays, w = G[v] */
} hystgen_memory_t;

#endif
