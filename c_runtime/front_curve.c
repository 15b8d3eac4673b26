#include "hystgen_runtime.h"

/* Input of the plays: w = G[v]. */
HYSTGEN_APART hystgen_play_t hystgen_front_forward(hystgen_fine_t v, bool ascending) {
    (void)ascending;
    return (hystgen_play_t)hystgen_curve(hystgen_front_knot, hystgen_front_scale,
                                         hystgen_front_coefficient, HYSTGEN_FRONT_PIECES,
                                         HYSTGEN_DEGREE, v);
}

/* v = G^-1[w]; sets `limited` if no drive gives w. */
HYSTGEN_APART hystgen_reach_t hystgen_front_inverse(hystgen_reach_t w, bool ascending,
                                                    bool *limited) {
    const hystgen_ends_t *ends = &hystgen_back_ends;
    int64_t v;
    (void)ascending;
    if (w < ends->first || w > ends->last) {
        return hystgen_beyond(ends, w, HYSTGEN_FINE_MIN, HYSTGEN_FINE_MAX, limited);
    }
    *limited = false;
    v = hystgen_curve(hystgen_back_knot, hystgen_back_scale, hystgen_back_coefficient,
                      HYSTGEN_BACK_PIECES, HYSTGEN_DEGREE, (int32_t)w);
    return (hystgen_reach_t)hystgen_nearest(v, HYSTGEN_BELOW);
}
