#include "hystgen_runtime.h"

/* The output at which play k, held by corner c, starts to follow a rising (falling) move. */
static hystgen_sum_t hystgen_level(const hystgen_tables_t *t, const hystgen_corner_t *c, unsigned int k, bool rising)
{
    return hystgen_from(hystgen_held(c), c->side, t->start_level[k], rising);
}

/* Where a move to `output` leads that takes more plays along, or turns back: which plays follow there. */
HYSTGEN_NOINLINE static void hystgen_corners_seek(const hystgen_tables_t *t, hystgen_memory_t *m,
                                                  const hystgen_corner_t *corner, hystgen_sum_t output)
{
    const bool on = m->there.rising == m->here.rising;
    const unsigned int depth = !on && m->here.k > 1 ? m->here.depth + 1u : m->here.depth;
    hystgen_find_by_output(t, corner, depth, on ? m->here.k + 1u : 1, output, &m->there);
}

/* Input of the plays that gives `output` in the place that was found. Whole numbers decide which play follows last, so
   that every engine finds the same. */
HYSTGEN_NOINLINE static hystgen_reach_t hystgen_corners_land(const hystgen_tables_t *t, hystgen_memory_t *m,
                                                             const hystgen_corner_t *corner, hystgen_sum_t output)
{
    hystgen_place_t *there = &m->there;
    const bool rising = there->rising;
    const bool on = rising == m->here.rising;
    const unsigned int k = there->k;
    hystgen_reach_t w = m->w; /* the last place known to be passed, and the output there */
    hystgen_sum_t here;
    if (k > (on ? m->here.k : 1u)) {
        const unsigned int depth = !on && m->here.k > 1 ? m->here.depth + 1u : m->here.depth;
        const hystgen_corner_t *owner = hystgen_entered_by(corner, there->depth, depth, k);
        w = hystgen_activation(t, owner, k - 1, rising);
        here = hystgen_level(t, owner, k - 1, rising);
        there->anchor = w; /* the same line, from where it begins */
        there->anchor_output = here;
    } else {
        here = m->here.k > 1 ? corner[m->here.depth].output : hystgen_corners_output(t, m);
    }
    return hystgen_going(t, w, rising ? output - here : here - output, k, rising);
}

HYSTGEN_NOINLINE static void hystgen_corners_settle_there(const hystgen_tables_t *t, hystgen_memory_t *m,
                                                          const hystgen_corner_t *corner)
{
    if (m->there.rising) {
        hystgen_corners_settle(t, &m->there, corner, true);
    } else {
        hystgen_corners_settle(t, &m->there, corner, false);
    }
}

/* The analytic inverse asked of the same memory: the input of the plays that gives `output`, from the output `here` on.
   Moves nothing, but leaves word for the next absorb of where the answer lies; the free slot above the corners is
   scratch space for the corner that turning back would leave. One part after the other, so that only one of them is on
   the stack. */
HYSTGEN_API hystgen_reach_t hystgen_corners_solve_from(const hystgen_tables_t *t, hystgen_memory_t *m,
                                                       hystgen_corner_t *corner, hystgen_sum_t here,
                                                       hystgen_sum_t output)
{
    const hystgen_place_t *p = &m->here;
    const bool rising = output > here;
    if (output == here) {
        return m->w;
    }
    if (rising == p->rising) {
        if (!hystgen_passed(output, p->next_output, rising)) {
            return hystgen_going(t, m->w, rising ? output - here : here - output, p->k, rising);
        }
    } else if (p->k > 1) {
        hystgen_leave_corner(t, m, corner, here, p->rising);
    }
    m->there.rising = rising;
    hystgen_corners_seek(t, m, corner, output);
    hystgen_corners_settle_there(t, m, corner);
    return hystgen_corners_land(t, m, corner, output);
}

HYSTGEN_API hystgen_reach_t hystgen_corners_solve(const hystgen_tables_t *t, hystgen_memory_t *m,
                                                  hystgen_corner_t *corner, hystgen_sum_t output)
{
    return hystgen_corners_solve_from(t, m, corner, hystgen_corners_output(t, m), output);
}
