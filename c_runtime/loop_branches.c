#include "hystgen_runtime.h"

/* Operators of engine loop: plays behind a memoryless part of two branches. */

/* The actuator is at drive v, whose own move picks the branch. Returns the input of the plays. */
static hystgen_play_t hystgen_forward_arrive(hystgen_forward_t *self, hystgen_real_t v)
{
    self->ascending = v > self->drive ? true : v < self->drive ? false : self->ascending;
    self->drive = v;
    return hystgen_front_forward(v, self->ascending);
}

/* The actuator is at drive v, whose own move picks the branch. Returns the input of the plays. */
static hystgen_play_t hystgen_inverse_arrive(hystgen_inverse_t *self, hystgen_real_t v)
{
    self->ascending = v > self->drive ? true : v < self->drive ? false : self->ascending;
    self->drive = v;
    return hystgen_front_forward(v, self->ascending);
}

/* The drive that gives w on the branch of its own move. */
static hystgen_reach_t hystgen_inverse_drive(hystgen_inverse_t *self, hystgen_real_t level,
                                             hystgen_reach_t w)
{
    bool limited;
    const hystgen_reach_t v = hystgen_inverse_choose(self, level, w, &limited);
    self->level = level;
    if (limited) {
        self->bits |= HYSTGEN_STATUS_DOMAIN;
    }
    return v;
}

void hystgen_forward_init(hystgen_forward_t *self)
{
    hystgen_loop_init(self->play);
    self->drive = HYSTGEN_FORWARD_INIT_DRIVE;
    self->ascending = HYSTGEN_FORWARD_INIT_ASCENDING;
    hystgen_forward_begin(self);
}

void hystgen_forward_reset(hystgen_forward_t *self, hystgen_real_t v)
{
    hystgen_loop_rest(&hystgen_model_tables, self->play, 0);
    self->drive = HYSTGEN_FORWARD_RESET_DRIVE;
    self->ascending = HYSTGEN_FORWARD_RESET_ASCENDING;
    hystgen_forward_begin(self);
    (void)hystgen_forward_step(self, v);
}

void hystgen_inverse_init(hystgen_inverse_t *self)
{
    hystgen_loop_init(self->play);
    self->level = hystgen_inverse_output(self);
    self->ascending = HYSTGEN_INVERSE_INIT_ASCENDING;
    hystgen_inverse_begin(self, HYSTGEN_INVERSE_INIT_DRIVE);
}

void hystgen_inverse_reset(hystgen_inverse_t *self, hystgen_real_t u)
{
    hystgen_loop_rest(&hystgen_model_tables, self->play, 0);
    self->level = hystgen_inverse_output(self);
    self->ascending = HYSTGEN_INVERSE_RESET_ASCENDING;
    hystgen_inverse_begin(self, HYSTGEN_INVERSE_RESET_DRIVE);
    (void)hystgen_inverse_step(self, u);
}
