#include "hystgen_runtime.h"

/* First of the start levels k .. high-1 that a way x has not reached, or high; mostly it is the first. */
static unsigned int hystgen_level_not_reached(const hystgen_real_t *level, unsigned int k, unsigned int high,
                                              hystgen_real_t x)
{
    if (k < high && x >= level[k]) {
        ++k;
        while (k < high) {
            const unsigned int middle = (k + high) / 2;
            if (x >= level[middle]) {
                k = middle + 1;
            } else {
                high = middle;
            }
        }
    }
    return k;
}

/* Where a move to output x leads: corners it leaves of `depth`, the lowest `start` of which are of the start; *k plays
   follow then, of which the first ones are known to. x as a rising move sees it. First the blocks that are passed
   whole, from the last one left by bisection, those of the start but the lowest likewise, then the plays of one. */
HYSTGEN_API unsigned int hystgen_corners_find(const hystgen_tables_t *t, const hystgen_corner_t *corner,
                                              unsigned int start, unsigned int depth, unsigned int *k,
                                              hystgen_real_t x, bool rising)
{
    unsigned int low = start;
    unsigned int left = depth;
    unsigned int probe = depth;
    while (low < left) {
        if (x >= corner[probe - 1].pass[rising]) {
            left = probe - 1;
        } else {
            low = probe;
        }
        probe = (low + left + 1) / 2;
    }
    if (start > 1 && left > 1 && left <= start) {
        low = 1;
        probe = left;
        while (low < left) {
            const hystgen_corner_t *c = &corner[probe - 1];
            if (x >= t->start_level[c->end - 1] - c->pass[!rising]) {
                left = probe - 1;
            } else {
                low = probe;
            }
            probe = (low + left + 1) / 2;
        }
    }
    if (left < depth) {
        *k = corner[left].end;
    }
    if (left > 0) {
        const hystgen_corner_t *c = &corner[left - 1];
        if (c->side == 0) {
            const unsigned int high = left == 1 ? c->end : c->end - 1u;
            *k = hystgen_level_not_reached(t->start_level, *k, high, x + c->pass[!rising]);
            if (*k == c->end) { /* the last one too */
                --left;
            }
        } else if (c->side != (rising ? -1 : 1)) {
            *k = hystgen_level_not_reached(t->start_level, *k, c->end - 1u, hystgen_half(x + c->pass[!rising]));
        }
    }
    return left;
}
