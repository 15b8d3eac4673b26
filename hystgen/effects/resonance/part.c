#include "hystgen_runtime.h"

/* The functions of `part.py`, operation for operation, in the same order. */

typedef struct {
    hystgen_number_t keep;
    hystgen_number_t turn;
    hystgen_number_t swing;
    hystgen_number_t lead;
    hystgen_number_t push;
    hystgen_number_t inverse;
    hystgen_number_t none;
} hystgen_resonance_part_table_t;

typedef struct {
    hystgen_signal_t before; /* input of the last sample */
    hystgen_signal_t off;    /* output minus input */
    hystgen_signal_t rate;
} hystgen_resonance_part_t;

/* Settles everything at the input x. Returns the output. */
static hystgen_signal_t hystgen_resonance_part_rest(const hystgen_resonance_part_table_t *t,
                                                    hystgen_resonance_part_t *self,
                                                    hystgen_signal_t x) {
    self->before = x;
    self->off = hystgen_product(&t->none, x);
    self->rate = hystgen_product(&t->none, x);
    return x;
}

/* The input for the settled output y. */
static hystgen_signal_t hystgen_resonance_part_resting(const hystgen_resonance_part_table_t *t,
                                                       hystgen_signal_t y) {
    (void)t;
    return y;
}

/* The input for the output y at this sample. */
static hystgen_signal_t hystgen_resonance_part_solve(const hystgen_resonance_part_table_t *t,
                                                     const hystgen_resonance_part_t *self,
                                                     hystgen_signal_t y) {
    const hystgen_signal_t swung =
        hystgen_product(&t->keep, self->off) + hystgen_product(&t->turn, self->rate);
    const hystgen_signal_t change = y - self->before - (self->off + swung);
    return self->before + hystgen_product(&t->inverse, change);
}

/* Takes the input x at this sample. Returns the output. */
static hystgen_signal_t hystgen_resonance_part_absorb(const hystgen_resonance_part_table_t *t,
                                                      hystgen_resonance_part_t *self,
                                                      hystgen_signal_t x) {
    const hystgen_signal_t change = x - self->before;
    const hystgen_signal_t off = self->off;
    const hystgen_signal_t rate = self->rate;
    const hystgen_signal_t swung = hystgen_product(&t->keep, off) + hystgen_product(&t->turn, rate);
    const hystgen_signal_t turned =
        hystgen_product(&t->swing, rate) - hystgen_product(&t->turn, off);
    self->off = off + (swung + hystgen_product(&t->lead, change));
    self->rate = rate + (turned + hystgen_product(&t->push, change));
    self->before = x;
    return x + self->off;
}
