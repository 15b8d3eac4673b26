#include "hystgen_runtime.h"

/* x as the present move sees it: a falling move is a rising one with all signs changed. */
HYSTGEN_COPIES hystgen_real_t hystgen_along(const hystgen_plays_t *m, hystgen_real_t x)
{
#if HYSTGEN_SOFT_FLOAT
    return m->here.rising ? x : -x;
#else
    return m->sign * x;
#endif
}

/* Whether the plays of a corner begin to follow one after the other. After a move of the same direction they follow all
   at once, as soon as the input is back at the corner. */
static bool hystgen_is_opposite(const hystgen_corner_t *c, bool rising)
{
    return c->rose != (rising ? 1u : 0u);
}

/* Places the plays where there is no line to go on along: the next sample searches. */
HYSTGEN_API void hystgen_put(hystgen_plays_t *m, const hystgen_place_t *place)
{
    m->here = *place;
    m->sign = (hystgen_real_t)(place->rising ? 1 : -1);
    m->next = hystgen_along(m, -HYSTGEN_REAL_MAX);
    m->cap = m->next;
}

/* Leaves a corner here. A block whose last play follows beyond the limit only is never passed. */
HYSTGEN_APART void hystgen_leave_corner(const hystgen_curve_t *t, hystgen_place_t *here, hystgen_corner_t *corner)
{
    const hystgen_segment_t *s = &t->segment[here->k];
    const hystgen_real_t input = here->rising ? here->input : -here->input;
    const hystgen_real_t room = t->limit[!here->rising] + (here->rising ? here->output : -here->output);
    hystgen_corner_t *c = &corner[here->depth];
    c->output = here->output;
    c->pass[here->rising] = input;
    c->pass[!here->rising] = s->reach > room ? HYSTGEN_REAL_MAX : s->way - input;
    c->top = here->k;
    c->rose = here->rising;
    here->depth = (uint_least16_t)(here->depth + 1u);
}

static void hystgen_turn_back(const hystgen_curve_t *t, hystgen_plays_t *m, hystgen_corner_t *corner)
{
    if (m->here.k > 0) {
        hystgen_leave_corner(t, &m->here, corner);
        m->here.k = 0;
    }
    m->here.rising = !m->here.rising;
    m->sign = -m->sign;
}

/* The last of segments k .. last that begins before `way`, of whose ways or reaches `step` is that of segment 1. */
HYSTGEN_APART unsigned int hystgen_find_segment(const hystgen_real_t *step, unsigned int k, unsigned int last,
                                                hystgen_real_t way)
{
    while (k < last) {
        const unsigned int middle = (k + last) / 2;
        if (way > step[4u * middle]) {
            k = middle + 1u;
        } else {
            last = middle;
        }
    }
    return k;
}

/* Moves the plays to where their sum is `output`, as nearly as floating point can tell. */
HYSTGEN_API void hystgen_move_to_output(const hystgen_curve_t *t, hystgen_plays_t *m, hystgen_corner_t *corner,
                                        hystgen_real_t output)
{
    if (hystgen_along(m, output) < hystgen_along(m, m->here.output)) {
        hystgen_turn_back(t, m, corner);
    }
    hystgen_place_t p = m->here;
    unsigned int kept = 0; /* bisect the corners: `passed` is passed, `kept` is not; the top one is tried first */
    unsigned int passed = p.depth;
    unsigned int middle = passed - 1u;
    while (passed - kept > 1u) {
        const hystgen_corner_t *c = &corner[middle];
        const hystgen_real_t reach = hystgen_is_opposite(c, p.rising) ? t->segment[c->top].reach : 0;
        if (hystgen_along(m, output - c->output) >= reach) {
            passed = middle;
            p.k = c->top;
        } else {
            kept = middle;
        }
        middle = (kept + passed) / 2;
    }
    p.depth = (uint_least16_t)passed;
    const hystgen_corner_t *c = &corner[kept];
    hystgen_real_t reach = hystgen_along(m, output - c->output);
    p.input = c->pass[p.rising];
    if (hystgen_is_opposite(c, p.rising)) {
        p.k = (uint_least16_t)hystgen_find_segment(&t->segment[1].reach, p.k, c->top - 1u, reach);
        reach = reach - t->segment[p.k].reach;
        p.input = t->segment[p.k].way - c->pass[!p.rising];
    }
    p.input = hystgen_along(m, p.input + reach * t->segment[p.k].slope);
    p.output = output;
    p.limited = false;
    hystgen_put(m, &p);
}

