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
   where it is too narrow for that. And from leading back: then the w before is returned, and nothing filled in. */
HYSTGEN_COPIES hystgen_real_t hystgen_rise_to(const hystgen_tables_t *t, hystgen_memory_t *m,
                                             const hystgen_corner_t *corner, unsigned int left, unsigned int k,
                                             unsigned int end, hystgen_real_t output, bool *room)
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
    if (!(w > m->w)) {
        return m->w;
    }
    hystgen_write_place(&m->there, level, next_level, first, next, k, left, true);
    return w;
}

/* The same for a falling move. */
HYSTGEN_COPIES hystgen_real_t hystgen_fall_to(const hystgen_tables_t *t, hystgen_memory_t *m,
                                             const hystgen_corner_t *corner, unsigned int left, unsigned int k,
                                             unsigned int end, hystgen_real_t output, bool *room)
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
    if (!(w < m->w)) {
        return m->w;
    }
    hystgen_write_place(&m->there, level, next_level, first, next, k, left, false);
    return w;
}

/* A rising move to `output`, of which k plays are known to follow and `depth` corners hold the others: fills in the place where it ends, and returns the input of the plays there. */
HYSTGEN_API hystgen_real_t hystgen_corners_rise(const hystgen_tables_t *t, hystgen_memory_t *m,
                                                const hystgen_corner_t *corner, unsigned int depth, unsigned int k,
                                                hystgen_real_t output, bool *room)
{
    unsigned int end;
    const unsigned int left = hystgen_corners_find(t, corner, m->start, depth, &k, &end, output, true);
    return hystgen_rise_to(t, m, corner, left, k, end, output, room);
}

/* A falling move to `output`, of which k plays are known to follow and `depth` corners hold the others: fills in the place where it ends, and returns the input of the plays there. */
HYSTGEN_API hystgen_real_t hystgen_corners_fall(const hystgen_tables_t *t, hystgen_memory_t *m,
                                                const hystgen_corner_t *corner, unsigned int depth, unsigned int k,
                                                hystgen_real_t output, bool *room)
{
    unsigned int end;
    const unsigned int left = hystgen_corners_find(t, corner, m->start, depth, &k, &end, -output, false);
    return hystgen_fall_to(t, m, corner, left, k, end, output, room);
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
    m->there.k = 0;
    return rising ? hystgen_corners_rise(t, m, corner, depth, k, output, &room)
                  : hystgen_corners_fall(t, m, corner, depth, k, output, &room);
}

/* Whether a move to `limit` takes no more plays along: right at the activation of one, it does not follow yet. */
static bool hystgen_takes_none(const hystgen_tables_t *t, const hystgen_memory_t *m, const hystgen_corner_t *corner,
                               unsigned int depth, hystgen_real_t limit, bool rising)
{
    if (m->here.rising == rising) {
        return !hystgen_past(limit, m->here.next, rising);
    }
    return depth > 0 && !hystgen_past(limit, hystgen_activation(t, &corner[depth - 1], 1, rising), rising);
}

/* Fills in the place of a move that ends at a limit of the drive, `limit` as the plays see it: k plays follow then and
   `left` of `depth` corners are left, where it takes any along. */
HYSTGEN_COPIES void hystgen_settle_at(const hystgen_tables_t *t, hystgen_memory_t *m, const hystgen_corner_t *corner,
                                      unsigned int depth, unsigned int left, unsigned int k, hystgen_real_t limit,
                                      bool rising)
{
    hystgen_place_t *p = &m->there;
    if (hystgen_takes_none(t, m, corner, depth, limit, rising)) {
        if (m->here.rising == rising) {
            hystgen_copy_place(p, &m->here);
            return;
        }
        k = 1;
        left = depth;
    }
    p->k = (uint_least16_t)k;
    p->depth = (uint_least16_t)left;
    p->rising = rising;
    hystgen_corners_settle(t, p, corner, rising);
}

