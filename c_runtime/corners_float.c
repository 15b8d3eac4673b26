#include "hystgen_runtime.h"

/* x as the present move sees it: a falling move is a rising one with all signs changed. */
static inline hystgen_real_t hystgen_along(const hystgen_plays_t *m, hystgen_real_t x)
{
#if HYSTGEN_SOFT_FLOAT
    return m->here.rising ? x : -x;
#else
    return m->sign * x;
#endif
}

/* Puts the plays where there is no line to go on along: the next sample searches. */
HYSTGEN_KERNEL void hystgen_put(hystgen_plays_t *m, const hystgen_place_t *place)
{
    m->here = *place;
    m->sign = (hystgen_real_t)(place->rising ? 1 : -1);
    m->next = hystgen_along(m, -HYSTGEN_REAL_MAX);
    m->cap = m->next;
}

/* Leaves a corner here. A block whose last play follows beyond the limit only is never passed. */
HYSTGEN_APART void hystgen_leave_corner(const hystgen_curve_t *t, hystgen_plays_t *m, hystgen_corner_t *corner)
{
    const hystgen_segment_t *s = &t->segment[m->here.k];
    const hystgen_real_t input = hystgen_along(m, m->here.input);
    const hystgen_real_t room = t->limit[!m->here.rising] + hystgen_along(m, m->here.output);
    hystgen_corner_t *c = &corner[m->here.depth];
    c->output = m->here.output;
    c->pass[m->here.rising] = input;
    c->pass[!m->here.rising] = s->reach > room ? HYSTGEN_REAL_MAX : s->way - input;
    c->top = m->here.k;
    c->rose = m->here.rising;
    m->here.depth = (uint_least16_t)(m->here.depth + 1u);
}

static void hystgen_turn_back(const hystgen_curve_t *t, hystgen_plays_t *m, hystgen_corner_t *corner)
{
    if (m->here.k > 0) {
        hystgen_leave_corner(t, m, corner);
        m->here.k = 0;
    }
    m->here.rising = !m->here.rising;
    m->sign = -m->sign;
}

/* The last of segments k .. last that begins before `way`; `step` is the way, or the reach, of segment 1. */
HYSTGEN_APART unsigned int hystgen_find_segment(const hystgen_real_t *step, unsigned int k, unsigned int last,
                                                hystgen_real_t way)
{
    while (k < last) {
        const unsigned int middle = (k + last) / 2;
        const bool before = way > step[4u * middle];
        k = before ? middle + 1u : k;
        last = before ? last : middle;
    }
    return k;
}

/* Sets the line of a segment of the block that counts from `from` and `base`. */
static inline void hystgen_set_line(hystgen_plays_t *m, const hystgen_segment_t *s)
{
    m->begin = m->from + hystgen_along(m, s->way);
    m->start = m->base + hystgen_along(m, s->reach);
    m->gain = s->gain;
    m->next = m->from + hystgen_along(m, s[1].way);
}

/* Moves the plays to where their sum is `output`, as nearly as floating point can tell. */
HYSTGEN_KERNEL void hystgen_move_to_output(const hystgen_curve_t *t, hystgen_plays_t *m, hystgen_corner_t *corner,
                                           hystgen_real_t output)
{
    if (hystgen_along(m, output) < hystgen_along(m, m->here.output)) {
        hystgen_turn_back(t, m, corner);
    }
    hystgen_place_t p = m->here;
    unsigned int kept = 0; /* bisect the corners: `p.depth` is passed, `kept` is not; the top one is tried first */
    for (unsigned int i = p.depth - 1u; i > kept; i = (kept + p.depth) / 2) {
        const hystgen_real_t reach = corner[i].rose == p.rising ? 0 : t->segment[corner[i].top].reach;
        if (hystgen_along(m, output - corner[i].output) >= reach) {
            p.depth = (uint_least16_t)i;
            p.k = corner[i].top;
        } else {
            kept = i;
        }
    }
    const hystgen_corner_t *c = &corner[kept];
    hystgen_real_t reach = hystgen_along(m, output - c->output);
    p.input = c->pass[p.rising];
    if (c->rose != p.rising) {
        p.k = (uint_least16_t)hystgen_find_segment(&t->segment[1].reach, p.k, c->top - 1u, reach);
        reach = reach - t->segment[p.k].reach;
        p.input = t->segment[p.k].way - c->pass[!p.rising];
    }
    p.input = hystgen_along(m, p.input + reach * t->segment[p.k].slope);
    p.output = output;
    p.limited = false;
    hystgen_put(m, &p);
}