/* Moves the plays to an input that another corner may count for. */
HYSTGEN_API hystgen_real_t hystgen_move_to_input(const hystgen_curve_t *t, hystgen_plays_t *m, hystgen_corner_t *corner,
                                                 hystgen_real_t input)
{
    hystgen_real_t x = hystgen_along(m, input);
    if (x < hystgen_along(m, m->here.input)) {
        hystgen_turn_back(t, m, corner);
        x = -x;
    }
    const bool rising = m->here.rising;
    unsigned int passed = m->here.depth - 1u;
    if (passed > 0 && x >= corner[passed].pass[rising]) { /* bisect: `passed` is passed, `kept` is not */
        unsigned int kept = 0;
        while (passed - kept > 1u) {
            const unsigned int middle = (kept + passed) / 2;
            if (x >= corner[middle].pass[rising]) {
                passed = middle;
            } else {
                kept = middle;
            }
        }
        m->here.k = corner[passed].top;
        m->here.depth = (uint_least16_t)passed;
    }

    const hystgen_corner_t *c = &corner[m->here.depth - 1u];
    unsigned int k = m->here.k;
    hystgen_real_t begin = c->pass[rising];
    hystgen_real_t next = begin;
    hystgen_real_t cap = begin;
    m->base = c->output;
    m->start = c->output;
    if (hystgen_is_opposite(c, rising)) {
        const hystgen_real_t from = -c->pass[!rising];
        const hystgen_real_t room = t->inside[rising] - hystgen_along(m, c->output);
        k = hystgen_find_segment(&t->segment[1].way, k, c->top - 1u, x - from);
        const hystgen_segment_t *s = &t->segment[k];
        m->from = hystgen_along(m, from);
        m->start = c->output + hystgen_along(m, s->reach);
        begin = from + s->way;
        next = from + s[1].way;
        cap = from + t->segment[c->top].way;
        if (t->segment[c->top].reach > room) { /* gains fall from segment to segment: the limit lies here or beyond */
            const hystgen_real_t stop = begin + (room - s->reach) * s->slope;
            cap = stop < cap ? stop : cap;
        }
    }
    m->gain = t->segment[k].gain;
    m->begin = hystgen_along(m, begin);
    const hystgen_real_t output = m->start + (input - m->begin) * m->gain;
    if (hystgen_along(m, output) > t->limit[rising]) {
        hystgen_move_to_output(t, m, corner, hystgen_along(m, t->limit[rising]));
        m->here.input = hystgen_along(m, m->here.input) < x ? m->here.input : input;
        m->here.limited = true;
        return m->here.output;
    }
    cap = t->range[rising] < cap ? t->range[rising] : cap;
    m->cap = hystgen_along(m, cap);
    m->next = hystgen_along(m, next < cap ? next : cap);
    if (hystgen_along(m, output) < hystgen_along(m, m->here.output)) { /* by rounding: no move leads back */
        m->next = hystgen_along(m, -HYSTGEN_REAL_MAX);
        m->cap = m->next;
    } else {
        m->here.output = output;
    }
    m->here.k = (uint_least16_t)k;
    m->here.input = input;
    m->here.limited = false;
    return m->here.output;
}

/* Moves on to an input short of `cap`: more plays of the same block follow. */
HYSTGEN_API hystgen_real_t hystgen_move_in_block(const hystgen_curve_t *t, hystgen_plays_t *m, hystgen_corner_t *corner,
                                                 hystgen_real_t input)
{
    const hystgen_real_t way = hystgen_along(m, input - m->from);
    unsigned int k = m->here.k;
    unsigned int steps = 8; /* for more of them, bisection is faster */
    while (steps > 0 && way > t->segment[k + 1u].way) {
        ++k;
        --steps;
    }
    const hystgen_segment_t *s = &t->segment[k];
    const hystgen_real_t begin = m->from + hystgen_along(m, s->way);
    const hystgen_real_t start = m->base + hystgen_along(m, s->reach);
    const hystgen_real_t output = start + (input - begin) * s->gain;
    if (steps == 0 || hystgen_along(m, output - m->here.output) < 0) {
        return hystgen_move_to_input(t, m, corner, input);
    }
    const hystgen_real_t next = m->from + hystgen_along(m, s[1].way);
    m->next = hystgen_along(m, next - m->cap) < 0 ? next : m->cap;
    m->begin = begin;
    m->start = start;
    m->gain = s->gain;
    m->here.k = (uint_least16_t)k;
    m->here.input = input;
    m->here.output = output;
    return output;
}

/* The sum of the plays for the next input; a NaN moves nothing. */
HYSTGEN_API hystgen_real_t hystgen_plays_step(const hystgen_curve_t *t, hystgen_plays_t *m, hystgen_corner_t *corner,
                                              hystgen_real_t input)
{
    if (m->here.rising ? input > m->here.input : input < m->here.input) {
        if (m->here.rising ? input < m->next : input > m->next) {
            m->here.input = input;
            m->here.output = m->start + (input - m->begin) * m->gain;
            return m->here.output;
        }
        if (m->here.rising ? input < m->cap : input > m->cap) {
            return hystgen_move_in_block(t, m, corner, input);
        }
    }
    if (input < m->here.input || input > m->here.input) {
        return hystgen_move_to_input(t, m, corner, input);
    }
    return m->here.output;
}

/* Start memory, the direction rising. Each play at rest is a block of its own, as if a move had left it that ended where
   the play begins to follow, on a side that the limits allow. */
HYSTGEN_API void hystgen_start(const hystgen_curve_t *t, hystgen_plays_t *m, hystgen_corner_t *corner,
                               const hystgen_start_t *start)
{
    hystgen_place_t p = {start->input, start->output, 0, start->depth, true, false};
    for (unsigned int i = 0; i < start->depth; ++i) {
        corner[i] = start->corner[i];
    }
    for (unsigned int k = corner[start->depth - 1u].top - 1u; k > 0; --k) {
        const hystgen_real_t way = t->segment[k].way * HYSTGEN_HALF;
        const hystgen_real_t reach = t->segment[k].reach * HYSTGEN_HALF;
        p.rising = start->output + reach <= t->limit[1];
        p.k = (uint_least16_t)k;
        p.input = start->input + (p.rising ? way : -way);
        p.output = start->output + (p.rising ? reach : -reach);
        hystgen_leave_corner(t, &p, corner);
    }
    p.rising = true;
    p.k = 0;
    p.input = start->input;
    p.output = start->output;
    hystgen_put(m, &p);
}
