/* The plays of engine corners in fixed point: a stack of turning points with exact sums. Called by
   the operators in compensator/corners and by chain/corners_fixed.c. */
#ifndef HYSTGEN_PLAYS_CORNERS_FIXED_C
#define HYSTGEN_PLAYS_CORNERS_FIXED_C
#include "arithmetic/fixed.h"
#include "hystgen_runtime.h"

#define HYSTGEN_HIGH_STEP ((int64_t)1 << HYSTGEN_LOW_BITS) /* one step of a corner's `high` */

/* Field by field: for a whole structure a compiler may call memcpy. */
HYSTGEN_API void hystgen_copy_place(hystgen_place_t *to, const hystgen_place_t *from) {
    to->output = from->output;
    to->input = from->input;
    to->k = from->k;
    to->depth = from->depth;
    to->rising = from->rising;
}

/* The direction of a rising or falling move. */
static inline hystgen_direction_t hystgen_direction(bool rising) {
    return rising ? HYSTGEN_RISING : HYSTGEN_FALLING;
}

/* x as seen along the present move: a falling move is a rising one with all signs changed. */
static inline int64_t hystgen_along(const hystgen_place_t *here, int64_t x) {
    return here->rising ? x : -x;
}

HYSTGEN_APART void hystgen_leave_corner(hystgen_place_t *here, hystgen_corner_t *corner) {
    hystgen_corner_t *c = &corner[here->depth];
    c->high = (int32_t)(here->output >> HYSTGEN_LOW_BITS);
    c->low = (hystgen_low_t)here->output;
    c->input = here->input;
    c->top = here->k & HYSTGEN_MOST_PLAYS;
    c->rose = here->rising;
    here->depth = (uint_least16_t)(here->depth + 1u);
}

/* Input or output, along the move, at which a segment of a corner's block begins. */
static inline int64_t hystgen_begins(const hystgen_place_t *here, const hystgen_corner_t *c,
                                     const hystgen_segment_t *s, bool by_output) {
    const int64_t output = (int64_t)c->high * HYSTGEN_HIGH_STEP + (int64_t)c->low;
    const int64_t whole = by_output ? s->reach : (int64_t)s->way;
    const int64_t held = hystgen_along(here, by_output ? output : c->input);
    return held + (c->rose == here->rising ? 0 : whole);
}

