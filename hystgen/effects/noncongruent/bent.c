/* The contribution of a play at a value: the value itself, or bent by a bump or by a polynomial.
   Called by chain/moving_plays.c and by relaxing plays. */
#ifndef HYSTGEN_NONCONGRUENT_BENT_C
#define HYSTGEN_NONCONGRUENT_BENT_C
#include "compensator/chain/model.h"

#ifndef HYSTGEN_HAS_BENT_PLAYS
/* Contribution of play i at z: z itself. */
static inline hystgen_play_t hystgen_bent(unsigned int i, hystgen_play_t z) {
    (void)i;
    return z;
}

#ifndef HYSTGEN_FIXED
/* The same. Sets its change per change of z. */
static inline hystgen_real_t hystgen_bent_steep(unsigned int i, hystgen_real_t z,
                                                hystgen_real_t bump, hystgen_real_t *steep) {
    (void)i;
    (void)bump;
    *steep = 1;
    return z;
}
#endif
#elif defined(HYSTGEN_FIXED)
/* Contribution of play i at z, in fixed point: z plus the value of a curve, which several plays may
   share. Beyond the range of the plays a curve keeps its end value. */
HYSTGEN_APART int64_t hystgen_bent(unsigned int i, int32_t z) {
    const uint16_t curve = hystgen_bump_of[i];
    const hystgen_bump_t *c = &hystgen_bump[curve];
    int32_t inside = z;
    if (z < -HYSTGEN_BUMP_END) {
        inside = -HYSTGEN_BUMP_END;
    } else if (z > HYSTGEN_BUMP_END) {
        inside = HYSTGEN_BUMP_END;
    }
    const int64_t value =
        hystgen_curve(c->knot, c->scale, c->coefficient, c->pieces, HYSTGEN_BUMP_DEGREE, inside);
    return z + hystgen_nearest(value * ((int64_t)1 << HYSTGEN_BUMP_LIFT), HYSTGEN_BUMP_BITS);
}
#elif defined(HYSTGEN_HAS_BUMP)
/* Contribution of play i at z: more or less than z around a centre. `bump`: hystgen_bump_at of z.
   Sets its change per change of z. */
static inline hystgen_real_t hystgen_bent_steep(unsigned int i, hystgen_real_t z,
                                                hystgen_real_t bump, hystgen_real_t *steep) {
    (void)i;
    *steep = HYSTGEN_STEEPEST - HYSTGEN_AMPLITUDE * bump * bump;
    return z + HYSTGEN_BUMP * (bump + HYSTGEN_TANH_CENTRE);
}
#else
/* Contribution of play i at z: a polynomial for each play. Sets its change per change of z. */
static inline hystgen_real_t hystgen_bent_steep(unsigned int i, hystgen_real_t z,
                                                hystgen_real_t bump, hystgen_real_t *steep) {
    const hystgen_real_t x = z * HYSTGEN_INVERSE_SCALE;
    hystgen_real_t sum = 0;
    hystgen_real_t slope = 0;
    unsigned int k;
    (void)bump;
    for (k = HYSTGEN_TERMS; k > 0; --k) {
        sum = sum + hystgen_curve[i][k - 1u];
        slope = slope * x + sum;
        sum = sum * x;
    }
    *steep = 1 + (slope * x + sum);
    return z + HYSTGEN_SCALE * (sum * x);
}
#endif

#if defined(HYSTGEN_HAS_BUMP) && !defined(HYSTGEN_FIXED)
/* tanh of the distance of z from the centre, in widths. */
HYSTGEN_APART hystgen_real_t hystgen_bump_at(hystgen_real_t z) {
    return hystgen_tanh((z - HYSTGEN_CENTRE) * HYSTGEN_INVERSE_WIDTH);
}
#elif !defined(HYSTGEN_FIXED)
/* Nothing. */
static inline hystgen_real_t hystgen_bump_at(hystgen_real_t z) {
    (void)z;
    return 0;
}
#endif

#if defined(HYSTGEN_HAS_BENT_PLAYS) && !defined(HYSTGEN_FIXED)
/* Contribution of play i at z. */
HYSTGEN_APART hystgen_real_t hystgen_bent(unsigned int i, hystgen_real_t z) {
    hystgen_real_t steep;
    return hystgen_bent_steep(i, z, hystgen_bump_at(z), &steep);
}
#endif

/* Keeps the contribution of play i at z in floating point, if it is not z itself. */
static inline void hystgen_bent_anew(unsigned int i, hystgen_play_t z, hystgen_sum_t *bent) {
#if defined(HYSTGEN_HAS_BENT_PLAYS) && !defined(HYSTGEN_FIXED)
    bent[i - 1u] = hystgen_bent(i, z);
#else
    (void)i;
    (void)z;
    (void)bent;
#endif
}

#endif
