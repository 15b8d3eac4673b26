#include "hystgen_runtime.h"

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

/* The place where play k begins to follow the present move, until then held by the last of `depth` corners. */
static hystgen_kink_t hystgen_kink(const hystgen_curve_t *t, const hystgen_place_t *here, const hystgen_corner_t *corner,
                                   unsigned int depth, unsigned int k)
{
    const hystgen_corner_t *c = &corner[depth - 1u];
    hystgen_kink_t place = {c->input, c->output, k, depth};
    if (c->rose != here->rising) {
        place.input += hystgen_along(here, t->segment[k].way);
        place.output += hystgen_along(here, t->segment[k].reach);
    }
    return place;
}

/* Whether play k, held by corner c, follows by the time that the output, or the input, is x. */
static inline bool hystgen_has_begun(const hystgen_curve_t *t, const hystgen_place_t *here, const hystgen_corner_t *c,
                                     unsigned int k, int64_t x, bool by_output)
{
    const int64_t on = hystgen_along(here, x - (by_output ? c->output : c->input));
    const hystgen_segment_t *s = &t->segment[k];
    return on >= (c->rose == here->rising ? 0 : by_output ? s->reach : (int64_t)s->way);
}

/* The last place before x on the present move where another play begins to follow, or the present one. */
static inline hystgen_kink_t hystgen_find(const hystgen_curve_t *t, const hystgen_place_t *here,
                                          const hystgen_corner_t *corner, int64_t x, bool by_output)
{
    hystgen_kink_t place = {here->input, here->output, here->k, here->depth};
    unsigned int left = here->depth;
    unsigned int k = here->k;
    if (left > 0 && hystgen_has_begun(t, here, &corner[left - 1u], corner[left - 1u].top, x, by_output)) {
        unsigned int low = 0;
        --left;
        while (low < left) { /* corner `left` is passed, those below `low` are not */
            const unsigned int middle = (low + left) / 2;
            const bool passed = hystgen_has_begun(t, here, &corner[middle], corner[middle].top, x, by_output);
            left = passed ? middle : left;
            low = passed ? low : middle + 1u;
        }
        k = corner[left].top;
        place = hystgen_kink(t, here, corner, left + 1u, k);
        place.depth = left;
    }
    if (left > 0) {
        const hystgen_corner_t *c = &corner[left - 1u];
        unsigned int last = c->top - 1u;
        if (k < last && hystgen_has_begun(t, here, c, k + 1u, x, by_output)) {
            ++k;
            while (k < last) { /* play k follows, those above `last` do not */
                const unsigned int middle = (k + last) / 2;
                const bool begun = hystgen_has_begun(t, here, c, middle + 1u, x, by_output);
                k = begun ? middle + 1u : k;
                last = begun ? last : middle;
            }
            place = hystgen_kink(t, here, corner, left, k);
        }
    }
    return place;
}

/* Moves on from a place that the present move passes to an input at which the same plays follow. */
static void hystgen_go_on(const hystgen_curve_t *t, hystgen_place_t *here, const hystgen_kink_t *place, int32_t to)
{
    const uint32_t way = (uint32_t)hystgen_along(here, to - place->input);
    here->output = place->output + hystgen_along(here, (int64_t)hystgen_wide(t->segment[place->k].slope, way));
    here->input = to;
    here->k = (uint_least16_t)place->k;
    here->depth = (uint_least16_t)place->depth;
}

/* Moves the plays to any input. */
HYSTGEN_KERNEL void hystgen_move_to_input(const hystgen_curve_t *t, hystgen_place_t *here, hystgen_corner_t *corner,
                                          int32_t to)
{
    if (here->rising ? to < here->input : to > here->input) {
        hystgen_turn_back(here, corner);
    }
    const hystgen_kink_t place = hystgen_find(t, here, corner, to, false);
    hystgen_go_on(t, here, &place, to);
}

/* The input that gives `output`, kept near the range, and the place that it was counted from. Turns, moves nothing. */
HYSTGEN_KERNEL int64_t hystgen_solve(const hystgen_curve_t *t, hystgen_place_t *here, hystgen_corner_t *corner,
                                     int64_t output, hystgen_kink_t *place)
{
    if (here->rising ? output < here->output : output > here->output) {
        hystgen_turn_back(here, corner);
    }
    *place = hystgen_find(t, here, corner, output, true);
    const hystgen_segment_t *s = &t->segment[place->k];
    const int64_t on = hystgen_along(here, output - place->output);
    const int64_t x = hystgen_along(here, place->input) + hystgen_over_slope(on, s->reciprocal, s->shift);
    const int64_t most = t->range[here->rising];
    return hystgen_along(here, x > most ? most : x);
}

/* Moves the plays to an input near the one that was solved for from `place`. */
HYSTGEN_KERNEL void hystgen_move_to_solution(const hystgen_curve_t *t, hystgen_place_t *here, hystgen_corner_t *corner,
                                             const hystgen_kink_t *place, int32_t to)
{
    bool same = hystgen_along(here, to - place->input) >= 0; /* plays follow */
    if (same && place->depth > 0) {
        const hystgen_kink_t next = hystgen_kink(t, here, corner, place->depth, place->k + 1u);
        same = hystgen_along(here, next.input - to) >= 0;
    }
    if (same) {
        hystgen_go_on(t, here, place, to);
    } else {
        hystgen_move_to_input(t, here, corner, to);
    }
}

/* Output, as the present move sees it, up to which the same plays follow, or up to where the input comes to `end`. */
HYSTGEN_KERNEL int64_t hystgen_look_ahead(const hystgen_curve_t *t, const hystgen_place_t *here,
                                          const hystgen_corner_t *corner, int32_t end)
{
    const uint32_t room = (uint32_t)hystgen_along(here, (int64_t)end - here->input);
    const int64_t output = hystgen_along(here, here->output) + (int64_t)hystgen_wide(t->segment[here->k].slope, room);
    if (here->depth > 0) {
        const int64_t next = hystgen_along(here, hystgen_kink(t, here, corner, here->depth, here->k + 1u).output);
        return next < output ? next : output;
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
