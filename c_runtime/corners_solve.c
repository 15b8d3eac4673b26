#include "hystgen_runtime.h"

/* Output at the moment play k, the last of a block that is passed whole, or any play inside corner c's block,
   starts to follow. */
static hystgen_real_t hystgen_level(const hystgen_tables_t *t, const hystgen_corner_t *c, unsigned int k, bool rising)
{
    const hystgen_real_t w = hystgen_activation(c, t->threshold[k], rising);
    const hystgen_real_t tail = hystgen_held(t, c, k + 1);
    return (rising ? tail - t->lift[k + 1] : tail + t->lift[k + 1]) + w * t->slope[k + 1];
}

/* Input of the plays that gives `output` when the move goes on with plays 0 .. k-1 following and `left` corners. */
static hystgen_real_t hystgen_corners_locate(const hystgen_tables_t *t, const hystgen_corner_t *corner,
                                             unsigned int left, unsigned int k, bool rising, hystgen_real_t output)
{
    hystgen_real_t base = 0;
    unsigned int low = 0;
    unsigned int probe = left;
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
    if (left > 0) {
        const hystgen_corner_t *c = &corner[left - 1];
        unsigned int high = c->end - 1u;
        unsigned int stride = 1;
        probe = k;
        while (k < high) {
            if (hystgen_reached(output, hystgen_level(t, c, probe, rising), rising)) {
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
        base = hystgen_held(t, c, k);
    }
    base = rising ? base - t->lift[k] : base + t->lift[k];
    return (output - base) * t->inverse_slope[k];
}

/* The analytic inverse asked of the same memory: the input of the plays that gives `output`. Moves nothing; the
   free slot above the corners is scratch space for the corner that turning back would leave. */
HYSTGEN_API hystgen_real_t hystgen_corners_solve(const hystgen_tables_t *t, const hystgen_memory_t *m,
                                                 hystgen_corner_t *corner, hystgen_real_t output)
{
    const hystgen_real_t w = (output - m->base) * t->inverse_slope[m->k];
    unsigned int depth = m->depth;
    if (m->rising ? w >= m->w : w <= m->w) {
        if (!hystgen_reached(w, m->next, m->rising)) {
            return w; /* the same plays follow: the usual sample */
        }
        return hystgen_corners_locate(t, corner, depth, m->k, m->rising, output);
    }
    if (m->k > 1) {
        hystgen_corner_t *c = &corner[depth];
        c->extremum = m->w;
        c->tail = m->tail;
        c->end = m->k;
        c->side = m->rising ? -1 : 1;
        depth = depth + 1;
    }
    return hystgen_corners_locate(t, corner, depth, 1, !m->rising, output);
}
