/* A gain that depends on the distance travelled in drive codes, as a piecewise cubic. Called by the
   functions that emission writes for a chain, see compensator/chain/model.h. */
#ifndef HYSTGEN_AGEING_AGEING_FIXED_C
#define HYSTGEN_AGEING_AGEING_FIXED_C
#include "effects/gains.c"

/* Fraction bits of a position within a piece, and one half. */
#define HYSTGEN_PART_BITS 20u
#define HYSTGEN_PART_HALF ((int64_t)1 << (HYSTGEN_PART_BITS - 1u))

/* The gain at a travel; past the last piece it stays constant. */
static int32_t hystgen_ageing_gain(const hystgen_ageing_table_t *t, int64_t travel) {
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
    const hystgen_ageing_piece_t *piece = &t->piece[low];
    const int64_t along = hystgen_times((travel - piece->begin) >> piece->drop, &piece->share);
    const int64_t whole = (int64_t)1 << HYSTGEN_PART_BITS;
    const int64_t share = along > whole ? whole : along;
    int64_t gain = 0;
    unsigned int i;
    for (i = 4; i > 0; --i) {
        gain = piece->c[i - 1u] + ((gain * share + HYSTGEN_PART_HALF) >> HYSTGEN_PART_BITS);
    }
    return (int32_t)gain;
}

/* Sets the travel. Returns whether it had to be limited. */
static bool hystgen_ageing_set_travel(const hystgen_ageing_table_t *t, hystgen_ageing_t *self,
                                      int64_t travel) {
    int64_t inside;
    if (travel < 0) {
        inside = 0;
    } else if (travel > t->last) {
        inside = t->last;
    } else {
        inside = travel;
    }
    self->high = inside;
    self->own = true;
    self->gain = hystgen_ageing_gain(t, inside);
    self->inverse = hystgen_gain_reciprocal(self->gain);
    return inside != travel;
}

/* Sets a gain that replaces the one from the travel. Returns whether it had to be limited. */
static bool hystgen_ageing_set(const hystgen_ageing_table_t *t, hystgen_ageing_t *self,
                               hystgen_real_t gain) {
    const int64_t given = (int64_t)gain * ((int64_t)1 << t->bits);
    self->own = false;
    self->gain = hystgen_gain_inside(given);
    self->inverse = hystgen_gain_reciprocal(self->gain);
    return self->gain != given;
}

/* The drive has moved by `way`. Newton steps update the reciprocal of the gain. */
static void hystgen_ageing_move(const hystgen_ageing_table_t *t, hystgen_ageing_t *self,
                                int64_t way) {
    const int64_t next = self->high + (way >= 0 ? way : -way);
    self->high = next > t->last ? t->last : next;
    if (self->own) {
        self->gain = hystgen_ageing_gain(t, self->high);
        self->inverse = hystgen_gain_followed(self->gain, self->inverse, t->turns);
    }
}

/* The input for the output y. */
static int64_t hystgen_ageing_solve(const hystgen_ageing_t *self, int64_t y) {
    return hystgen_gain_times(y, self->inverse);
}

/* The output for the input x. */
static int64_t hystgen_ageing_absorb(const hystgen_ageing_t *self, int64_t x) {
    return hystgen_gain_times(x, self->gain);
}

#endif
