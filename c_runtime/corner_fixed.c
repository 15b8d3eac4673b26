#include "hystgen_runtime.h"

/* Output at the moment that a corner was left. */
static hystgen_sum_t hystgen_held(const hystgen_corner_t *c)
{
    return c->output;
}

/* Writes the corner that a rising (side -1) or falling (side +1) move leaves at w, or that the start does (0). */
static void hystgen_write_corner(const hystgen_tables_t *t, hystgen_corner_t *c, hystgen_play_t w,
                                 hystgen_sum_t output, unsigned int end, int side)
{
    (void)t;
    c->output = output;
    c->extremum = w;
    c->end = (uint_least16_t)end;
    c->side = (int_least8_t)side;
}

/* Leaves the corner of turning back, at `output`, above those that are held; until then w has risen, or fallen. */
static void hystgen_leave_corner(const hystgen_tables_t *t, const hystgen_memory_t *m, hystgen_corner_t *corner,
                                 hystgen_sum_t output, bool risen)
{
    hystgen_write_corner(t, &corner[m->here.depth], m->w, output, m->here.k, risen ? -1 : 1);
}
