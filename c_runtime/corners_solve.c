#include "hystgen_runtime.h"

/* Input of the plays that gives `output` when the move goes on with plays 0 .. k-1 following and `depth` corners.
   Rounding is kept from leading out of the place that was found: then the plays that follow are those that will. */
static hystgen_real_t hystgen_corners_locate(const hystgen_tables_t *t, hystgen_memory_t *m,
                                             const hystgen_corner_t *corner, unsigned int depth, unsigned int k,
                                             bool rising, hystgen_real_t output)
{
    hystgen_place_t *there = &m->there;
    hystgen_real_t w;
    there->rising = rising;
    hystgen_find_by_output(t, corner, depth, k, output, there);
    hystgen_corners_settle(t, there, corner);
    k = there->k;
    w = there->anchor + (output - there->anchor_output) * t->inverse_slope[k];
    if (hystgen_reached(w, there->next, rising)) {
        there->k = 0;
        return there->next;
    }
    if (k > 1) {
        const hystgen_corner_t *owner = hystgen_entered_by(corner, there->depth, depth, k);
        const hystgen_real_t first = hystgen_activation(t, owner, k - 1, rising);
        if (!hystgen_reached(w, first, rising)) {
            there->k = 0;
            return first;
        }
    }
    return w;
}

/* The analytic inverse asked of the same memory: the input of the plays that gives `output`. Moves nothing, but leaves
   word for the next absorb of where the answer lies; the free slot above the corners is scratch space for the corner
   that turning back would leave. */
HYSTGEN_API hystgen_real_t hystgen_corners_solve(const hystgen_tables_t *t, hystgen_memory_t *m,
                                                 hystgen_corner_t *corner, hystgen_real_t output)
{
    const hystgen_place_t *p = &m->here;
    const hystgen_real_t w = p->anchor + (output - p->anchor_output) * t->inverse_slope[p->k];
    unsigned int depth = p->depth;
    if (p->rising ? w >= m->w : w <= m->w) {
        if (hystgen_passed(output, p->next_output, p->rising)) {
            return hystgen_corners_locate(t, m, corner, depth, p->k + 1u, p->rising, output);
        }
        if (hystgen_reached(w, p->next, p->rising)) {
            return p->next;
        }
        m->there = *p;
        return w; /* the same plays follow: the usual sample */
    }
    if (p->k > 1) {
        hystgen_push_corner(t, m, &corner[depth]);
        depth = depth + 1;
    }
    return hystgen_corners_locate(t, m, corner, depth, 1, !p->rising, output);
}
