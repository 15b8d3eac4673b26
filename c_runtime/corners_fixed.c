#include "hystgen_runtime.h"

/* One by one, since a copy of all may become a call of memcpy, which a freestanding target need not have. */
HYSTGEN_API void hystgen_copy_place(hystgen_place_t *to, const hystgen_place_t *from)
{
    to->output = from->output;
    to->input = from->input;
    to->k = from->k;
    to->depth = from->depth;
    to->rising = from->rising;
}

/* x as the present move sees it: a falling move is a rising one with all signs changed. */
static inline int64_t hystgen_along(const hystgen_place_t *here, int64_t x)
{
    return here->rising ? x : -x;
}

static void hystgen_leave_corner(hystgen_place_t *here, hystgen_corner_t *corner)
{
    hystgen_corner_t *c = &corner[here->depth];
    c->output = here->output;
    c->input = here->input;
    c->top = here->k;
    c->rose = here->rising;
    here->depth = (uint_least16_t)(here->depth + 1u);
}

/* A corner stays where plays have followed. */
HYSTGEN_APART void hystgen_turn_back(hystgen_place_t *here, hystgen_corner_t *corner)
{
    if (here->k > 0) {
        hystgen_leave_corner(here, corner);
        here->k = 0;
    }
    here->rising = !here->rising;
}

/* Whether play k, held by corner c, follows by the time that the output, or the input, is x. */
static inline bool hystgen_has_begun(const hystgen_curve_t *t, const hystgen_place_t *here, const hystgen_corner_t *c,
                                     unsigned int k, int64_t x, bool by_output)
{
    const int64_t on = hystgen_along(here, x - (by_output ? c->output : c->input));
    const hystgen_segment_t *s = &t->segment[k];
    return on >= (c->rose == here->rising ? 0 : by_output ? s->reach : (int64_t)s->way);
}

/* Where play k, held by corner c, begins to follow the present move. */
static void hystgen_kink(const hystgen_curve_t *t, const hystgen_place_t *here, const hystgen_corner_t *c, unsigned int k,
                         hystgen_kink_t *kink)
{
    const hystgen_segment_t *s = &t->segment[k];
    kink->input = c->input;
    kink->output = c->output;
    if (c->rose != here->rising) {
        kink->input += hystgen_along(here, s->way);
        kink->output += hystgen_along(here, s->reach);
    }
}

/* The last place before x on the present move where another play begins to follow, or the present one. */
static inline void hystgen_find(const hystgen_curve_t *t, const hystgen_place_t *here, const hystgen_corner_t *corner,
                                int64_t x, bool by_output, hystgen_kink_t *kink)
{
    unsigned int low = 0;
    unsigned int left = here->depth;
    unsigned int k = here->k;
    const hystgen_corner_t *holder = 0; /* of play k until it began to follow */
    while (low < left) { /* corner `left` is passed, those below `low` are not */
        const unsigned int middle = (low + left) / 2;
        const bool passed = hystgen_has_begun(t, here, &corner[middle], corner[middle].top, x, by_output);
        left = passed ? middle : left;
        low = passed ? low : middle + 1u;
    }
    if (left < here->depth) {
        holder = &corner[left];
        k = holder->top;
    }
    if (left > 0) {
        const hystgen_corner_t *c = &corner[left - 1u];
        unsigned int last = c->top - 1u;
        while (k < last) { /* play k follows, those above `last` do not */
            const unsigned int middle = (k + last) / 2 + 1u;
            const bool begun = hystgen_has_begun(t, here, c, middle, x, by_output);
            holder = begun ? c : holder;
            k = begun ? middle : k;
            last = begun ? last : middle - 1u;
        }
    }
    kink->input = here->input;
    kink->output = here->output;
    kink->k = (uint_least16_t)k;
    kink->depth = (uint_least16_t)left;
    if (holder) {
        hystgen_kink(t, here, holder, k, kink);
    }
}

HYSTGEN_APART void hystgen_find_by_input(const hystgen_curve_t *t, const hystgen_place_t *here,
                                         const hystgen_corner_t *corner, int32_t input, hystgen_kink_t *kink)
{
    hystgen_find(t, here, corner, input, false, kink);
}

