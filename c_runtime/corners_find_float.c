#include "hystgen_runtime.h"

/* First of the start levels k .. high-1 that a way x has not reached, or high. */
static unsigned int hystgen_level_not_reached(const hystgen_real_t *level, unsigned int k, unsigned int high,
                                              hystgen_real_t x)
{
    while (k < high) {
        const unsigned int middle = (k + high) / 2;
        if (x >= level[middle]) {
            k = middle + 1;
        } else {
            high = middle;
        }
    }
    return k;
}

/* Where a move to output x leads: corners it leaves of `depth`, the lowest `start` of which are of the start; *k plays
   follow then, of which the first ones are known to; *end is the first play beyond what was left, if any was. x as a
   rising move sees it. First the blocks that are passed whole, by bisection, those of the start but the lowest
   likewise, then the plays of one. A copy for each direction, which asks for it nowhere. */
HYSTGEN_COPIES unsigned int hystgen_corners_find(const hystgen_tables_t *t, const hystgen_corner_t *corner,
                                                 unsigned int start, unsigned int depth, unsigned int *k,
                                                 unsigned int *end, hystgen_real_t x, bool rising)
{
    unsigned int low = start;
    unsigned int left = depth;
    while (low < left) {
        const unsigned int middle = (low + left) / 2;
        if (x >= corner[middle].pass[rising]) {
            left = middle;
        } else {
            low = middle + 1;
        }
    }
    if (start > 1 && left > 1 && left <= start) {
        low = 1;
        while (low < left) {
            const unsigned int middle = (low + left) / 2;
            const hystgen_corner_t *c = &corner[middle];
            if (x >= t->start_level[c->end - 1] - c->pass[!rising]) {
                left = middle;
            } else {
                low = middle + 1;
            }
        }
    }
    *end = 0;
    if (left < depth) {
        *k = corner[left].end;
        *end = *k;
    }
    if (left > 0) {
        const hystgen_corner_t *c = &corner[left - 1];
        if (c->side == 0) {
            const unsigned int high = left == 1 ? c->end : c->end - 1u;
            *k = hystgen_level_not_reached(t->start_level, *k, high, x + c->pass[!rising]);
            if (*k == c->end) { /* the last one too */
                left = 0;
                *end = *k;
            }
        } else if (c->side != (rising ? -1 : 1)) {
            *k = hystgen_level_not_reached(t->start_level, *k, c->end - 1u, hystgen_half(x + c->pass[!rising]));
        }
    }
    return left;
}

/* First of the plays k .. high-1 that a way has not reached, by its output or by its input, or high. */
static unsigned int hystgen_play_not_reached(const hystgen_tables_t *t, unsigned int k, unsigned int high,
                                             hystgen_real_t output, hystgen_real_t input)
{
    while (k < high) {
        const unsigned int middle = (k + high) / 2;
        if (output >= t->start_level[middle] && input >= t->threshold[middle]) {
            k = middle + 1;
        } else {
            high = middle;
        }
    }
    return k;
}
