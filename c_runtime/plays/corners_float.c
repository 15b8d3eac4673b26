/* The plays of engine corners in floating point: a stack of turning points, and the straight line
   of the next outputs. Called by the operators in compensator/corners and by
   chain/corners_float.c. */
#include "hystgen_runtime.h"

HYSTGEN_API void hystgen_copy_place(hystgen_place_t *to, const hystgen_place_t *from) {
    to->input = from->input; /* field by field: for a whole structure a compiler may call memcpy */
    to->output = from->output;
    to->k = from->k;
    to->depth = from->depth;
    to->rising = from->rising;
}

/* The direction of a rising or falling move. */
static inline hystgen_direction_t hystgen_direction(bool rising) {
    return rising ? HYSTGEN_RISING : HYSTGEN_FALLING;
}

/* x as seen along the present move: a falling move is a rising one with all signs changed. */
static inline hystgen_real_t hystgen_along(const hystgen_plays_t *m, hystgen_real_t x) {
#ifdef HYSTGEN_SOFT_FLOAT
    return m->here.rising ? x : -x;
#else
    return m->sign * x;
#endif
}

/* Discards the line of the last outputs, so that the next sample searches. */
static void hystgen_forget_line(hystgen_plays_t *m) {
    m->next = m->here.input;
    m->cap = m->here.input;
    m->behind = m->here.input;
}

/* Puts the plays back to an earlier place, before any corner left since then. */
HYSTGEN_API void hystgen_take_back(hystgen_plays_t *m, const hystgen_place_t *to) {
    hystgen_copy_place(&m->here, to);
    m->sign = (hystgen_real_t)(to->rising ? 1 : -1);
    hystgen_forget_line(m);
}

/* Leaves a corner here. A block whose last play follows only beyond the limit is never passed. */
HYSTGEN_APART void hystgen_leave_corner(const hystgen_curve_t *t, hystgen_plays_t *m,
                                        hystgen_corner_t *corner) {
    const hystgen_segment_t *s = &t->segment[m->here.k];
    const hystgen_direction_t on = hystgen_direction(m->here.rising);
    const hystgen_direction_t back = hystgen_direction(!m->here.rising);
    const hystgen_real_t room = t->limit[back] + hystgen_along(m, m->here.output);
    hystgen_corner_t *c = &corner[m->here.depth];
    c->output = m->here.output;
    c->pass[on] = hystgen_along(m, m->here.input);
    c->pass[back] = s->reach > room ? HYSTGEN_REAL_MAX : s->way - c->pass[on];
    c->top = m->here.k;
    c->rose = (uint_least8_t)on;
    m->here.depth = (uint_least16_t)(m->here.depth + 1u);
}

static void hystgen_turn_back(const hystgen_curve_t *t, hystgen_plays_t *m,
                              hystgen_corner_t *corner) {
    if (m->here.k > 0) {
        hystgen_leave_corner(t, m, corner);
        m->here.k = 0;
    }
    m->here.rising = !m->here.rising;
    m->limited = false;
    m->sign = -m->sign;
}

/* Last of segments k .. end - 1 that begins before x, a way or a reach; segment k always does. */
static inline unsigned int hystgen_find_segment(const hystgen_segment_t *segment, unsigned int k,
                                                unsigned int end, hystgen_real_t x, bool by_reach) {
    unsigned int middle = (k + end) / 2;
    while (middle > k) { /* bisect: segment k begins before x, segment `end` does not */
        const bool before = x > (by_reach ? segment[middle].reach : segment[middle].way);
        k = before ? middle : k;
        end = before ? end : middle;
        middle = (k + end) / 2;
    }
    return k;
}

/* Ends the move in the top corner's block, at sum `output` or at `input`, whichever comes first. */
HYSTGEN_KERNEL void hystgen_stop_in_block(const hystgen_curve_t *t, hystgen_plays_t *m,
                                          const hystgen_corner_t *corner, hystgen_real_t output,
                                          hystgen_real_t input) {
    const hystgen_corner_t *c = &corner[m->here.depth - 1u];
    hystgen_real_t reach = hystgen_along(m, output - c->output);
    const hystgen_direction_t on = hystgen_direction(m->here.rising);
    hystgen_real_t x = c->pass[on];
    unsigned int k = m->here.k;
    if (c->rose != on) {
        k = hystgen_find_segment(t->segment, k, c->top, reach, true);
        reach = reach - t->segment[k].reach;
        x = t->segment[k].way - c->pass[hystgen_direction(!m->here.rising)];
    }
    x = x + reach * t->segment[k].slope;
    m->here.input = x < hystgen_along(m, input) ? hystgen_along(m, x) : input;
    m->here.output = output;
    m->here.k = (uint_least16_t)k;
    hystgen_forget_line(m);
}