/* Reverses the move, and leaves a corner if plays have followed. */
HYSTGEN_APART void hystgen_turn_back(hystgen_place_t *here, hystgen_corner_t *corner) {
#ifdef HYSTGEN_HAS_PARAMETERS
    /* whatever the numbers of a block, blocks shrink towards the top, so corners have room */
    if (here->k > 0 && (here->depth == 0 || here->k < corner[here->depth - 1].top)) {
#else
    if (here->k > 0) {
#endif
        hystgen_leave_corner(here, corner);
        here->k = 0;
    }
    here->rising = !here->rising;
}

/* Finds the last kink before an output or input along the move, passed in kink->output: the point
   where another play begins to follow, or the present point. */
HYSTGEN_APART void hystgen_find(const hystgen_curve_t *t, const hystgen_place_t *here,
                                const hystgen_corner_t *corner, hystgen_kink_t *kink,
                                bool by_output) {
    const hystgen_corner_t *c = NULL; /* the corner that held play k until it began to follow */
    unsigned int low = 0;
    unsigned int left = here->depth;
    unsigned int k = here->k;
    while (low < left) { /* corner `left` is passed, those below `low` are not */
        const unsigned int middle = (low + left) / 2;
        const hystgen_corner_t *at = &corner[middle];
        const bool passed =
            kink->output >= hystgen_begins(here, at, &t->segment[at->top], by_output);
        left = passed ? middle : left;
        low = passed ? low : middle + 1u;
    }
    if (left < here->depth) {
        c = &corner[left];
        k = c->top;
    }
    if (left > 0 && corner[left - 1u].rose != here->rising) {
        const hystgen_corner_t *top = &corner[left - 1u];
        const int64_t on = kink->output - hystgen_begins(here, top, t->segment, by_output);
        const unsigned int before = k;
        unsigned int last = top->top - 1u;
        while (k < last) { /* play k follows, those above `last` do not */
            const unsigned int middle = (k + last) / 2 + 1u;
            const bool begun =
                on >= (by_output ? t->segment[middle].reach : (int64_t)t->segment[middle].way);
            k = begun ? middle : k;
            last = begun ? last : middle - 1u;
        }
        c = k > before ? top : c;
    }
    kink->k = (uint_least16_t)k;
    kink->depth = (uint_least16_t)left;
    kink->input = hystgen_along(here, here->input);
    kink->output = hystgen_along(here, here->output);
    if (c != NULL) {
        kink->input = hystgen_begins(here, c, &t->segment[k], false);
        kink->output = hystgen_begins(here, c, &t->segment[k], true);
    }
}

/* The same for a move to any input. May reverse the move, but moves no play. */
static inline void hystgen_find_input(const hystgen_curve_t *t, hystgen_place_t *here,
                                      hystgen_corner_t *corner, int32_t to, hystgen_kink_t *kink) {
    if (here->rising ? to < here->input : to > here->input) {
        hystgen_turn_back(here, corner);
    }
    kink->output = hystgen_along(here, to);
    hystgen_find(t, here, corner, kink, false);
}

/* Moves the plays to an input short of the next kink; `moved`: output gained since the last one. */
static void hystgen_go_on(hystgen_place_t *here, const hystgen_kink_t *kink, int32_t to,
                          int64_t moved) {
    here->output = hystgen_along(here, kink->output + moved);
    here->input = to;
    here->k = kink->k;
    here->depth = kink->depth;
}

/* Output gained between a kink and the input `to`; -1 if `to` lies before the kink. */
HYSTGEN_APART int64_t hystgen_gained(const hystgen_curve_t *t, const hystgen_place_t *here,
                                     const hystgen_kink_t *kink, int32_t to) {
    const int64_t way = hystgen_along(here, to) - kink->input;
    return way < 0 ? -1 : (int64_t)hystgen_wide(t->segment[kink->k].slope, (uint32_t)way);
}

/* Moves the plays to any input. */
HYSTGEN_KERNEL void hystgen_move_to_input(const hystgen_curve_t *t, hystgen_place_t *here,
                                          hystgen_corner_t *corner, hystgen_kink_t *kink,
                                          int32_t to) {
    hystgen_find_input(t, here, corner, to, kink);
    hystgen_go_on(here, kink, to, hystgen_gained(t, here, kink, to));
}

/* Input at which another play begins to follow the present move, or the largest input. */
static int32_t hystgen_next_input(const hystgen_curve_t *t, const hystgen_place_t *here,
                                  const hystgen_corner_t *corner) {
    int64_t x = HYSTGEN_LARGEST;
    if (here->depth > 0) {
        const int64_t begins =
            hystgen_begins(here, &corner[here->depth - 1u], &t->segment[here->k + 1u], false);
        x = begins < x ? begins : x;
    }
    return (int32_t)hystgen_along(here, x);
}

/* Sum of the plays at the next input; `next`: input at which another play begins to follow. */
HYSTGEN_API int64_t hystgen_plays_step(const hystgen_curve_t *t, hystgen_place_t *here,
                                       hystgen_corner_t *corner, hystgen_kink_t *kink,
                                       int32_t *next, int32_t to) {
    if (here->rising ? to > here->input && to < *next : to < here->input && to > *next) {
        /* the same plays follow */
        const uint32_t way = here->rising ? (uint32_t)to - (uint32_t)here->input
                                          : (uint32_t)here->input - (uint32_t)to;
        const int64_t moved = (int64_t)hystgen_wide(t->segment[here->k].slope, way);
        here->output = here->rising ? here->output + moved : here->output - moved;
        here->input = to;
    } else if (to != here->input) {
        hystgen_move_to_input(t, here, corner, kink, to);
        *next = hystgen_next_input(t, here, corner);
    }
    return here->output;
}

/* Input for the output `to`, which lies beyond a kink along the move; at most slightly out of
   range. */
HYSTGEN_APART int64_t hystgen_solved(const hystgen_curve_t *t, const hystgen_place_t *here,
                                     const hystgen_kink_t *kink, int64_t to) {
    const hystgen_segment_t *s = &t->segment[kink->k];
    const int64_t x =
        kink->input + hystgen_divide_by_slope(to - kink->output, s->reciprocal, s->shift);
    const int64_t most = t->range[hystgen_direction(here->rising)];
    return hystgen_along(here, x > most ? most : x);
}

/* Input for `output`, at most slightly out of range, and the last kink before this input. May
   reverse the move, but moves no play. Up to the output `next`, along the move, the same plays are
   known to follow. */
HYSTGEN_API int64_t hystgen_solve(const hystgen_curve_t *t, hystgen_place_t *here,
                                  hystgen_corner_t *corner, int64_t output, int64_t next,
                                  hystgen_kink_t *kink) {
    if (here->rising ? output < here->output : output > here->output) {
        hystgen_turn_back(here, corner);
        next = -HYSTGEN_FAR;
    }
    const int64_t to = hystgen_along(here, output);
    if (to < next) {
        kink->output = hystgen_along(here, here->output);
        kink->input = hystgen_along(here, here->input);
        kink->k = here->k;
        kink->depth = here->depth;
    } else {
        kink->output = to;
        hystgen_find(t, here, corner, kink, true);
    }
    return hystgen_solved(t, here, kink, to);
}

/* Output, along the present move, at which another play begins to follow after a kink. */
static int64_t hystgen_next_output(const hystgen_curve_t *t, const hystgen_place_t *here,
                                   const hystgen_corner_t *corner, const hystgen_kink_t *kink) {
    return kink->depth > 0
               ? hystgen_begins(here, &corner[kink->depth - 1u], &t->segment[kink->k + 1u], true)
               : HYSTGEN_FAR;
}

/* Moves the plays to an input near the solution found from a kink. Returns the output, along the
   move, at which another play begins to follow. */
HYSTGEN_API int64_t hystgen_move_to_solution(const hystgen_curve_t *t, hystgen_place_t *here,
                                             hystgen_corner_t *corner, hystgen_kink_t *kink,
                                             int32_t to) {
    int64_t next = hystgen_next_output(t, here, corner, kink);
    int64_t moved = hystgen_gained(t, here, kink, to);
    if (moved < 0 || kink->output + moved > next) { /* by rounding, or the input was limited */
        hystgen_find_input(t, here, corner, to, kink);
        next = hystgen_next_output(t, here, corner, kink);
        moved = hystgen_gained(t, here, kink, to);
    }
    hystgen_go_on(here, kink, to, moved);
    return next;
}

/* Start memory: a value for each play (step 1), or one value for all (step 0). Each play is a block
   of its own, with a corner where it begins to follow. */
HYSTGEN_KERNEL void hystgen_start(const hystgen_curve_t *t, hystgen_place_t *here,
                                  hystgen_corner_t *corner, const int32_t *play,
                                  unsigned int step) {
    int64_t aside = t->offset; /* output of the plays above play k, with the offset */
    unsigned int k;
    here->depth = 0;
    for (k = t->n; k > 0; --k) {
        const hystgen_segment_t *s = &t->segment[k];
        const int64_t w = play[step > 0 ? k : 0u];
        here->rising = w + s->way / 2u <= HYSTGEN_LARGEST;
        here->input = (int32_t)(w + hystgen_along(here, s->way / 2u));
        here->output = aside + w * (int64_t)s->slope + hystgen_along(here, s->reach / 2);
        here->k = (uint_least16_t)k;
        hystgen_leave_corner(here, corner);
        aside += w * (int64_t)(s->slope - s[-1].slope);
    }
    here->rising = true;
    here->input = play[0];
    here->output = aside + play[0] * (int64_t)t->segment[0].slope;
    here->k = 0;
}

#endif
