/* The contribution of a play at a value: the value itself, or bent by a bump or by a polynomial.
   Called by chain/moving_plays.c and by relaxing plays. */
#ifndef HYSTGEN_NONCONGRUENT_BENT_C
#define HYSTGEN_NONCONGRUENT_BENT_C
#include "compensator/chain/model.h"

#ifndef HYSTGEN_HAS_BENT_PLAYS
/* Contribution of play i at z: z itself. */
static inline hystgen_sum_t hystgen_bent(unsigned int i, hystgen_play_t z) {
    (void)i;
    return z;
}

/* Change of this contribution per change of the plays' input: that of the play. */
static inline hystgen_sum_t hystgen_bent_steep(unsigned int i, hystgen_play_t z,
                                               hystgen_sum_t value, hystgen_sum_t steep) {
    (void)i;
    (void)z;
    (void)value;
    return steep;
}
#elif defined(HYSTGEN_FIXED)
/* Contribution of play i at z, in fixed point: z plus the value of a curve, which several plays may
   share. Beyond the range of the plays a curve keeps its end value. */
HYSTGEN_APART int64_t hystgen_bent(unsigned int i, int32_t z) {
    const hystgen_bump_t *c = &hystgen_bump[hystgen_bump_of[i]];
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
/* Contribution of play i at z: more or less than z around a centre. Play 0 is the input itself. */
HYSTGEN_APART hystgen_real_t hystgen_bent(unsigned int i, hystgen_real_t z) {
    const hystgen_real_t x = (z - HYSTGEN_CENTRE) * HYSTGEN_INVERSE_WIDTH;
    return i == 0 ? z : z + HYSTGEN_BUMP * (hystgen_tanh(x) + HYSTGEN_TANH_CENTRE);
}

/* Change of the contribution of play i at z, `value`, per change of the plays' input, from that of
   the play. */
static hystgen_real_t hystgen_bent_steep(unsigned int i, hystgen_real_t z, hystgen_real_t value,
                                         hystgen_real_t steep) {
    const hystgen_real_t bump = (value - z) * HYSTGEN_INVERSE_BUMP - HYSTGEN_TANH_CENTRE;
    const hystgen_real_t amplitude = HYSTGEN_BUMP * HYSTGEN_INVERSE_WIDTH;
    (void)i;
    return steep + steep * (amplitude - amplitude * bump * bump);
}
#else
/* Contribution of play i at z: a polynomial for each play. Play 0 is the input itself. */
static hystgen_real_t hystgen_bent(unsigned int i, hystgen_real_t z) {
    const hystgen_real_t x = z * HYSTGEN_INVERSE_SCALE;
    hystgen_real_t sum = 0;
    unsigned int k;
    for (k = HYSTGEN_TERMS; k > 0; --k) {
        sum = (sum + hystgen_curve[i][k - 1u]) * x;
    }
    return z + HYSTGEN_SCALE * (sum * x);
}

/* Change of the contribution of play i at z, `value`, per change of the plays' input, from that of
   the play. */
static hystgen_real_t hystgen_bent_steep(unsigned int i, hystgen_real_t z, hystgen_real_t value,
                                         hystgen_real_t steep) {
    const hystgen_real_t x = z * HYSTGEN_INVERSE_SCALE;
    hystgen_real_t sum = 0;
    hystgen_real_t slope = 0;
    unsigned int k;
    (void)value;
    for (k = HYSTGEN_TERMS; k > 0; --k) {
        sum = sum + hystgen_curve[i][k - 1u];
        slope = slope * x + sum;
        sum = sum * x;
    }
    return steep + steep * (slope * x + sum);
}
#endif

/* Contribution of play i at z. Keeps it in floating point, if it is not z itself. */
static inline hystgen_sum_t hystgen_bent_anew(unsigned int i, hystgen_play_t z,
                                              hystgen_sum_t *bent) {
#if defined(HYSTGEN_HAS_BENT_PLAYS) && !defined(HYSTGEN_FIXED)
    bent[i] = hystgen_bent(i, z);
    return bent[i];
#else
    (void)i;
    (void)bent;
    return z;
#endif
}

#endif