/* Moves the plays to the sum `output`, up to rounding. */
HYSTGEN_KERNEL void hystgen_move_to_output(const hystgen_curve_t *t, hystgen_plays_t *m,
                                           hystgen_corner_t *corner, hystgen_real_t output) {
    if (hystgen_along(m, output) < hystgen_along(m, m->here.output)) {
        hystgen_turn_back(t, m, corner);
    }
    const hystgen_direction_t on = hystgen_direction(m->here.rising);
    unsigned int kept = 0; /* bisect: `here.depth` is passed, `kept` is not */
    while (m->here.depth - kept > 1u) {
        const unsigned int middle = (kept + m->here.depth) / 2;
        const hystgen_real_t reach =
            corner[middle].rose == on ? 0 : t->segment[corner[middle].top].reach;
        const bool passed = hystgen_along(m, output - corner[middle].output) >= reach;
        m->here.depth = passed ? (uint_least16_t)middle : m->here.depth;
        m->here.k = passed ? corner[middle].top : m->here.k;
        kept = passed ? kept : middle;
    }
    m->limited = false;
    hystgen_stop_in_block(t, m, corner, output, hystgen_along(m, HYSTGEN_REAL_MAX));
}

/* Moves the plays to any input. False if the limit comes first; the caller then stops there. */
HYSTGEN_KERNEL bool hystgen_move_to_input(const hystgen_curve_t *t, hystgen_plays_t *m,
                                          hystgen_corner_t *corner, hystgen_real_t input) {
    if (hystgen_along(m, input) < hystgen_along(m, m->here.input)) {
        hystgen_turn_back(t, m, corner);
    }
    const hystgen_real_t x = hystgen_along(m, input);
    const hystgen_direction_t on = hystgen_direction(m->here.rising);
    const hystgen_direction_t other = hystgen_direction(!m->here.rising);
    const hystgen_corner_t *c = &corner[m->here.depth - 1u];
    if (m->here.depth > 1u && x >= c->pass[on]) {
        unsigned int kept = 0; /* bisect: `passed` is passed, `kept` is not */
        unsigned int passed = m->here.depth - 1u;
        while (passed - kept > 1u) {
            const unsigned int middle = (kept + passed) / 2;
            const bool beyond = x >= corner[middle].pass[on];
            passed = beyond ? middle : passed;
            kept = beyond ? kept : middle;
        }
        m->here.k = corner[passed].top;
        m->here.depth = (uint_least16_t)passed;
        c = &corner[kept];
    }
    hystgen_real_t cap = c->pass[on];
    hystgen_real_t next = cap;
    hystgen_real_t begin = cap;
    hystgen_real_t start = hystgen_along(m, c->output);
    unsigned int k = m->here.k;
    m->behind = input;
    if (c->rose != on) { /* plays follow one by one, not the whole block at the corner */
        const hystgen_real_t from = c->pass[other];
        const hystgen_real_t room = t->inside[on] - start;
        k = hystgen_find_segment(t->segment, k, c->top, x + from, false);
        const hystgen_segment_t *s = &t->segment[k];
        begin = s->way - from;
        start = start + s->reach;
        next = s[1].way - from;
        cap = c->rose == HYSTGEN_BOTTOM ? next : cap; /* all plays below its top follow */
        if (t->segment[c->top].reach > room) { /* gains fall, so the limit lies here or beyond */
            cap = begin + (room - s->reach) * s->slope;
        }
        m->from_input = -hystgen_along(m, from);
        m->from_output = c->output;
        m->behind = k == 0 && from <= t->range[other] ? m->from_input : input; /* same line back */
    }
    m->begin = hystgen_along(m, begin);
    m->start = hystgen_along(m, start);
    m->gain = t->segment[k].gain;
    const hystgen_real_t output = m->start + (input - m->begin) * m->gain;
    if (hystgen_along(m, output) > t->limit[on]) {
        return false;
    }
    const bool back = hystgen_along(m, output) < hystgen_along(m, m->here.output); /* by rounding */
    m->here.output = back ? m->here.output : output;
    const hystgen_real_t end = t->range[on] < cap ? t->range[on] : cap;
    cap = back ? x : end;
    m->cap = hystgen_along(m, cap);
    m->next = hystgen_along(m, next < cap ? next : cap);
    m->here.k = (uint_least16_t)k;
    m->here.input = input;
    return true;
}

