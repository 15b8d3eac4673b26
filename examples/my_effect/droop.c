#include "hystgen_runtime.h"

/* The functions of `model.py`, operation for operation, in the same order: only then are the bits
   those of Python. What begins with hystgen_ gets the model's name in emitted files. */

typedef struct {
    hystgen_real_t inverse_slope;
    hystgen_real_t rest;
    hystgen_real_t inverse_rest;
    hystgen_real_t share;
    hystgen_real_t rate;
    hystgen_real_t early;
    hystgen_real_t late;
} hystgen_user_droop_table_t;

typedef struct {
    hystgen_real_t leaked;
    hystgen_real_t before; /* input of the last sample */
} hystgen_user_droop_t;

/* Everything has settled at the input x. Returns the output. */
static hystgen_real_t hystgen_user_droop_rest(const hystgen_user_droop_table_t *t,
                                              hystgen_user_droop_t *self, hystgen_real_t x)
{
    self->leaked = t->share * x;
    self->before = x;
    return t->rest * x;
}

/* The input of the settled output y. */
static hystgen_real_t hystgen_user_droop_resting(const hystgen_user_droop_table_t *t,
                                                 hystgen_real_t y)
{
    return y * t->inverse_rest;
}

/* The input that gives the output y at this sample. */
static hystgen_real_t hystgen_user_droop_solve(const hystgen_user_droop_table_t *t,
                                               const hystgen_user_droop_t *self, hystgen_real_t y)
{
    const hystgen_real_t ahead = self->leaked + (t->early * self->before - t->rate * self->leaked);
    return (y + ahead) * t->inverse_slope;
}

/* The input is x at this sample. Returns the output. */
static hystgen_real_t hystgen_user_droop_absorb(const hystgen_user_droop_table_t *t,
                                                hystgen_user_droop_t *self, hystgen_real_t x)
{
    self->leaked =
        self->leaked + ((t->early * self->before + t->late * x) - t->rate * self->leaked);
    self->before = x;
    return x - self->leaked;
}
