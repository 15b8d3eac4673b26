#include "hystgen_runtime.h"

static bool hystgen_reached(hystgen_reach_t x, hystgen_reach_t level, bool rising)
{
    return rising ? x >= level : x <= level;
}

static bool hystgen_past(hystgen_reach_t x, hystgen_reach_t level, bool rising)
{
    return rising ? x > level : x < level;
}

/* `steps`, a threshold or an output gained, gone on from what a corner holds to where its plays start to follow: two
   after a turn, one from the start, none where the move leads back to where the corner was. */
static hystgen_sum_t hystgen_from(hystgen_sum_t held, int side, hystgen_sum_t steps, bool rising)
{
    if (rising) {
        return side > 0 ? held + (steps + steps) : side == 0 ? held + steps : held;
    }
    return side < 0 ? held - (steps + steps) : side == 0 ? held - steps : held;
}

/* The w at which play k, held by corner c, starts to follow a rising (falling) move. */
static hystgen_reach_t hystgen_activation(const hystgen_tables_t *t, const hystgen_corner_t *c, unsigned int k,
                                          bool rising)
{
    return (hystgen_reach_t)hystgen_from(c->extremum, c->side, t->threshold[k], rising);
}

/* Brings a place's anchor and next up to date after k, depth or the direction have changed. The anchor is measured from
   the corner that holds play k: what is not moved by a move is not computed anew, and rounding does not pile up. */
HYSTGEN_COPIES void hystgen_corners_settle(const hystgen_tables_t *t, hystgen_place_t *p,
                                           const hystgen_corner_t *corner, bool rising)
{
    const unsigned int depth = p->depth;
    const unsigned int k = p->k;
    if (depth > 0) {
        const hystgen_corner_t *c = &corner[depth - 1];
        const hystgen_reach_t e = c->extremum;
        const hystgen_sum_t y = hystgen_held(c);
        const hystgen_play_t *r = &t->threshold[k];
        const hystgen_sum_t *z = &t->start_level[k];
        const int side = c->side;
        if (rising ? side < 0 : side > 0) {
            p->anchor = e;
            p->anchor_output = y;
            p->next = e;
            p->next_output = y;
        } else {
            hystgen_reach_t to_anchor = r[-1];
            hystgen_reach_t to_next = r[0];
            hystgen_sum_t to_anchor_output = z[-1];
            hystgen_sum_t to_next_output = z[0];
            if (side != 0) {
                to_anchor = to_anchor + to_anchor;
                to_next = to_next + to_next;
                to_anchor_output = to_anchor_output + to_anchor_output;
                to_next_output = to_next_output + to_next_output;
            }
            if (rising) {
                p->anchor = e + to_anchor;
                p->anchor_output = y + to_anchor_output;
                p->next = e + to_next;
                p->next_output = y + to_next_output;
            } else {
                p->anchor = e - to_anchor;
                p->anchor_output = y - to_anchor_output;
                p->next = e - to_next;
                p->next_output = y - to_next_output;
            }
        }
    } else { /* every play follows */
        p->anchor = 0;
        p->anchor_output = rising ? -t->all_lift : t->all_lift;
        p->next = rising ? HYSTGEN_REACH_MAX : -HYSTGEN_REACH_MAX;
        p->next_output = rising ? HYSTGEN_SUM_MAX : -HYSTGEN_SUM_MAX;
    }
}

/* First of the rising thresholds k .. high-1 that x has not reached, or high. */
HYSTGEN_COPIES unsigned int hystgen_threshold_not_reached(const hystgen_play_t *step, unsigned int k, unsigned int high,
                                                          hystgen_sum_t x)
{
    while (k < high) {
        const unsigned int middle = (k + high) / 2;
        if (x >= step[middle]) {
            k = middle + 1;
        } else {
            high = middle;
        }
    }
    return k;
}

/* The same where it mostly is one of the first two. */
static unsigned int hystgen_threshold_not_reached_near(const hystgen_play_t *step, unsigned int k, unsigned int high,
                                                       hystgen_sum_t x)
{
    if (k < high && x >= step[k]) {
        ++k;
        if (k < high && x >= step[k]) {
            k = hystgen_threshold_not_reached(step, k + 1, high, x);
        }
    }
    return k;
}

/* Where a move to w leads: corners it leaves of `depth`, returned; *k plays follow then, of which the first ones are
   known to. First the blocks that are passed whole, by bisection, then the plays of one. `onward`: a move that goes on
   mostly takes one or two more plays along. */
