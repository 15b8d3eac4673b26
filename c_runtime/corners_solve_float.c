#include "hystgen_runtime.h"

static void hystgen_write_place(hystgen_place_t *p, hystgen_real_t anchor_output, hystgen_real_t next_output,
                                hystgen_real_t anchor, hystgen_real_t next, unsigned int k, unsigned int depth,
                                bool rising)
{
    p->anchor_output = anchor_output;
    p->next_output = next_output;
    p->anchor = anchor;
    p->next = next;
    p->k = (uint_least16_t)k;
    p->depth = (uint_least16_t)depth;
    p->rising = rising;
}

/* Where a rising move to `output` ends, of which k plays follow and `left` corners hold the others, `end`
   being the first play beyond what was left, if any was: fills in the place, and returns the input of the plays there.
   Rounding is kept from leading out of that place: then the plays that follow are those that will; *room is false
   where it is too narrow for that. It may lead back to the w before, or behind it, which the caller looks at. `within`:
   a w beyond the input `limit` of the plays has a place that ends there at the latest, and *limited tells of it. */
HYSTGEN_COPIES hystgen_real_t hystgen_rise_to(const hystgen_tables_t *t, hystgen_memory_t *m,
                                             const hystgen_corner_t *corner, unsigned int left, unsigned int k,
                                             unsigned int end, hystgen_real_t output, bool within,
                                             hystgen_real_t limit, bool *room, bool *limited)
{
    hystgen_real_t w;
    hystgen_real_t first;
    hystgen_real_t level;
    hystgen_real_t next;
    hystgen_real_t next_level;
    const hystgen_real_t *r = &t->threshold[k];
    const hystgen_real_t last = r[-1];
    if (left > 0) {
        const hystgen_corner_t *c = &corner[left - 1];
        const hystgen_real_t e = c->extremum;
        if (c->side < 0) { /* all its plays start to follow there */
            first = e;
            level = c->pass[1];
            next = e;
            next_level = level;
        } else {
            const hystgen_real_t y = c->pass[0]; /* with its sign changed */
            const hystgen_real_t *z = &t->start_level[k];
            if (c->side != 0) {
                first = e + (last + last);
                level = (z[-1] + z[-1]) - y;
                next = e + (r[0] + r[0]);
                next_level = (z[0] + z[0]) - y;
            } else {
                first = e + last;
                level = z[-1] - y;
                next = e + r[0];
                next_level = z[0] - y;
            }
        }
    } else { /* every play follows */
        first = 0;
        level = -t->all_lift;
        next = HYSTGEN_REACH_MAX;
        next_level = HYSTGEN_SUM_MAX;
    }
    w = first + (output - level) * t->inverse_slope[k];
    if (within && w > limit) {
        hystgen_write_place(&m->there, level, next_level, first, next < limit ? limit : next, k, left, true);
        *limited = true;
        return w;
    }
    if (w > next) {
        w = next;
    } else {
        hystgen_real_t least = first;
        if (k == end) { /* the last one taken along was held by a corner that was left */
            least = hystgen_from(corner[left].extremum, corner[left].side, last, true);
        }
        if (w < least && k > 1) { /* later answers of the same move must not lie before this one */
            w = least;
            first = least;
            level = output;
            *room = !(least > next);
        }
    }
    hystgen_write_place(&m->there, level, next_level, first, next, k, left, true);
    return w;
}

/* The same for a falling move. */
HYSTGEN_COPIES hystgen_real_t hystgen_fall_to(const hystgen_tables_t *t, hystgen_memory_t *m,
                                             const hystgen_corner_t *corner, unsigned int left, unsigned int k,
                                             unsigned int end, hystgen_real_t output, bool within,
                                             hystgen_real_t limit, bool *room, bool *limited)
{
    hystgen_real_t w;
    hystgen_real_t first;
    hystgen_real_t level;
    hystgen_real_t next;
    hystgen_real_t next_level;
    const hystgen_real_t *r = &t->threshold[k];
    const hystgen_real_t last = r[-1];
    if (left > 0) {
        const hystgen_corner_t *c = &corner[left - 1];
        const hystgen_real_t e = c->extremum;
        if (c->side > 0) { /* all its plays start to follow there */
            first = e;
            level = -c->pass[0];
            next = e;
            next_level = level;
        } else {
            const hystgen_real_t y = c->pass[1];
            const hystgen_real_t *z = &t->start_level[k];
            if (c->side != 0) {
                first = e - (last + last);
                level = y - (z[-1] + z[-1]);
                next = e - (r[0] + r[0]);
                next_level = y - (z[0] + z[0]);
            } else {
                first = e - last;
                level = y - z[-1];
                next = e - r[0];
                next_level = y - z[0];
            }
        }
    } else { /* every play follows */
        first = 0;
        level = t->all_lift;
        next = -HYSTGEN_REACH_MAX;
        next_level = -HYSTGEN_SUM_MAX;
    }
    w = first + (output - level) * t->inverse_slope[k];
    if (within && w < limit) {
        hystgen_write_place(&m->there, level, next_level, first, next > limit ? limit : next, k, left, false);
        *limited = true;
        return w;
    }
    if (w < next) {
        w = next;
    } else {
        hystgen_real_t least = first;
        if (k == end) { /* the last one taken along was held by a corner that was left */
            least = hystgen_from(corner[left].extremum, corner[left].side, last, false);
        }
        if (w > least && k > 1) { /* later answers of the same move must not lie before this one */
            w = least;
            first = least;
            level = output;
            *room = !(least < next);
        }
    }
    hystgen_write_place(&m->there, level, next_level, first, next, k, left, false);
    return w;
}

