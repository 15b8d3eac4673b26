#include "hystgen_runtime.h"

/* How far a rising x lies above what a corner holds, in the measure of the thresholds. */
static hystgen_sum_t hystgen_way(hystgen_sum_t x, hystgen_sum_t held, int side)
{
    return side == 0 ? x - held : hystgen_half(x - held);
}

/* Where the last play of a corner's block starts to follow a rising move. */
static hystgen_sum_t hystgen_last_step(hystgen_sum_t held, int side, hystgen_sum_t steps)
{
    return side < 0 ? held : side > 0 ? held + (steps + steps) : held + steps;
}

/* Whether a corner lets go of its plays one by one, and not all of them at its extremum. */
static bool hystgen_opposite(int side, bool rising)
{
    return rising ? side >= 0 : side <= 0;
}

static bool hystgen_passed(hystgen_sum_t output, hystgen_sum_t level, bool rising)
{
    return rising ? output >= level : output <= level;
}

/* As hystgen_threshold_not_reached, over outputs gained. */
static unsigned int hystgen_level_not_reached(const hystgen_sum_t *step, unsigned int k, unsigned int high,
                                              hystgen_sum_t x)
{
    if (k < high && x >= step[k]) {
        ++k;
        if (k < high && x >= step[k]) {
            ++k;
            while (k < high) {
                const unsigned int middle = (k + high) / 2;
                if (x >= step[middle]) {
                    k = middle + 1;
                } else {
                    high = middle;
                }
            }
        }
    }
    return k;
}

/* As hystgen_find_by_input, for a move to an output. The last corner is looked at first, since mostly it is not passed;
   whole numbers lead to the same place in any order. */
static void hystgen_find_by_output(const hystgen_tables_t *t, const hystgen_corner_t *corner, unsigned int depth,
                                   unsigned int k, hystgen_sum_t output, hystgen_place_t *p)
{
    const bool rising = p->rising;
    const hystgen_sum_t x = rising ? output : -output; /* everything as a rising move sees it */
    unsigned int low = 0;
    unsigned int left = depth;
    unsigned int probe = left;
    while (low < left) {
        const hystgen_corner_t *c = &corner[probe - 1];
        if (x >= hystgen_last_step(rising ? c->output : -c->output, rising ? c->side : -c->side,
                                   t->start_level[c->end - 1])) {
            left = probe - 1;
            k = c->end;
        } else {
            low = probe;
        }
        probe = (low + left + 1) / 2;
    }
    if (left > 0 && hystgen_opposite(corner[left - 1].side, rising)) {
        const hystgen_corner_t *c = &corner[left - 1];
        k = hystgen_level_not_reached(t->start_level, k, c->end - 1u,
                                      hystgen_way(x, rising ? c->output : -c->output, c->side));
    }
    p->depth = (uint_least16_t)left;
    p->k = (uint_least16_t)k;
}
