#include "hystgen_runtime.h"

/* Whether a move to `limit` takes no more plays along: right at the activation of one, it does not follow yet. */
static bool hystgen_takes_none(const hystgen_tables_t *t, const hystgen_memory_t *m, const hystgen_corner_t *corner,
                               unsigned int depth, hystgen_real_t limit, bool rising)
{
    if (m->here.rising == rising) {
        return !hystgen_past(limit, m->here.next, rising);
    }
    return depth > 0 && !hystgen_past(limit, hystgen_activation(t, &corner[depth - 1], 1, rising), rising);
}

/* Fills in the place of a move that ends at a limit of the drive: k plays follow then and `left` of `depth` corners are
   left, or it takes none along. */
HYSTGEN_COPIES void hystgen_settle_at(const hystgen_tables_t *t, hystgen_memory_t *m, const hystgen_corner_t *corner,
                                      unsigned int depth, unsigned int left, unsigned int k, bool none,
                                      bool rising)
{
    hystgen_place_t *p = &m->there;
    if (none) {
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
            hystgen_settle_at(t, m, corner, depth, left, k, hystgen_takes_none(t, m, corner, depth, limit, rising),
                              rising);
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
            hystgen_settle_at(t, m, corner, depth, left, k, true, rising);
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
