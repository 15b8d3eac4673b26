#include "hystgen_runtime.h"

/* Input of the plays: w = G[v], on the branch of the drive's direction. */
HYSTGEN_APART hystgen_play_t hystgen_front_forward(hystgen_fine_t v, bool ascending) {
    if (ascending) {
        return (hystgen_play_t)hystgen_curve(
            hystgen_front_ascending_knot, hystgen_front_ascending_scale,
            hystgen_front_ascending_coefficient, HYSTGEN_FRONT_ASCENDING_PIECES, HYSTGEN_DEGREE, v);
    }
    return (hystgen_play_t)hystgen_curve(
        hystgen_front_descending_knot, hystgen_front_descending_scale,
        hystgen_front_descending_coefficient, HYSTGEN_FRONT_DESCENDING_PIECES, HYSTGEN_DEGREE, v);
}

/* v = G^-1[w] on one branch; sets `limited` if no drive gives w on it. */
HYSTGEN_APART hystgen_reach_t hystgen_front_inverse(hystgen_reach_t w, bool ascending,
                                                    bool *limited) {
    const hystgen_ends_t *ends =
        ascending ? &hystgen_back_ascending_ends : &hystgen_back_descending_ends;
    int64_t v;
    if (w < ends->first || w > ends->last) {
        return hystgen_beyond(ends, w, HYSTGEN_FINE_MIN, HYSTGEN_FINE_MAX, limited);
    }
    *limited = false;
    if (ascending) {
        v = hystgen_curve(hystgen_back_ascending_knot, hystgen_back_ascending_scale,
                          hystgen_back_ascending_coefficient, HYSTGEN_BACK_ASCENDING_PIECES,
                          HYSTGEN_DEGREE, (int32_t)w);
    } else {
        v = hystgen_curve(hystgen_back_descending_knot, hystgen_back_descending_scale,
                          hystgen_back_descending_coefficient, HYSTGEN_BACK_DESCENDING_PIECES,
                          HYSTGEN_DEGREE, (int32_t)w);
    }
    return (hystgen_reach_t)hystgen_nearest(v, HYSTGEN_BELOW);
}
