#include "hystgen_runtime.h"

/* Output at the moment that a corner was left. */
static hystgen_real_t hystgen_held(const hystgen_corner_t *c)
{
    return c->side > 0 ? -c->pass[0] : c->pass[1];
}

/* Writes the corner that a rising (side -1) or falling (side +1) move leaves at w, or that the start does (0). */
static void hystgen_write_corner(const hystgen_tables_t *t, hystgen_corner_t *c, hystgen_real_t w,
                                 hystgen_real_t output, unsigned int end, int side)
{
    if (side < 0) {
        const hystgen_real_t z = t->start_level[end - 1];
        c->pass[0] = (z + z) - output;
        c->pass[1] = output;
    } else if (side > 0) {
        const hystgen_real_t z = t->start_level[end - 1];
        c->pass[0] = -output;
        c->pass[1] = (z + z) + output;
    } else {
        c->pass[0] = -output;
        c->pass[1] = output;
    }
    c->extremum = w;
    c->end = (uint_least16_t)end;
    c->side = (int_least8_t)side;
}

/* Leaves the corner of turning back, at `output`, above those that are held; until then w has risen, or fallen. */
HYSTGEN_COPIES void hystgen_leave_corner(const hystgen_tables_t *t, hystgen_memory_t *m, hystgen_corner_t *corner,
                                         hystgen_real_t output, bool risen)
{
    const unsigned int depth = m->here.depth;
    if (m->start > depth) {
        m->start = (uint_least16_t)depth;
    }
    hystgen_write_corner(t, &corner[depth], m->w, output, m->here.k, risen ? -1 : 1);
}
