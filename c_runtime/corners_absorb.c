#include "hystgen_runtime.h"

/* The w at which a play of threshold r, held by corner c, starts to follow a rising (falling) move. */
static hystgen_reach_t hystgen_activation(const hystgen_corner_t *c, hystgen_play_t threshold, bool rising)
{
    const hystgen_reach_t e = c->extremum;
    const hystgen_reach_t r = threshold;
    if (rising) {
        return c->side > 0 ? e + (r + r) : c->side == 0 ? e + r : e;
    }
    return c->side < 0 ? e - (r + r) : c->side == 0 ? e - r : e;
}

/* The output at that moment: the corner's own, or as far from it as the inverse play's threshold z_k says (36). */
static hystgen_sum_t hystgen_level(const hystgen_tables_t *t, const hystgen_corner_t *c, unsigned int k, bool rising)
{
    const hystgen_sum_t z = t->start_level[k];
    if (rising) {
        return c->side > 0 ? c->output + (z + z) : c->side == 0 ? c->output + z : c->output;
    }
    return c->side < 0 ? c->output - (z + z) : c->side == 0 ? c->output - z : c->output;
}

static bool hystgen_reached(hystgen_reach_t x, hystgen_reach_t level, bool rising)
{
    return rising ? x >= level : x <= level;
}

/* Brings a place's anchor and next up to date after k, depth or the direction have changed. The anchor is measured
   from the corner that holds play k: what is not moved by a move is not computed anew, and rounding does not pile up. */
static void hystgen_corners_settle(const hystgen_tables_t *t, hystgen_place_t *p, const hystgen_corner_t *corner)
{
    if (p->depth > 0) {
        const hystgen_corner_t *c = &corner[p->depth - 1];
        p->anchor = hystgen_activation(c, t->threshold[p->k - 1], p->rising);
        p->anchor_output = hystgen_level(t, c, p->k - 1u, p->rising);
        p->next = hystgen_activation(c, t->threshold[p->k], p->rising);
    } else { /* every play follows */
        p->anchor = 0;
        p->anchor_output = p->rising ? -t->all_lift : t->all_lift;
        p->next = p->rising ? HYSTGEN_REACH_MAX : -HYSTGEN_REACH_MAX;
    }
}

/* How far x lies from what corner c holds, in the measure of the thresholds. */
static hystgen_sum_t hystgen_way(hystgen_sum_t x, hystgen_sum_t since, int side, bool rising)
{
    const hystgen_sum_t d = rising ? x - since : since - x;
    return side == 0 ? d : hystgen_half(d);
}

/* Whether a corner lets go of its plays one by one, and not all of them at its extremum. */
static bool hystgen_opposite(int side, bool rising)
{
    return rising ? side >= 0 : side <= 0;
}

/* First of the rising steps k .. high that x has not reached; high is known to be one. Gallops away from k because
   most moves take one play at a time. */
static unsigned int hystgen_gallop_thresholds(const hystgen_play_t *step, unsigned int k, unsigned int high,
                                              hystgen_sum_t x)
{
    unsigned int stride = 1;
    unsigned int probe = k;
    while (k < high) {
        if (x >= step[probe]) {
            k = probe + 1;
            stride = stride * 2;
        } else {
            high = probe;
        }
        probe = (k + high) / 2;
        if (probe > k + stride - 1) {
            probe = k + stride - 1;
        }
    }
    return k;
}

/* The w from which on plays 0 .. k-1 follow when a move has left `left` of `depth` corners. */
static hystgen_reach_t hystgen_entered(const hystgen_tables_t *t, const hystgen_corner_t *corner, unsigned int left,
                                       unsigned int depth, unsigned int k, bool rising)
{
    const unsigned int owner = left < depth && corner[left].end == k ? left : left - 1;
    return hystgen_activation(&corner[owner], t->threshold[k - 1], rising);
}

/* Whether the place that solving found is where the move has come to. */
static bool hystgen_foretold(const hystgen_tables_t *t, const hystgen_memory_t *m, const hystgen_corner_t *corner)
{
    const hystgen_place_t *there = &m->there;
    return there->rising == m->here.rising && !hystgen_reached(m->w, there->next, there->rising)
        && hystgen_reached(m->w, hystgen_entered(t, corner, there->depth, m->here.depth, there->k, there->rising),
                           there->rising);
}