HYSTGEN_COPIES unsigned int hystgen_find_by_input(const hystgen_tables_t *t, const hystgen_corner_t *corner,
                                                  unsigned int depth, unsigned int *k, hystgen_play_t w, bool rising,
                                                  bool onward)
{
    unsigned int low = 0;
    unsigned int left = depth;
    while (low < left) {
        const unsigned int middle = (low + left) / 2;
        const hystgen_corner_t *c = &corner[middle];
        const int side = c->side;
        hystgen_sum_t passed = c->extremum;
        if (rising ? side >= 0 : side <= 0) {
            const hystgen_play_t *r = &t->threshold[c->end];
            const hystgen_sum_t steps = side == 0 ? (hystgen_sum_t)r[-1] : (hystgen_sum_t)r[-1] + r[-1];
            passed = rising ? passed + steps : passed - steps;
        }
        if (hystgen_reached(w, (hystgen_reach_t)passed, rising)) {
            left = middle;
            *k = c->end;
        } else {
            low = middle + 1;
        }
    }
    if (left > 0) {
        const hystgen_corner_t *c = &corner[left - 1];
        if (rising ? c->side >= 0 : c->side <= 0) { /* it lets go of its plays one by one, not all at its extremum */
            const hystgen_sum_t on = rising ? (hystgen_sum_t)w - c->extremum : (hystgen_sum_t)c->extremum - w;
            const hystgen_sum_t way = c->side == 0 ? on : hystgen_half(on); /* in the measure of the thresholds */
            *k = onward ? hystgen_threshold_not_reached_near(t->threshold, *k, c->end - 1u, way)
                        : hystgen_threshold_not_reached(t->threshold, *k, c->end - 1u, way);
        }
    }
    return left;
}

/* The corner that held play k-1 until it followed, when a move has left `left` of `depth` corners and k > 1. Where no
   corner is left, as when a move goes on with all plays, it can only be the lowest. */
static const hystgen_corner_t *hystgen_entered_by(const hystgen_corner_t *corner, unsigned int left,
                                                  unsigned int depth, unsigned int k)
{
    return left == 0 || (left < depth && corner[left].end == k) ? &corner[left] : &corner[left - 1];
}

static bool hystgen_turns(const hystgen_memory_t *m, hystgen_play_t w)
{
    return m->here.rising ? w < m->w : w > m->w;
}

/* Whether the place that is known beforehand, if any, is where a move to w ends. */
static bool hystgen_foretold(const hystgen_tables_t *t, const hystgen_memory_t *m, const hystgen_corner_t *corner,
                             hystgen_play_t w)
{
    const hystgen_place_t *there = &m->there;
    bool turned;
    if (there->k == 0) {
        return false;
    }
    turned = hystgen_turns(m, w);
    if (there->rising != (m->here.rising != turned) || hystgen_past(w, there->next, there->rising)) {
        return false;
    }
    if (there->k > 1) {
        const unsigned int depth = turned && m->here.k > 1 ? m->here.depth + 1u : m->here.depth;
        const hystgen_corner_t *owner = hystgen_entered_by(corner, there->depth, depth, there->k);
        return hystgen_reached(w, hystgen_activation(t, owner, there->k - 1u, there->rising), there->rising);
    }
    return true;
}

/* Field by field, since compilers may call memcpy for a whole one. */
HYSTGEN_API void hystgen_copy_place(hystgen_place_t *to, const hystgen_place_t *from)
{
    to->anchor_output = from->anchor_output;
    to->next_output = from->next_output;
    to->anchor = from->anchor;
    to->next = from->next;
    to->k = from->k;
    to->depth = from->depth;
    to->rising = from->rising;
}

/* Memory at rest: every play holds w, nothing has moved yet. */
HYSTGEN_API void hystgen_corners_rest(const hystgen_tables_t *t, hystgen_memory_t *m, hystgen_corner_t *corner,
                                      hystgen_play_t w)
{
    m->w = w;
    m->here.k = 1;
    m->here.depth = 0;
    m->here.rising = true;
    m->there.k = 0;
    m->told = false;
    m->start = 0;
    if (t->n > 0) {
        hystgen_write_corner(t, corner, w, (hystgen_sum_t)w * t->slope[t->n + 1u], t->n + 1u, 0);
        m->here.depth = 1;
        m->start = 1;
    }
    hystgen_corners_settle(t, &m->here, corner, true);
}

/* Memory with a state of its own for each play: one corner a play. */
HYSTGEN_API void hystgen_corners_start(const hystgen_tables_t *t, hystgen_memory_t *m, hystgen_corner_t *corner,
                                       const hystgen_play_t *play)
{
    hystgen_sum_t above = 0;
    unsigned int j;
    m->w = play[0];
    m->here.k = 1;
    m->here.depth = t->n;
    m->here.rising = true;
    m->there.k = 0;
    m->told = false;
    m->start = t->n;
    for (j = 0; j < t->n; ++j) {
        const unsigned int k = t->n - j;
        hystgen_write_corner(t, &corner[j], play[k], (hystgen_sum_t)play[k] * t->slope[k + 1] + above, k + 1, 0);
        above = above + (hystgen_sum_t)play[k] * (t->slope[k + 1] - t->slope[k]);
    }
    hystgen_corners_settle(t, &m->here, corner, true);
}