HYSTGEN_APART void hystgen_find_by_output(const hystgen_curve_t *t, const hystgen_place_t *here,
                                          const hystgen_corner_t *corner, int64_t output, hystgen_kink_t *kink)
{
    hystgen_find(t, here, corner, output, true, kink);
}

/* Moves on from a place that the present move passes to an input at which the same plays follow. */
static void hystgen_go_on(const hystgen_curve_t *t, hystgen_place_t *here, const hystgen_kink_t *kink, int32_t to)
{
    const uint32_t way = (uint32_t)hystgen_along(here, to - kink->input);
    here->output = kink->output + hystgen_along(here, (int64_t)hystgen_wide(t->segment[kink->k].slope, way));
    here->input = to;
    here->k = kink->k;
    here->depth = kink->depth;
}

/* Moves the plays to any input. */
HYSTGEN_KERNEL void hystgen_move_to_input(const hystgen_curve_t *t, hystgen_place_t *here, hystgen_corner_t *corner,
                                          int32_t to)
{
    hystgen_kink_t kink;
    if (here->rising ? to < here->input : to > here->input) {
        hystgen_turn_back(here, corner);
    }
    hystgen_find_by_input(t, here, corner, to, &kink);
    hystgen_go_on(t, here, &kink, to);
}

/* The input that gives `output`, kept near the range, and the kink that it was counted from. Turns, moves nothing. */
HYSTGEN_API int64_t hystgen_solve(const hystgen_curve_t *t, hystgen_place_t *here, hystgen_corner_t *corner,
                                  int64_t output, hystgen_kink_t *kink)
{
    if (here->rising ? output < here->output : output > here->output) {
        hystgen_turn_back(here, corner);
    }
    hystgen_find_by_output(t, here, corner, output, kink);
    const hystgen_segment_t *s = &t->segment[kink->k];
    const int64_t on = hystgen_along(here, output - kink->output);
    const int64_t x = hystgen_along(here, kink->input) + hystgen_over_slope(on, s->reciprocal, s->shift);
    const int64_t most = t->range[here->rising];
    return hystgen_along(here, x > most ? most : x);
}

/* Moves the plays to an input near the one that was solved for from a kink. */
HYSTGEN_API void hystgen_move_to_solution(const hystgen_curve_t *t, hystgen_place_t *here, hystgen_corner_t *corner,
                                          const hystgen_kink_t *kink, int32_t to)
{
    bool same = hystgen_along(here, to - kink->input) >= 0; /* plays follow */
    if (same && kink->depth > 0) {
        same = !hystgen_has_begun(t, here, &corner[kink->depth - 1u], kink->k + 1u, to, false);
    }
    if (same) {
        hystgen_go_on(t, here, kink, to);
    } else {
        hystgen_move_to_input(t, here, corner, to);
    }
}

/* Output, as the present move sees it, up to which the same plays follow, or up to where the input comes to `end`. */
HYSTGEN_API int64_t hystgen_look_ahead(const hystgen_curve_t *t, const hystgen_place_t *here,
                                       const hystgen_corner_t *corner, int32_t end)
{
    const uint32_t room = (uint32_t)hystgen_along(here, (int64_t)end - here->input);
    const int64_t output = hystgen_along(here, here->output) + (int64_t)hystgen_wide(t->segment[here->k].slope, room);
    if (here->depth > 0) {
        hystgen_kink_t kink;
        hystgen_kink(t, here, &corner[here->depth - 1u], here->k + 1u, &kink);
        kink.output = hystgen_along(here, kink.output);
        return kink.output < output ? kink.output : output;
    }
    return output;
}

/* Start memory: what each play holds (step 1), or all of them (step 0). Each play is a block of its own, as if left by a
   move that ended where the play begins to follow. */
HYSTGEN_KERNEL void hystgen_start(const hystgen_curve_t *t, hystgen_place_t *here, hystgen_corner_t *corner,
                                  const int32_t *play, unsigned int step)
{
    int64_t aside = t->offset; /* what the plays above play k give */
    unsigned int k;
    here->depth = 0;
    for (k = t->n; k > 0; --k) {
        const hystgen_segment_t *s = &t->segment[k];
        const int64_t w = play[step * k];
        here->rising = w + s->way / 2u <= 2147483647;
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
