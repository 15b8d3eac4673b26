/* A gain that depends on the distance travelled, as a piecewise cubic. Called by the functions that
   emission writes for a chain, see compensator/chain/model.h. */
#ifndef HYSTGEN_AGEING_AGEING_C
#define HYSTGEN_AGEING_AGEING_C
#include "compensator/chain/model.h"

/* The gain at a travel; past the last piece it stays constant. */
static hystgen_real_t hystgen_ageing_gain(const hystgen_ageing_table_t *t, hystgen_real_t travel) {
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
    const hystgen_real_t along = (travel - piece->begin) * piece->inverse_length;
    const hystgen_real_t share = along > 1 ? 1 : along;
    return ((piece->c3 * share + piece->c2) * share + piece->c1) * share + piece->c0;
}

/* Sets the travel. Returns whether it had to be limited. */
static bool hystgen_ageing_set_travel(const hystgen_ageing_table_t *t, hystgen_ageing_t *self,
                                      hystgen_real_t travel) {
    hystgen_real_t inside;
    if (travel < 0) {
        inside = 0;
    } else if (travel > t->last) {
        inside = t->last;
    } else {
        inside = travel;
    }
    self->high = inside;
    self->low = 0;
    self->own = true;
    self->gain = hystgen_ageing_gain(t, inside);
    self->inverse = 1 / self->gain;
    return inside < travel || inside > travel;
}

/* Sets a gain that replaces the one from the travel. Returns whether it had to be limited. */
static bool hystgen_ageing_set(const hystgen_ageing_table_t *t, hystgen_ageing_t *self,
                               hystgen_real_t gain) {
    hystgen_real_t inside;
    if (gain < t->least) {
        inside = t->least;
    } else if (gain > t->largest) {
        inside = t->largest;
    } else {
        inside = gain;
    }
    self->own = false;
    self->gain = inside;
    self->inverse = 1 / inside;
    return inside < gain || inside > gain;
}

/* The drive has moved by `way`. Newton steps update the reciprocal of the gain. */
static void hystgen_ageing_move(const hystgen_ageing_table_t *t, hystgen_ageing_t *self,
                                hystgen_real_t way) {
    const hystgen_real_t high = self->high;
    hystgen_real_t change = (way >= 0 ? way : -way) + self->low;
    hystgen_real_t next = high + change;
    if (next > t->last) {
        next = t->last;
        change = next - high;
    }
    self->high = next;
    self->low = change - (next - high); /* rounding remainder of the sum */
    if (self->own) {
        unsigned int i;
        self->gain = hystgen_ageing_gain(t, next);
        for (i = 0; i < t->turns; ++i) {
            self->inverse = self->inverse * (2 - self->gain * self->inverse);
        }
    }
}

/* The input for the output y. */
static hystgen_real_t hystgen_ageing_solve(const hystgen_ageing_t *self, hystgen_real_t y) {
    return y * self->inverse;
}

/* The output for the input x. */
static hystgen_real_t hystgen_ageing_absorb(const hystgen_ageing_t *self, hystgen_real_t x) {
    return self->gain * x;
}

#endif
