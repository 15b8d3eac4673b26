#include "hystgen_runtime.h"

static bool hystgen_passed(hystgen_sum_t output, hystgen_sum_t level, bool rising)
{
    return rising ? output >= level : output <= level;
}

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

/* Input of the plays that gives `output` when the move goes on with plays 0 .. k-1 following and `left` corners.
   Whole numbers decide which play follows last, so that every engine finds the same. */
static hystgen_reach_t hystgen_corners_locate(const hystgen_tables_t *t, hystgen_memory_t *m,
                                              const hystgen_corner_t *corner, unsigned int left, unsigned int k,
                                              bool rising, hystgen_sum_t output)
{
    hystgen_reach_t w = m->w; /* the last place known to be passed, and the output there */
    hystgen_sum_t here = hystgen_corners_output(t, m);
    unsigned int low = 0;
    unsigned int probe = left;
    hystgen_sum_t there;
    while (low < left) {
        const hystgen_corner_t *c = &corner[probe - 1];
        there = hystgen_level(t, c, c->end - 1u, rising);
        if (hystgen_passed(output, there, rising)) {
            w = hystgen_activation(c, t->threshold[c->end - 1u], rising);
            here = there;
            left = probe - 1;
            k = c->end;
        } else {
            low = probe;
        }
        probe = (low + left + 1) / 2;
    }
    if (left > 0 && hystgen_opposite(corner[left - 1].side, rising)) {
        const hystgen_corner_t *c = &corner[left - 1];
        const unsigned int begun = k;
        k = hystgen_gallop_levels(t->start_level, k, c->end - 1u, hystgen_way(output, c->output, c->side, rising));
        if (k > begun) {
            w = hystgen_activation(c, t->threshold[k - 1], rising);
            here = hystgen_level(t, c, k - 1, rising);
        }
    }
    m->there.k = (uint_least16_t)k;
    m->there.depth = (uint_least16_t)left;
    m->there.rising = rising;
    hystgen_corners_settle(t, &m->there, corner);
    return hystgen_going(t, w, rising ? output - here : here - output, k, rising);
}

/* The analytic inverse asked of the same memory: the input of the plays that gives `output`. Moves nothing, but leaves
   word for the next absorb of where the answer lies; the free slot above the corners is scratch space for the corner
   that turning back would leave. */
HYSTGEN_API hystgen_reach_t hystgen_corners_solve(const hystgen_tables_t *t, hystgen_memory_t *m,
                                                  hystgen_corner_t *corner, hystgen_sum_t output)
{
    const hystgen_sum_t here = hystgen_corners_output(t, m);
    unsigned int depth = m->here.depth;
    if (output == here) {
        return m->w;
    }
    if (m->here.rising && output > here) {
        const hystgen_reach_t w = hystgen_going(t, m->w, output - here, m->here.k, true);
        /* the reciprocal is off by less than 4 steps: short of that the same plays follow, the usual sample */
        return w < m->here.next - 4 ? w : hystgen_corners_locate(t, m, corner, depth, m->here.k, true, output);
    }
    if (!m->here.rising && output < here) {
        const hystgen_reach_t w = hystgen_going(t, m->w, here - output, m->here.k, false);
        return w > m->here.next + 4 ? w : hystgen_corners_locate(t, m, corner, depth, m->here.k, false, output);
    }
    if (m->here.k > 1) {
        hystgen_push_corner(t, m, &corner[depth]);
        depth = depth + 1;
    }
    return hystgen_corners_locate(t, m, corner, depth, 1, !m->here.rising, output);
}
