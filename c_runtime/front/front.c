/* From a drive to the input of the plays and back: in fixed point through the curves of the
   memoryless part, or unchanged if the model has none. In floating point, emission writes these
   functions from the stages. Called by the operators. */
#ifndef HYSTGEN_FRONT_FRONT_C
#define HYSTGEN_FRONT_FRONT_C
#include "compensator/model.h"

#if defined(HYSTGEN_FIXED) && defined(HYSTGEN_HAS_TWO_BRANCHES)
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

/* v = G^-1[w] on one branch; for w beyond the branch, its end. */
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
#elif defined(HYSTGEN_FIXED) && defined(HYSTGEN_HAS_FRONT)
/* Input of the plays: w = G[v]. */
HYSTGEN_APART hystgen_play_t hystgen_front_forward(hystgen_fine_t v, bool ascending) {
    (void)ascending;
    return (hystgen_play_t)hystgen_curve(hystgen_front_knot, hystgen_front_scale,
                                         hystgen_front_coefficient, HYSTGEN_FRONT_PIECES,
                                         HYSTGEN_DEGREE, v);
}

/* v = G^-1[w]; for w beyond G, the nearer end of G. */
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
#elif defined(HYSTGEN_HAS_FINE_PLAYS)
/* Input of the plays, HYSTGEN_FINE bits finer than a drive code, so that thresholds are exact. */
static inline hystgen_play_t hystgen_front_forward(hystgen_real_t v) {
    return (hystgen_play_t)v * ((hystgen_play_t)1 << HYSTGEN_FINE);
}

/* The nearest drive code for an input of the plays. */
static inline hystgen_reach_t hystgen_front_inverse(hystgen_reach_t w) {
    return (w + ((hystgen_reach_t)1 << (HYSTGEN_FINE - 1u)) - (w < 0 ? 1 : 0)) >> HYSTGEN_FINE;
}
#elif !defined(HYSTGEN_HAS_FRONT)
/* Input of the plays: the drive itself. */
static inline hystgen_play_t hystgen_front_forward(hystgen_fine_t v) {
    return v;
}

/* The drive for an input of the plays. */
static inline hystgen_reach_t hystgen_front_inverse(hystgen_reach_t w) {
    return w;
}
#endif

#endif
