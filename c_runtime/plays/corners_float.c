/* The plays of engine corners in floating point: a stack of turning points, and the straight line
   of the next outputs. Called by the operators in compensator/corners and by
   chain/corners_float.c. */
#ifndef HYSTGEN_PLAYS_CORNERS_FLOAT_C
#define HYSTGEN_PLAYS_CORNERS_FLOAT_C
#include "hystgen_runtime.h"

HYSTGEN_API void hystgen_copy_place(hystgen_place_t *to, const hystgen_place_t *from) {
    to->input = from->input; /* field by field: for a whole structure a compiler may call memcpy */
    to->output = from->output;
    to->k = from->k;
    to->depth = from->depth;
    to->rising = from->rising;
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

/* Reverses the move; leaves a corner if plays have followed, never passed if its block ends beyond
   the limit. */
HYSTGEN_SWIFT void hystgen_reverse(const hystgen_curve_t *t, hystgen_plays_t *m,
                                   hystgen_corner_t *corner) {
    const hystgen_segment_t *s = &t->segment[m->here.k];
    const hystgen_direction_t on = m->here.rising ? HYSTGEN_RISING : HYSTGEN_FALLING;
    const hystgen_direction_t back = m->here.rising ? HYSTGEN_FALLING : HYSTGEN_RISING;
#ifdef HYSTGEN_HAS_PARAMETERS
    /* whatever the numbers of a block, blocks shrink towards the top, so corners have room */
    if (m->here.k > 0 && m->here.k < corner[m->here.depth - 1].top) {
#else
    if (m->here.k > 0) {
#endif
        const hystgen_real_t x = hystgen_along(m, m->here.input);
        hystgen_corner_t *c = &corner[m->here.depth];
        c->output = m->here.output;
        c->pass[on] = x;
#ifndef HYSTGEN_HAS_NO_LIMIT
        const hystgen_real_t room = t->limit[back] + hystgen_along(m, m->here.output);
        c->pass[back] = hystgen_above(s->reach, room) ? HYSTGEN_REAL_MAX : s->way - x;
#else
        c->pass[back] = s->way - x;
#endif
        c->top = m->here.k;
        c->rose = (uint_least8_t)on;
        m->here.depth = (uint_least16_t)(m->here.depth + 1u);
        m->here.k = 0;
    }
    m->here.rising = !m->here.rising;
    m->limited = false;
    m->sign = -m->sign;
}

/* The same as a function of its own: bytes matter more than time. */
HYSTGEN_APART void hystgen_reverse_apart(const hystgen_curve_t *t, hystgen_plays_t *m,
                                         hystgen_corner_t *corner) {
    hystgen_reverse(t, m, corner);
}

/* The last of `left` segments from k on that begins before a way and, if `both`, a reach. */
static inline unsigned int hystgen_find_segment(const hystgen_curve_t *t, unsigned int k,
                                                unsigned int left, hystgen_real_t way,
                                                hystgen_real_t reach, bool both) {
    unsigned int half = left / 2;
    while (half > 0) { /* bisect */
        const hystgen_segment_t *middle = &t->segment[k + half];
        const bool reached = !both || hystgen_order(reach) > hystgen_order(middle->reach);
        k = reached && hystgen_order(way) > hystgen_order(middle->way) ? k + half : k;
        left -= half;
        half = left / 2;
    }
    return k;
}

/* Moves the plays in the block of c to `input`, or stops them at the sum `output`: in any case if
   `stop`, else if it is a limit and comes first. Both are along the move. True if they stop. */
HYSTGEN_APART bool hystgen_move_or_stop(const hystgen_curve_t *t, hystgen_plays_t *m,
                                        const hystgen_corner_t *c, hystgen_real_t input,
                                        hystgen_real_t output, bool stop) {
    const hystgen_direction_t on = m->here.rising ? HYSTGEN_RISING : HYSTGEN_FALLING;
    const hystgen_direction_t other = m->here.rising ? HYSTGEN_FALLING : HYSTGEN_RISING;
    const hystgen_real_t from = c->pass[other];
    hystgen_real_t cap = c->pass[on];
    hystgen_real_t next = cap;
    hystgen_real_t begin = cap;
    hystgen_real_t start = hystgen_along(m, c->output);
    unsigned int k = m->here.k;
    bool limits = stop; /* the plays may stop in this block */
#ifdef HYSTGEN_HAS_PARAMETERS
    k = k < c->top ? k : c->top - 1u; /* whatever the numbers of a block */
#endif
    if (c->rose != on) { /* plays follow one by one, not the whole block at the corner */
#ifndef HYSTGEN_HAS_NO_LIMIT
        limits = stop || hystgen_above(t->segment[c->top].reach, t->inside[on] - start);
#endif
        k = limits ? hystgen_find_segment(t, k, c->top - k, input + from, output - start, true)
                   : hystgen_find_segment(t, k, c->top - k, input + from, 0, false);
        begin = t->segment[k].way - from;
        start = start + t->segment[k].reach;
    }
    const hystgen_segment_t *s = &t->segment[k];
    m->begin = hystgen_along(m, begin);
    m->start = hystgen_along(m, start);
    m->gain = s->gain;
    m->here.k = (uint_least16_t)k;
    const hystgen_real_t y = stop ? output : start + (input - begin) * s->gain;
#ifndef HYSTGEN_HAS_NO_LIMIT
    if (stop || hystgen_above(y, output)) {
#else
    if (limits) {
#endif
        const hystgen_real_t x = begin + (output - start) * s->slope;
        m->here.input = hystgen_along(m, hystgen_above(input, x) ? x : input);
        m->here.output = hystgen_along(m, output);
        hystgen_forget_line(m);
        return true;
    }
    m->here.input = hystgen_along(m, input);
    m->behind = m->here.input;
    if (c->rose != on) {
        next = s[1].way - from;
        cap = c->rose == HYSTGEN_BOTTOM ? next : cap; /* all plays below its top follow */
#ifndef HYSTGEN_HAS_NO_LIMIT
        /* gains fall: here or beyond */
        cap = limits ? begin + (t->inside[on] - start) * s->slope : cap;
#endif
        m->from_input = -hystgen_along(m, from);
        m->from_output = c->output;
        m->behind = k == 0 && !hystgen_above(from, t->range[other]) ? m->from_input : m->here.input;
    }
    if (hystgen_above(hystgen_along(m, m->here.output), y)) { /* by rounding */
        cap = input;
    } else {
        m->here.output = hystgen_along(m, y);
#ifndef HYSTGEN_HAS_NO_LIMIT
        cap = hystgen_above(cap, t->range[on]) ? t->range[on] : cap;
#endif
    }
    m->cap = hystgen_along(m, cap);
    m->next = hystgen_along(m, hystgen_above(cap, next) ? next : cap);
    return false;
}

/* Moves the plays to the sum `output`, up to rounding. */
HYSTGEN_KERNEL void hystgen_move_to_output(const hystgen_curve_t *t, hystgen_plays_t *m,
                                           hystgen_corner_t *corner, hystgen_real_t output) {
    if (hystgen_above(hystgen_along(m, m->here.output), hystgen_along(m, output))) {
        hystgen_reverse(t, m, corner);
    }
    const hystgen_direction_t on = m->here.rising ? HYSTGEN_RISING : HYSTGEN_FALLING;
    unsigned int kept = 0;
    unsigned int left = m->here.depth;
    while (left > 1u) { /* bisect: the last corner kept is one of `left` from `kept` on */
        const hystgen_corner_t *c = &corner[kept + left / 2];
        const hystgen_real_t reach = c->rose == on ? 0 : t->segment[c->top].reach;
        kept += hystgen_above(reach, hystgen_along(m, output - c->output)) ? left / 2 : 0u;
        left -= left / 2;
    }
    m->here.k = kept + 1u < m->here.depth ? corner[kept + 1u].top : m->here.k;
    m->here.depth = (uint_least16_t)(kept + 1u);
    m->limited = false;
    (void)hystgen_move_or_stop(t, m, &corner[kept], HYSTGEN_REAL_MAX, hystgen_along(m, output),
                               true);
}

/* Moves the plays to any input. True if the limit comes first, where they then stop. */
HYSTGEN_KERNEL bool hystgen_move_to_input(const hystgen_curve_t *t, hystgen_plays_t *m,
                                          hystgen_corner_t *corner, hystgen_real_t input) {
    if (hystgen_above(hystgen_along(m, m->here.input), hystgen_along(m, input))) {
        hystgen_reverse(t, m, corner);
    }
    const hystgen_real_t x = hystgen_along(m, input);
    const hystgen_direction_t on = m->here.rising ? HYSTGEN_RISING : HYSTGEN_FALLING;
    unsigned int kept = m->here.depth - 1u;
    if (kept > 0 && !hystgen_above(corner[kept].pass[on], x)) {
        unsigned int left = kept;
        kept = 0;
        while (left > 1u) { /* bisect: the last corner kept is one of `left` from `kept` on */
            const unsigned int middle = kept + left / 2;
            kept = hystgen_above(corner[middle].pass[on], x) ? middle : kept;
            left -= left / 2;
        }
        m->here.k = corner[kept + 1u].top;
        m->here.depth = (uint_least16_t)(kept + 1u);
    }
    return hystgen_move_or_stop(t, m, &corner[kept], x, t->limit[on], false);
}

/* Moves on, short of `cap`: more plays of the block follow. False if a search would be faster. */
HYSTGEN_SWIFT bool hystgen_move_in_block(const hystgen_curve_t *t, hystgen_plays_t *m,
                                         hystgen_real_t input) {
    const hystgen_real_t way = hystgen_along(m, input - m->from_input);
    const hystgen_segment_t *s = &t->segment[m->here.k + 1u];
    unsigned int more = 1; /* plays that begin to follow */
    while (hystgen_order(way) > hystgen_order(s[1].way)) {
        ++s;
        ++more;
        if (more == 8u) { /* from here on, bisection is faster */
            return false;
        }
    }
    m->begin = m->from_input + hystgen_along(m, s->way);
    m->start = m->from_output + hystgen_along(m, s->reach);
    m->gain = s->gain;
    const hystgen_real_t output = m->start + (input - m->begin) * m->gain;
    if (hystgen_above(hystgen_along(m, m->here.output), hystgen_along(m, output))) {
        return false; /* a step back by rounding */
    }
    const hystgen_real_t next = m->from_input + hystgen_along(m, s[1].way);
    m->next = hystgen_above(hystgen_along(m, m->cap), hystgen_along(m, next)) ? next : m->cap;
    m->here.k = (uint_least16_t)(m->here.k + more);
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
    } else if (on ? hystgen_along(m, input) >= hystgen_along(m, m->cap) ||
                        !hystgen_move_in_block(t, m, input)
                  : hystgen_along(m, input) < hystgen_along(m, m->here.input)) {
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
        hystgen_reverse_apart(t, m, corner);
    }
    m->here.k = 0;
    m->here.rising = true;
    m->sign = 1;
    m->here.input = start->center[0][0];
    m->here.output = start->center[0][1];
    hystgen_forget_line(m);
}

#endif