/* Output of the play sum for the memory as it is. */
HYSTGEN_API hystgen_sum_t hystgen_corners_output(const hystgen_tables_t *t, const hystgen_memory_t *m)
{
    return m->here.anchor_output + ((hystgen_sum_t)m->w - m->here.anchor) * t->slope[m->here.k];
}

/* Leaves the corner of turning back above those that are held; until then w has risen, or fallen. */
HYSTGEN_COPIES void hystgen_push_corner(const hystgen_tables_t *t, hystgen_memory_t *m, hystgen_corner_t *corner,
                                        bool risen)
{
    hystgen_leave_corner(t, m, corner, hystgen_corners_output(t, m), risen);
}

/* A move to w that turns, from where p tells of the plays to where it does at its end. */
HYSTGEN_COPIES void hystgen_corners_turn(const hystgen_tables_t *t, hystgen_memory_t *m, hystgen_corner_t *corner,
                                         hystgen_play_t w, hystgen_place_t *p, bool rising)
{
    unsigned int depth = p->depth;
    unsigned int k = 1;
    bool takes_along;
    if (p->k > 1) { /* a corner that owns no play but the input itself is none */
        hystgen_push_corner(t, m, corner, !rising); /* the plays that followed stay where they are */
        depth = depth + 1;
        takes_along =
            hystgen_past(w, (hystgen_reach_t)hystgen_from(m->w, rising ? 1 : -1, t->threshold[1], rising), rising);
    } else {
        takes_along = depth > 0 && hystgen_past(w, hystgen_activation(t, &corner[depth - 1], 1, rising), rising);
    }
    if (takes_along) {
        k = 2; /* right at its activation it would not follow yet */
        depth = hystgen_find_by_input(t, corner, depth, &k, w, rising, false);
    }
    p->k = (uint_least16_t)k;
    p->depth = (uint_least16_t)depth;
    p->rising = rising;
    hystgen_corners_settle(t, p, corner, rising);
}

/* The same of a move that goes on. */
HYSTGEN_COPIES void hystgen_corners_go_on(const hystgen_tables_t *t, const hystgen_corner_t *corner, hystgen_play_t w,
                                          hystgen_place_t *p, bool rising)
{
    if (hystgen_past(w, p->next, rising)) {
        unsigned int k = p->k + 1u;
        p->depth = (uint_least16_t)hystgen_find_by_input(t, corner, p->depth, &k, w, rising, true);
        p->k = (uint_least16_t)k;
        hystgen_corners_settle(t, p, corner, rising);
    }
}

/* Takes a place, where the plays are before a move, to where the move to w ends. */
HYSTGEN_API void hystgen_corners_go(const hystgen_tables_t *t, hystgen_memory_t *m, hystgen_corner_t *corner,
                                    hystgen_play_t w, hystgen_place_t *p)
{
    if (p->rising) {
        if (w < m->w) {
            hystgen_corners_turn(t, m, corner, w, p, false);
        } else {
            hystgen_corners_go_on(t, corner, w, p, true);
        }
    } else {
        if (w > m->w) {
            hystgen_corners_turn(t, m, corner, w, p, true);
        } else {
            hystgen_corners_go_on(t, corner, w, p, false);
        }
    }
}

/* Moves the input of the plays to w. */
HYSTGEN_API void hystgen_corners_absorb(const hystgen_tables_t *t, hystgen_memory_t *m, hystgen_corner_t *corner,
                                        hystgen_play_t w)
{
    if (m->told || hystgen_foretold(t, m, corner, w)) {
        hystgen_copy_place(&m->here, &m->there);
        m->told = false;
    } else {
        hystgen_corners_go(t, m, corner, w, &m->here);
    }
    m->w = w;
    m->there.k = 0;
}

/* Finds beforehand where a move to w ends. Moves nothing; the free slot above the corners is scratch space. */
HYSTGEN_API void hystgen_corners_foretell(const hystgen_tables_t *t, hystgen_memory_t *m, hystgen_corner_t *corner,
                                          hystgen_play_t w)
{
    if (!hystgen_foretold(t, m, corner, w)) {
        hystgen_copy_place(&m->there, &m->here);
        hystgen_corners_go(t, m, corner, w, &m->there);
    }
}
