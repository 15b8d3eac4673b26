#include "hystgen_runtime.h"

/* The functions of `model.py`, operation for operation, in the same order: only then do they give
   the same bits as Python, in every arithmetic. In emitted files the model's name replaces the
   prefix hystgen_. */

typedef struct {
    hystgen_number_t inverse_slope;
    hystgen_number_t rest;
    hystgen_number_t inverse_rest;
    hystgen_number_t share;
    hystgen_number_t rate;
    hystgen_number_t early;
    hystgen_number_t late;
} hystgen_user_droop_table_t;

typedef struct {
    hystgen_signal_t leaked;
    hystgen_signal_t before; /* input of the last sample */
} hystgen_user_droop_t;

/* Settle everything at the input x. Returns the output. */
static hystgen_signal_t hystgen_user_droop_rest(const hystgen_user_droop_table_t *t,
                                                hystgen_user_droop_t *self, hystgen_signal_t x)
{
    self->leaked = hystgen_product(&t->share, x);
    self->before = x;
    return hystgen_product(&t->rest, x);
}

/* The input that belongs to the settled output y. */
static hystgen_signal_t hystgen_user_droop_resting(const hystgen_user_droop_table_t *t,
                                                   hystgen_signal_t y)
{
    return hystgen_product(&t->inverse_rest, y);
}

/* The input that gives the output y at this sample. */
static hystgen_signal_t hystgen_user_droop_solve(const hystgen_user_droop_table_t *t,
                                                 const hystgen_user_droop_t *self,
                                                 hystgen_signal_t y)
{
    const hystgen_signal_t leaking = hystgen_product(&t->early, self->before);
    const hystgen_signal_t change = leaking - hystgen_product(&t->rate, self->leaked);
    return hystgen_product(&t->inverse_slope, y + (self->leaked + change));
}

/* Take in the input x at this sample. Returns the output. */
static hystgen_signal_t hystgen_user_droop_absorb(const hystgen_user_droop_table_t *t,
                                                  hystgen_user_droop_t *self, hystgen_signal_t x)
{
    const hystgen_signal_t leaking =
        hystgen_product(&t->early, self->before) + hystgen_product(&t->late, x);
    self->leaked = self->leaked + (leaking - hystgen_product(&t->rate, self->leaked));
    self->before = x;
    return x - self->leaked;
}
