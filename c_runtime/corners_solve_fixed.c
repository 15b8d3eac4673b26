#include "hystgen_runtime.h"

/* The output at which play k, held by corner c, starts to follow a rising (falling) move. */
static hystgen_sum_t hystgen_level(const hystgen_tables_t *t, const hystgen_corner_t *c, unsigned int k, bool rising)
{
    return hystgen_from(c->output, c->side, t->start_level[k], rising);
}

/* Input of the plays that gives `output` when `begun` plays followed, the first k do and `depth` corners hold the
   others. Whole numbers decide which play follows last, so that every engine finds the same. */
static hystgen_reach_t hystgen_corners_locate(const hystgen_tables_t *t, hystgen_memory_t *m,
                                              const hystgen_corner_t *corner, unsigned int depth, unsigned int begun,
                                              unsigned int k, bool rising, hystgen_sum_t output)
{
    hystgen_place_t *there = &m->there;
    hystgen_reach_t w; /* the last place known to be passed, and the output there */
    hystgen_sum_t here;
    there->rising = rising;
    hystgen_find_by_output(t, corner, depth, k, output, there);
    hystgen_corners_settle(t, there, corner);
    k = there->k;
    if (k > begun) {
        const hystgen_corner_t *owner = hystgen_entered_by(corner, there->depth, depth, k);
        w = hystgen_activation(t, owner, k - 1, rising);
        here = hystgen_level(t, owner, k - 1, rising);
        there->anchor = w; /* the same line, from where it begins */
        there->anchor_output = here;
    } else {
        w = m->w;
        here = hystgen_corners_output(t, m);
    }
    return hystgen_going(t, w, rising ? output - here : here - output, k, rising);
}

/* The analytic inverse asked of the same memory: the input of the plays that gives `output`. Moves nothing, but leaves
   word for the next absorb of where the answer lies; the free slot above the corners is scratch space for the corner
   that turning back would leave. */
HYSTGEN_API hystgen_reach_t hystgen_corners_solve(const hystgen_tables_t *t, hystgen_memory_t *m,
                                                  hystgen_corner_t *corner, hystgen_sum_t output)
{
    const hystgen_place_t *p = &m->here;
    const hystgen_sum_t here = hystgen_corners_output(t, m);
    unsigned int depth = p->depth;
    if (output == here) {
        return m->w;
    }
    if (p->rising ? output > here : output < here) {
        if (hystgen_passed(output, p->next_output, p->rising)) {
            return hystgen_corners_locate(t, m, corner, depth, p->k, p->k + 1u, p->rising, output);
        }
        return hystgen_going(t, m->w, p->rising ? output - here : here - output, p->k, p->rising);
    }
    if (p->k > 1) {
        hystgen_push_corner(t, m, &corner[depth]);
        depth = depth + 1;
    }
    return hystgen_corners_locate(t, m, corner, depth, 1, 1, !p->rising, output);
}