/* A rising move to `output`, of which k plays are known to follow and `depth` corners hold the others: fills in the place where it ends, and returns the input of the plays there. */
HYSTGEN_API hystgen_real_t hystgen_corners_rise(const hystgen_tables_t *t, hystgen_memory_t *m,
                                                const hystgen_corner_t *corner, unsigned int depth, unsigned int k,
                                                hystgen_real_t output, bool *room)
{
    bool limited = false; /* stays so */
    unsigned int end;
    const unsigned int left = hystgen_corners_find(t, corner, m->start, depth, &k, &end, output, true);
    return hystgen_rise_to(t, m, corner, left, k, end, output, false, 0, room, &limited);
}

/* A falling move to `output`, of which k plays are known to follow and `depth` corners hold the others: fills in the place where it ends, and returns the input of the plays there. */
HYSTGEN_API hystgen_real_t hystgen_corners_fall(const hystgen_tables_t *t, hystgen_memory_t *m,
                                                const hystgen_corner_t *corner, unsigned int depth, unsigned int k,
                                                hystgen_real_t output, bool *room)
{
    bool limited = false; /* stays so */
    unsigned int end;
    const unsigned int left = hystgen_corners_find(t, corner, m->start, depth, &k, &end, -output, false);
    return hystgen_fall_to(t, m, corner, left, k, end, output, false, 0, room, &limited);
}

/* The same where it may lead to the input `limit` of the plays, that of a limit of the drive, which comes first only
   where `output` lies beyond `beyond`. Then the place is the limit's, and *limited, which is false before, tells so. Else
   a w beyond the limit is so by rounding alone. */
HYSTGEN_API hystgen_real_t hystgen_corners_rise_within(const hystgen_tables_t *t, hystgen_memory_t *m,
                                                       const hystgen_corner_t *corner, unsigned int depth,
                                                       unsigned int k, hystgen_real_t output, hystgen_real_t beyond,
                                                       hystgen_real_t limit, bool *room, bool *limited)
{
    unsigned int end;
    const unsigned int most = m->start + 1u;
    unsigned int left;
    if (output > beyond && (depth <= most || output >= corner[most].pass[1])) {
        left = hystgen_corners_find_within(t, corner, m->start, depth, &k, &end, output, limit, true);
        return hystgen_rise_to(t, m, corner, left, k, end, output, true, limit, room, limited);
    }
    left = hystgen_corners_find(t, corner, m->start, depth, &k, &end, output, true);
    return hystgen_rise_to(t, m, corner, left, k, end, output, false, limit, room, limited);
}

HYSTGEN_API hystgen_real_t hystgen_corners_fall_within(const hystgen_tables_t *t, hystgen_memory_t *m,
                                                       const hystgen_corner_t *corner, unsigned int depth,
                                                       unsigned int k, hystgen_real_t output, hystgen_real_t beyond,
                                                       hystgen_real_t limit, bool *room, bool *limited)
{
    unsigned int end;
    const unsigned int most = m->start + 1u;
    unsigned int left;
    if (output < beyond && (depth <= most || -output >= corner[most].pass[0])) {
        left = hystgen_corners_find_within(t, corner, m->start, depth, &k, &end, -output, limit, false);
        return hystgen_fall_to(t, m, corner, left, k, end, output, true, limit, room, limited);
    }
    left = hystgen_corners_find(t, corner, m->start, depth, &k, &end, -output, false);
    return hystgen_fall_to(t, m, corner, left, k, end, output, false, limit, room, limited);
}

/* How a move to `output` begins: with *k plays that follow and *depth corners that hold the others, *rising or falling;
   a turn leaves its corner in the free slot above those that are held, which is scratch space. Or false, where no more
   plays are taken along; then *w is the input of the plays. Moves nothing. */
HYSTGEN_API bool hystgen_corners_begin(const hystgen_tables_t *t, hystgen_memory_t *m, hystgen_corner_t *corner,
                                       hystgen_real_t output, unsigned int *depth, unsigned int *k, bool *rising,
                                       hystgen_real_t *w)
{
    const hystgen_place_t *here = &m->here;
    *depth = here->depth;
    *k = here->k + 1u;
    *rising = here->rising;
    if (here->rising ? output < here->next_output : output > here->next_output) {
        *w = here->anchor + (output - here->anchor_output) * t->inverse_slope[here->k];
        if (here->rising ? *w >= m->w : *w <= m->w) {
            m->there.k = 0;
            *w = hystgen_reached(*w, here->next, here->rising) ? here->next : *w;
            return false;
        }
        if (here->k > 1) { /* the move turns back */
            hystgen_push_corner(t, m, corner, here->rising);
            *depth = *depth + 1;
        }
        *k = 1;
        *rising = !here->rising;
    }
    return true;
}

/* The analytic inverse asked of the same memory: the input of the plays that gives `output`. Moves nothing, but leaves
   word for the next absorb of where the answer lies. */
HYSTGEN_API hystgen_real_t hystgen_corners_solve(const hystgen_tables_t *t, hystgen_memory_t *m,
                                                 hystgen_corner_t *corner, hystgen_real_t output)
{
    unsigned int depth;
    unsigned int k;
    bool rising;
    bool room;
    hystgen_real_t w;
    if (!hystgen_corners_begin(t, m, corner, output, &depth, &k, &rising, &w)) {
        return w;
    }
    w = rising ? hystgen_corners_rise(t, m, corner, depth, k, output, &room)
               : hystgen_corners_fall(t, m, corner, depth, k, output, &room);
    if (!hystgen_past(w, m->w, rising)) { /* rounding is kept from leading back */
        m->there.k = 0;
        return m->w;
    }
    return w;
}
