/* Elements in parallel with the plays, which follow one curve C from each turn of their input on:
   z/width, in the direction of the input, changes as C does over the distance moved. Called by
   compensator/chain/moving_plays.c. */
#ifndef HYSTGEN_BOUC_WEN_ELEMENTS_C
#define HYSTGEN_BOUC_WEN_ELEMENTS_C
#include "compensator/chain/model.h"

#ifdef HYSTGEN_HAS_ELEMENTS
/* Degree of the polynomials of C and of its inverse. */
#define HYSTGEN_CURVE_DEGREE 7u

/* The piece of the curve in which a place (column 0) or a value of C (column 1) lies. */
static unsigned int hystgen_piece_at(unsigned int column, hystgen_real_t x) {
    unsigned int low = 0;
    unsigned int high = HYSTGEN_PIECES;
    while (high - low > 1u) {
        const unsigned int middle = (low + high) / 2;
        const bool before = x < hystgen_piece[middle][column];
        low = before ? low : middle;
        high = before ? middle : high;
    }
    return low;
}

/* x (c_0 + x (c_1 + ..)). Sets its slope. */
static hystgen_real_t hystgen_polynomial(const hystgen_real_t *c, hystgen_real_t x,
                                         hystgen_real_t *slope) {
    hystgen_real_t value = c[HYSTGEN_CURVE_DEGREE - 1u];
    hystgen_real_t steep = value;
    unsigned int k;
    for (k = HYSTGEN_CURVE_DEGREE - 1u; k > 0; --k) {
        value = value * x + c[k - 1u];
        steep = steep * x + value;
    }
    *slope = steep;
    return value * x;
}

/* Change of z/width of an element over the distance x since its last turn, in widths. Sets its
   slope. Backwards, where a search may try inputs, the curve goes on straight. */
static hystgen_real_t hystgen_gained(const hystgen_element_t *e, hystgen_real_t x,
                                     hystgen_real_t *slope) {
    if (x < 0) {
        *slope = e->c[0];
        return e->c[0] * x;
    }
    if (x < e->until) {
        return hystgen_polynomial(e->c, x, slope);
    }
    const hystgen_real_t *piece = hystgen_piece[hystgen_piece_at(0, e->place + x)];
    const hystgen_real_t h = e->place + x - piece[0];
    return piece[1] + hystgen_polynomial(&piece[2], h, slope) - e->level;
}

/* Puts an element where C is s, with the polynomial of C from there on. */
static void hystgen_element_put(hystgen_element_t *e, hystgen_real_t s) {
    const unsigned int i = hystgen_piece_at(1, s);
    const hystgen_real_t *piece = hystgen_piece[i];
    const hystgen_real_t u = s - piece[1];
    hystgen_real_t h = piece[2u * HYSTGEN_CURVE_DEGREE + 1u];
    unsigned int first;
    unsigned int k;
    for (k = 2u * HYSTGEN_CURVE_DEGREE; k > HYSTGEN_CURVE_DEGREE + 1u; --k) {
        h = h * u + piece[k];
    }
    h = h * u;
    for (k = 0; k < HYSTGEN_CURVE_DEGREE; ++k) {
        e->c[k] = piece[2u + k];
    }
    e->level = piece[1];
    for (first = 0; first < HYSTGEN_CURVE_DEGREE; ++first) {
        for (k = HYSTGEN_CURVE_DEGREE - 1u; k > 0 && k >= first; --k) {
            e->c[k - 1u] = e->c[k - 1u] + h * e->c[k];
        }
        if (first == 0) {
            e->level = piece[1] + h * e->c[0];
        }
    }
    e->place = piece[0] + h;
    e->until = i + 1u < HYSTGEN_PIECES ? hystgen_piece[i + 1u][0] - e->place : 0;
}

/* Brings an element to rest, with z = 0. */
static void hystgen_element_unload(hystgen_element_t *e) {
    e->high = 0;
    e->low = 0;
    hystgen_element_put(e, 0);
}

/* Turns an element at the distance x since its last turn: z/width changes its sign, exactly, with a
   rounding remainder. */
static void hystgen_element_turn(hystgen_element_t *e, hystgen_real_t x) {
    const hystgen_real_t last = hystgen_piece[HYSTGEN_PIECES - 1u][1];
    hystgen_real_t slope;
    const hystgen_real_t more = hystgen_gained(e, x, &slope);
    const hystgen_real_t high = e->high + more;
    const hystgen_real_t part = high - e->high;
    const hystgen_real_t low = e->low + ((e->high - (high - part)) + (more - part));
    const hystgen_real_t whole = high + low;
    e->low = whole - high - low;
    e->high = -whole;
    if (whole > last || whole < -last) {
        e->high = whole > last ? -last : last;
        e->low = 0;
    }
    hystgen_element_put(e, e->high);
}

/* z/width of an element at the distance x since its last turn. Sets its slope. */
static inline hystgen_real_t hystgen_element_at(const hystgen_element_t *e, hystgen_real_t x,
                                                hystgen_real_t *slope) {
    const hystgen_real_t more = hystgen_gained(e, x, slope);
    return e->high + more + e->low;
}
#endif

#endif
