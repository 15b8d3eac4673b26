/* A gain that depends on the distance travelled, in fixed point in drive codes, as a piecewise
   cubic. Called by the functions that emission writes for a chain, see compensator/chain/model.h.
 */
#ifndef HYSTGEN_AGEING_AGEING_C
#define HYSTGEN_AGEING_AGEING_C
#include "effects/gains.c"

#ifdef HYSTGEN_FIXED
/* Fraction bits of a position within a piece. */
#define HYSTGEN_PART_BITS 20u

/* Position within a piece, from 0 on. */
static int64_t hystgen_ageing_along(const hystgen_ageing_piece_t *piece, int64_t travel) {
    const int64_t whole = (int64_t)1 << HYSTGEN_PART_BITS;
    const int64_t along = hystgen_times((travel - piece->begin) >> piece->drop, &piece->share);
    return along > whole ? whole : along;
}

/* A gain times a position within a piece. */
static int64_t hystgen_ageing_part(int64_t gain, int64_t along) {
    const int64_t half = (int64_t)1 << (HYSTGEN_PART_BITS - 1u);
    return (gain * along + half) >> HYSTGEN_PART_BITS;
}
#else
/* Position within a piece, 0 to 1. */
static hystgen_real_t hystgen_ageing_along(const hystgen_ageing_piece_t *piece,
                                           hystgen_real_t travel) {
    const hystgen_real_t along = (travel - piece->begin) * piece->share;
    return along > 1 ? 1 : along;
}

/* A gain times a position within a piece. */
static inline hystgen_real_t hystgen_ageing_part(hystgen_real_t gain, hystgen_real_t along) {
    return gain * along;
}
#endif

/* The gain at a travel; past the last piece it stays constant. */
static hystgen_narrow_t hystgen_ageing_gain(const hystgen_ageing_table_t *t,
                                            hystgen_signal_t travel) {
    unsigned int low = 0;
    unsigned int high = t->n;
    while (high - low > 1u) {
        const unsigned int middle = (low + high) / 2u;
        if (travel >= t->piece[middle].begin) {
            low = middle;
        } else {
            high = middle;
        }
    }
    const hystgen_signal_t along = hystgen_ageing_along(&t->piece[low], travel);
    hystgen_signal_t gain = t->piece[low].c[3];
    unsigned int i;
    for (i = 3; i > 0; --i) {
        gain = hystgen_ageing_part(gain, along) + t->piece[low].c[i - 1u];
    }
    return (hystgen_narrow_t)gain;
}

/* Sets the travel. Returns whether it had to be limited. */
static bool hystgen_ageing_set_travel(const hystgen_ageing_table_t *t, hystgen_ageing_t *self,
                                      hystgen_signal_t travel) {
    hystgen_signal_t inside;
    if (travel < 0) {
        inside = 0;
    } else if (travel > t->last) {
        inside = t->last;
    } else {
        inside = travel;
    }
    self->high = inside;
#ifndef HYSTGEN_FIXED
    self->low = 0;
#endif
    self->own = true;
    self->gain = hystgen_ageing_gain(t, inside);
    self->inverse = hystgen_gain_reciprocal(self->gain);
    return inside < travel || inside > travel;
}

/* Sets a gain that replaces the one from the travel. Returns whether it had to be limited. */
static bool hystgen_ageing_set(const hystgen_ageing_table_t *t, hystgen_ageing_t *self,
                               hystgen_real_t gain) {
#ifdef HYSTGEN_FIXED
    const hystgen_signal_t given = (hystgen_signal_t)gain * ((int64_t)1 << t->bits);
#else
    const hystgen_signal_t given = gain;
    (void)t;
#endif
    self->own = false;
    self->gain = hystgen_gain_inside(given);
    self->inverse = hystgen_gain_reciprocal(self->gain);
    return self->gain < given || self->gain > given;
}

/* The drive has moved by `way`. */
static void hystgen_ageing_move(const hystgen_ageing_table_t *t, hystgen_ageing_t *self,
                                hystgen_signal_t way) {
    const hystgen_signal_t size = way >= 0 ? way : -way;
#ifdef HYSTGEN_FIXED
    const hystgen_signal_t next = self->high + size;
    self->high = next > t->last ? t->last : next;
#else
    const hystgen_signal_t high = self->high;
    hystgen_signal_t change = size + self->low;
    hystgen_signal_t next = high + change;
    if (next > t->last) {
        next = t->last;
        change = next - high;
    }
    self->high = next;
    self->low = change - (next - high); /* rounding remainder of the sum */
#endif
    if (self->own) {
        self->gain = hystgen_ageing_gain(t, self->high);
        self->inverse = hystgen_gain_followed(self->gain, self->inverse, t->turns);
    }
}

/* The input for the output y. */
static hystgen_signal_t hystgen_ageing_solve(const hystgen_ageing_t *self, hystgen_signal_t y) {
    return hystgen_gain_times(y, self->inverse);
}

/* The output for the input x. */
static hystgen_signal_t hystgen_ageing_absorb(const hystgen_ageing_t *self, hystgen_signal_t x) {
    return hystgen_gain_times(x, self->gain);
}

#endif