/* Where a move ends that may lead to the input `limit` of the plays, which is that of a limit of the drive; what begins
   it as above. No turning point lies beyond, so that all corners are left but those of the start and the first one
   above them, which the caller has asked the output for. *limited tells whether it leads to the limit; then the place
   is that of the limit. False where it would take more to know, and where rounding decides; then nothing is filled
   in. */
HYSTGEN_COPIES bool hystgen_move_within(const hystgen_tables_t *t, hystgen_memory_t *m, const hystgen_corner_t *corner,
                                        unsigned int depth, unsigned int k, hystgen_real_t output,
                                        hystgen_real_t limit, bool rising, hystgen_real_t *w, bool *room,
                                        bool *limited)
{
    hystgen_place_t *p = &m->there;
    const hystgen_corner_t *c = &corner[m->start];
    const hystgen_real_t x = rising ? output : -output;
    unsigned int left = m->start + 1u;
    unsigned int high;
    unsigned int end = 0;
    bool alike = true;
    *w = limit;
    *limited = true;
    if (k > 1 && !hystgen_reached(limit, m->here.next, rising)) { /* before the next play */
        hystgen_copy_place(p, &m->here);
        return true;
    }
    if (depth < left) {
        return false;
    }
    high = c->end - 1u;
    if (depth > left) {
        k = corner[left].end;
        end = k;
    }
    if (x >= c->pass[rising] && hystgen_reached(limit, hystgen_activation(t, c, high, rising), rising)) {
        if (m->start > 0) {
            return false;
        }
        left = 0; /* every play follows */
        k = c->end;
        end = k;
    } else {
        const hystgen_real_t way = hystgen_half(rising ? limit - c->extremum : c->extremum - limit);
        const hystgen_real_t asked = hystgen_half(x + c->pass[!rising]);
        if (c->side != (rising ? 1 : -1)) {
            return false;
        }
        k = hystgen_play_not_reached(t, k, high, asked, way);
        if (k < high ? asked >= t->start_level[k] : x >= c->pass[rising]) { /* for more plays than follow */
            if (k < high && hystgen_reached(limit, hystgen_activation(t, c, k, rising), rising)) {
                return false;
            }
            hystgen_settle_at(t, m, corner, depth, left, k, limit, rising);
            return true;
        }
        alike = !(k < high && way >= t->threshold[k]);
    }
    *w = rising ? hystgen_rise_to(t, m, corner, left, k, end, output, room)
                : hystgen_fall_to(t, m, corner, left, k, end, output, room);
    *limited = hystgen_past(*w, limit, rising);
    if (*limited) {
        *w = limit;
        if (!alike || (left > 0 && !hystgen_past(limit, p->anchor, rising))) {
            hystgen_copy_place(p, &m->here);
            return false;
        }
        if (hystgen_takes_none(t, m, corner, depth, limit, rising)) {
            hystgen_settle_at(t, m, corner, depth, left, k, limit, rising);
        }
    }
    return true;
}

HYSTGEN_API bool hystgen_corners_rise_within(const hystgen_tables_t *t, hystgen_memory_t *m,
                                             const hystgen_corner_t *corner, unsigned int depth, unsigned int k,
                                             hystgen_real_t output, hystgen_real_t limit, hystgen_real_t *w,
                                             bool *room, bool *limited)
{
    return hystgen_move_within(t, m, corner, depth, k, output, limit, true, w, room, limited);
}

HYSTGEN_API bool hystgen_corners_fall_within(const hystgen_tables_t *t, hystgen_memory_t *m,
                                             const hystgen_corner_t *corner, unsigned int depth, unsigned int k,
                                             hystgen_real_t output, hystgen_real_t limit, hystgen_real_t *w,
                                             bool *room, bool *limited)
{
    return hystgen_move_within(t, m, corner, depth, k, output, limit, false, w, room, limited);
}
