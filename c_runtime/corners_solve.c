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
    m->hint_k = (uint_least16_t)k;
    m->hint_depth = (uint_least16_t)left;
    m->hint_rising = rising;
    if (left > 0) {
        const hystgen_corner_t *c = &corner[left - 1];
        const hystgen_real_t last = hystgen_activation(c, t->threshold[k], rising);
        w = hystgen_activation(c, t->threshold[k - 1], rising);
        w = w + (output - hystgen_level(t, c, k - 1, rising)) * t->inverse_slope[k];
        if (hystgen_reached(w, last, rising)) {
            return last;
        }
    } else {
        w = (rising ? output + t->all_lift : output - t->all_lift) * t->inverse_slope[k];
    }
    if (k > 1) {
        const hystgen_real_t first = hystgen_entered(t, corner, left, depth, k, rising);
        if (!hystgen_reached(w, first, rising)) {
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
    const hystgen_real_t w = m->anchor + (output - m->anchor_output) * t->inverse_slope[m->k];
    unsigned int depth = m->depth;
    if (m->rising ? w >= m->w : w <= m->w) {
        if (!hystgen_reached(w, m->next, m->rising)) {
            return w; /* the same plays follow: the usual sample */
        }
        return hystgen_corners_locate(t, m, corner, depth, m->k, m->rising, output);
    }
    if (m->k > 1) {
        hystgen_push_corner(t, m, &corner[depth]);
        depth = depth + 1;
    }
    return hystgen_corners_locate(t, m, corner, depth, 1, !m->rising, output);
}