/* The move has passed `next`: finds the plays that follow now. Whole blocks first, by bisection, then inside one. */
static void hystgen_corners_search(const hystgen_tables_t *t, hystgen_memory_t *m, const hystgen_corner_t *corner)
{
    const hystgen_reach_t w = m->w;
    const bool rising = m->here.rising;
    unsigned int left = m->here.depth; /* corners that stay; those from here on have been passed whole */
    unsigned int k = m->here.k;
    unsigned int low = 0;
    unsigned int probe = left;
    while (low < left) {
        const hystgen_corner_t *c = &corner[probe - 1];
        if (hystgen_reached(w, hystgen_activation(c, t->threshold[c->end - 1], rising), rising)) {
            left = probe - 1;
            k = c->end;
        } else {
            low = probe;
        }
        probe = (low + left + 1) / 2;
    }
    if (left > 0 && hystgen_opposite(corner[left - 1].side, rising)) {
        const hystgen_corner_t *c = &corner[left - 1];
        k = hystgen_gallop_thresholds(t->threshold, k, c->end - 1u, hystgen_way(w, c->extremum, c->side, rising));
    }
    m->here.depth = (uint_least16_t)left;
    m->here.k = (uint_least16_t)k;
    hystgen_corners_settle(t, &m->here, corner);
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
    if (t->n > 0) {
        corner[0].extremum = w;
        corner[0].output = (hystgen_sum_t)w * t->slope[t->n + 1u];
        corner[0].end = (uint_least16_t)(t->n + 1);
        corner[0].side = 0;
        m->here.depth = 1;
    }
    hystgen_corners_settle(t, &m->here, corner);
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
    for (j = 0; j < t->n; ++j) {
        hystgen_corner_t *c = &corner[j];
        const unsigned int k = t->n - j;
        c->extremum = play[k];
        c->output = (hystgen_sum_t)play[k] * t->slope[k + 1] + above;
        above = above + (hystgen_sum_t)play[k] * (t->slope[k + 1] - t->slope[k]);
        c->end = (uint_least16_t)(k + 1);
        c->side = 0;
    }
    hystgen_corners_settle(t, &m->here, corner);
}

/* Output of the play sum for the memory as it is. */
HYSTGEN_API hystgen_sum_t hystgen_corners_output(const hystgen_tables_t *t, const hystgen_memory_t *m)
{
    return m->here.anchor_output + ((hystgen_sum_t)m->w - m->here.anchor) * t->slope[m->here.k];
}

/* Writes the corner that turning back leaves into slot c. */
static void hystgen_push_corner(const hystgen_tables_t *t, const hystgen_memory_t *m, hystgen_corner_t *c)
{
    c->extremum = m->w;
    c->output = hystgen_corners_output(t, m);
    c->end = m->here.k;
    c->side = m->here.rising ? -1 : 1;
}

/* Moves the input of the plays to w. */
HYSTGEN_API void hystgen_corners_absorb(const hystgen_tables_t *t, hystgen_memory_t *m, hystgen_corner_t *corner,
                                        hystgen_play_t w)
{
    const bool turned = m->here.rising ? w < m->w : w > m->w;
    if (turned) {       /* the plays that followed stay where they are */
        if (m->here.k > 1) { /* a corner that owns no play but the input itself is none */
            hystgen_push_corner(t, m, &corner[m->here.depth]);
            m->here.depth = (uint_least16_t)(m->here.depth + 1u);
        }
        m->here.rising = !m->here.rising;
        m->here.k = 1;
    }
    m->w = w;
    if (m->there.k > m->here.k && hystgen_foretold(t, m, corner)) {
        m->here = m->there;
    } else {
        if (turned) {
            hystgen_corners_settle(t, &m->here, corner);
        }
        if (hystgen_reached(w, m->here.next, m->here.rising)) {
            hystgen_corners_search(t, m, corner);
        }
    }
    m->there.k = 0;
}