/* Moves the plays to any input. */
HYSTGEN_KERNEL hystgen_real_t hystgen_move_to_input(const hystgen_curve_t *t, hystgen_plays_t *m,
                                                    hystgen_corner_t *corner, hystgen_real_t input)
{
    hystgen_real_t x = hystgen_along(m, input);
    if (x < hystgen_along(m, m->here.input)) {
        hystgen_turn_back(t, m, corner);
        x = -x;
    }
    const bool rising = m->here.rising;
    unsigned int passed = m->here.depth - 1u;
    if (passed > 0 && x >= corner[passed].pass[rising]) {
        for (unsigned int kept = 0; passed - kept > 1u;) { /* bisect: `passed` is passed, `kept` is not */
            const unsigned int middle = (kept + passed) / 2;
            const bool beyond = x >= corner[middle].pass[rising];
            passed = beyond ? middle : passed;
            kept = beyond ? kept : middle;
        }
        m->here.k = corner[passed].top;
        m->here.depth = (uint_least16_t)passed;
    }
    const hystgen_corner_t *c = &corner[m->here.depth - 1u];
    const bool at_once = c->rose == rising; /* all plays of its block begin to follow, when the input is back there */
    const hystgen_real_t from = at_once ? c->pass[rising] : -c->pass[!rising];
    hystgen_real_t cap = from;
    unsigned int k = m->here.k;
    m->from = hystgen_along(m, from);
    m->base = c->output;
    if (at_once) {
        m->begin = m->from;
        m->start = m->base;
        m->gain = t->segment[k].gain;
        m->next = m->from;
    } else {
        const hystgen_real_t room = t->inside[rising] - hystgen_along(m, m->base);
        k = hystgen_find_segment(&t->segment[1].way, k, c->top - 1u, x - from);
        hystgen_set_line(m, &t->segment[k]);
        cap = from + t->segment[c->top].way;
        if (t->segment[c->top].reach > room) { /* gains fall from segment to segment: the limit lies here or beyond */
            const hystgen_real_t way = (room - t->segment[k].reach) * t->segment[k].slope;
            cap = hystgen_along(m, m->begin) + way < cap ? hystgen_along(m, m->begin) + way : cap;
        }
    }
    const hystgen_real_t output = m->start + (input - m->begin) * m->gain;
    if (hystgen_along(m, output) > t->limit[rising]) {
        hystgen_move_to_output(t, m, corner, hystgen_along(m, t->limit[rising]));
        m->here.input = hystgen_along(m, m->here.input) < x ? m->here.input : input;
        m->here.limited = true;
        return m->here.output;
    }
    if (hystgen_along(m, output) < hystgen_along(m, m->here.output)) { /* by rounding: no move leads back */
        cap = -HYSTGEN_REAL_MAX;
    } else {
        m->here.output = output;
    }
    cap = t->range[rising] < cap ? t->range[rising] : cap;
    m->cap = hystgen_along(m, cap);
    m->next = hystgen_along(m, m->next) < cap ? m->next : m->cap;
    m->here.k = (uint_least16_t)k;
    m->here.input = input;
    m->here.limited = false;
    return m->here.output;
}

/* Moves on to an input short of `cap`: more plays of the same block follow. */
HYSTGEN_KERNEL hystgen_real_t hystgen_move_in_block(const hystgen_curve_t *t, hystgen_plays_t *m,
                                                    hystgen_corner_t *corner, hystgen_real_t input)
{
    const hystgen_real_t way = hystgen_along(m, input - m->from);
    const unsigned int last = m->here.k + 8u; /* farther on, bisection is faster */
    unsigned int k = m->here.k;
    while (k < last && way > t->segment[k + 1u].way) {
        ++k;
    }
    hystgen_set_line(m, &t->segment[k]);
    const hystgen_real_t output = m->start + (input - m->begin) * m->gain;
    if (k == last || hystgen_along(m, output - m->here.output) < 0) {
        return hystgen_move_to_input(t, m, corner, input);
    }
    m->next = hystgen_along(m, m->next - m->cap) < 0 ? m->next : m->cap;
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

/* Start memory. Each play is a block of its own, as if left by a move that ended where the play begins to follow. */
HYSTGEN_KERNEL void hystgen_start(const hystgen_curve_t *t, hystgen_plays_t *m, hystgen_corner_t *corner,
                                  const hystgen_start_t *start)
{
    hystgen_place_t p = {start->center[0][0], start->center[0][1], 0, 1, true, false};
    corner[0] = start->bottom;
    for (p.k = (uint_least16_t)(start->bottom.top - 1u); p.k > 0; --p.k) {
        const hystgen_real_t *center = start->center[start->step * p.k];
        p.rising = p.k <= start->risen;
        hystgen_put(m, &p);
        m->here.input = center[0] + hystgen_along(m, t->segment[p.k].way * HYSTGEN_HALF);
        m->here.output = center[1] + hystgen_along(m, t->segment[p.k].reach * HYSTGEN_HALF);
        hystgen_leave_corner(t, m, corner);
        p.depth = m->here.depth;
    }
    p.rising = true;
    hystgen_put(m, &p);
}