/* Moves on, short of `cap`: more plays of the block follow. False if a search would be faster. */
HYSTGEN_KERNEL bool hystgen_move_in_block(const hystgen_curve_t *t, hystgen_plays_t *m,
                                          hystgen_real_t input) {
    const hystgen_real_t way = hystgen_along(m, input - m->from_input);
    unsigned int k = m->here.k;
    const unsigned int many = k + 8u; /* beyond these, bisection is faster */
    do {
        ++k;
    } while (k < many && way > t->segment[k + 1u].way);
    const hystgen_segment_t *s = &t->segment[k];
    m->begin = m->from_input + hystgen_along(m, s->way);
    m->start = m->from_output + hystgen_along(m, s->reach);
    m->gain = s->gain;
    const hystgen_real_t output = m->start + (input - m->begin) * m->gain;
    if (k == many || hystgen_along(m, output - m->here.output) < 0) {
        return false;
    }
    const hystgen_real_t next = m->from_input + hystgen_along(m, s[1].way);
    m->next = hystgen_along(m, next - m->cap) < 0 ? next : m->cap;
    m->here.k = (uint_least16_t)k;
    m->here.input = input;
    m->here.output = output;
    return true;
}

/* The sum of the plays for the next input; a NaN moves nothing. */
HYSTGEN_API hystgen_real_t hystgen_plays_step(const hystgen_curve_t *t, hystgen_plays_t *m,
                                              hystgen_corner_t *corner, hystgen_real_t input) {
    const bool on = m->here.rising ? input > m->here.input : input < m->here.input;
    const hystgen_real_t end = on ? m->next : m->behind; /* of the line, in this direction */
    const bool within = on == m->here.rising ? input < end : input > end;
    if (within && (on || m->here.k == 0)) {
        m->here.input = input;
        m->here.output = m->start + (input - m->begin) * m->gain;
    } else if (on ? hystgen_along(m, input - m->cap) >= 0 || !hystgen_move_in_block(t, m, input)
                  : hystgen_along(m, input - m->here.input) < 0) {
        (void)hystgen_move_to_input(t, m, corner, input);
    }
    return m->here.output;
}

/* Start memory. Each play is a block of its own, with a corner where it begins to follow. */
HYSTGEN_KERNEL void hystgen_start(const hystgen_curve_t *t, hystgen_plays_t *m,
                                  hystgen_corner_t *corner, const hystgen_start_t *start) {
    unsigned int k;
    corner[0].output = start->bottom.output;
    corner[0].pass[HYSTGEN_FALLING] = start->bottom.pass[HYSTGEN_FALLING];
    corner[0].pass[HYSTGEN_RISING] = start->bottom.pass[HYSTGEN_RISING];
    corner[0].top = start->bottom.top;
    corner[0].rose = start->bottom.rose;
    m->here.depth = 1;
    for (k = start->bottom.top - 1u; k > 0; --k) {
        const hystgen_real_t *center = start->center[start->step > 0 ? k : 0u];
        m->here.k = (uint_least16_t)k;
        m->here.rising = k <= start->risen;
        m->sign = (hystgen_real_t)(m->here.rising ? 1 : -1);
        m->here.input = center[0] + hystgen_along(m, t->segment[k].way / 2);
        m->here.output = center[1] + hystgen_along(m, t->segment[k].reach / 2);
        hystgen_leave_corner(t, m, corner);
    }
    m->here.k = 0;
    m->here.rising = true;
    m->sign = 1;
    m->here.input = start->center[0][0];
    m->here.output = start->center[0][1];
    hystgen_forget_line(m);
}
