#include "hystgen_runtime.h"

typedef struct {
    hystgen_number_t rate;
    hystgen_number_t inverse_rate;
} hystgen_user_follower_table_t;

typedef struct {
    hystgen_signal_t reached;
} hystgen_user_follower_t;

static hystgen_signal_t hystgen_user_follower_rest(const hystgen_user_follower_table_t *t,
                                                   hystgen_user_follower_t *self,
                                                   hystgen_signal_t x)
{
    (void)t;
    self->reached = x;
    return x;
}

static hystgen_signal_t hystgen_user_follower_resting(const hystgen_user_follower_table_t *t,
                                                      hystgen_signal_t y)
{
    (void)t;
    return y;
}

static hystgen_signal_t hystgen_user_follower_solve(const hystgen_user_follower_table_t *t,
                                                    hystgen_user_follower_t *self,
                                                    hystgen_signal_t y)
{
    return self->reached + hystgen_product(&t->inverse_rate, y - self->reached);
}

static hystgen_signal_t hystgen_user_follower_absorb(const hystgen_user_follower_table_t *t,
                                                     hystgen_user_follower_t *self,
                                                     hystgen_signal_t x)
{
    self->reached = self->reached + hystgen_product(&t->rate, x - self->reached);
    return self->reached;
}
