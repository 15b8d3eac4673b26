/* Where the plays of one instance are; what a corner is, stands in a header of each arithmetic's own. */
#ifndef HYSTGEN_STATE_H
#define HYSTGEN_STATE_H

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
    hystgen_place_t there; /* where the next move is known to end, mostly by solving; k = 0 where no other plays follow */
    hystgen_play_t w;      /* input of the plays, w = G[v] */
    uint_least16_t start;  /* corners at the bottom that are of the start, where no more than `depth` are left of them */
    bool told;             /* the next move does end there, without another look */
} hystgen_memory_t;

#endif
