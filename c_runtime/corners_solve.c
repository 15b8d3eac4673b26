#include "hystgen_runtime.h"

/* As hystgen_gallop_thresholds, over outputs. */
static unsigned int hystgen_gallop_levels(const hystgen_sum_t *step, unsigned int k, unsigned int high, hystgen_sum_t x)
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

/* Input of the plays that gives `output` when the move goes on with plays 0 .. k-1 following and `depth` corners.
   Rounding is kept from leading out of the place that was found: then the plays that follow are those that will. */
static hystgen_real_t hystgen_corners_locate(const hystgen_tables_t *t, hystgen_memory_t *m,
                                             const hystgen_corner_t *corner, unsigned int depth, unsigned int k,
                                             bool rising, hystgen_real_t output)
{
    hystgen_place_t *there = &m->there;
    unsigned int low = 0;
    unsigned int left = depth;
    unsigned int probe = left;
    hystgen_real_t w;
    while (low < left) {
        const hystgen_corner_t *c = &corner[probe - 1];
        if (hystgen_reached(output, hystgen_level(t, c, c->end - 1u, rising), rising)) {
            left = probe - 1;
            k = c->end;
        } else {
            low = probe;
        }
        probe = (low + left + 1) / 2;
    }
    if (left > 0 && hystgen_opposite(corner[left - 1].side, rising)) {
        const hystgen_corner_t *c = &corner[left - 1];
        k = hystgen_gallop_levels(t->start_level, k, c->end - 1u, hystgen_way(output, c->output, c->side, rising));
    }
    there->k = (uint_least16_t)k;
    there->depth = (uint_least16_t)left;
    there->rising = rising;
    hystgen_corners_settle(t, there, corner);
    w = there->anchor + (output - there->anchor_output) * t->inverse_slope[k];
    if (hystgen_reached(w, there->next, rising)) {
        there->k = 0;
        return there->next;
    }
    if (k > 1) {
        const hystgen_real_t first = hystgen_entered(t, corner, left, depth, k, rising);
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
        if (!hystgen_reached(w, p->next, p->rising)) {
            m->there = *p;
            return w; /* the same plays follow: the usual sample */
        }
        return hystgen_corners_locate(t, m, corner, depth, p->k, p->rising, output);
    }
    if (p->k > 1) {
        hystgen_push_corner(t, m, &corner[depth]);
        depth = depth + 1;
    }
    return hystgen_corners_locate(t, m, corner, depth, 1, !p->rising, output);
}
