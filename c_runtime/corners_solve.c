#include "hystgen_runtime.h"

/* The analytic inverse asked of the same memory: the input of the plays that gives `output`. Moves nothing, but leaves
   word for the next absorb of where the answer lies; the free slot above the corners is scratch space for the corner
   that turning back would leave. Rounding is kept from leading out of the place that was found: then the plays that
   follow are those that will. */
HYSTGEN_API hystgen_real_t hystgen_corners_solve(const hystgen_tables_t *t, hystgen_memory_t *m,
                                                 hystgen_corner_t *corner, hystgen_real_t output)
{
    const hystgen_place_t *here = &m->here;
    hystgen_place_t *there = &m->there;
    hystgen_real_t w = here->anchor + (output - here->anchor_output) * t->inverse_slope[here->k];
    unsigned int depth = here->depth;
    unsigned int k = here->k + 1u;
    bool rising = here->rising;
    if (rising ? w >= m->w : w <= m->w) {
        if (!hystgen_passed(output, here->next_output, rising)) {
            there->k = 0;
            return hystgen_reached(w, here->next, rising) ? here->next : w;
        }
    } else { /* the move turns back */
        if (k > 2) {
            hystgen_push_corner(t, m, &corner[depth]);
            depth = depth + 1;
        }
        k = 1;
        rising = !rising;
    }
    there->rising = rising;
    hystgen_find_by_output(t, corner, depth, k, output, there);
    hystgen_corners_settle(t, there, corner);
    k = there->k;
    w = there->anchor + (output - there->anchor_output) * t->inverse_slope[k];
    if (hystgen_past(w, there->next, rising)) {
        return there->next;
    }
    if (k > 1) {
        const hystgen_corner_t *owner = hystgen_entered_by(corner, there->depth, depth, k);
        const hystgen_real_t first = hystgen_activation(t, owner, k - 1, rising);
        if (!hystgen_reached(w, first, rising)) {
            there->anchor = first; /* so that later answers of the same move do not lie before this one */
            there->anchor_output = output;
            return first;
        }
    }
    return w;
}
