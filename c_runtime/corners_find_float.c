#include "hystgen_runtime.h"

/* First of the rising steps k .. high-1, thresholds or start levels, that a way x has not reached, or high. */
static unsigned int hystgen_step_not_reached(const hystgen_real_t *step, unsigned int k, unsigned int high,
                                             hystgen_real_t x)
{
    while (k < high) {
        const unsigned int middle = (k + high) / 2;
        if (x >= step[middle]) {
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
            *k = hystgen_step_not_reached(t->start_level, *k, high, x + c->pass[!rising]);
            if (*k == c->end) { /* the last one too */
                left = 0;
                *end = *k;
            }
        } else if (c->side != (rising ? -1 : 1)) {
            *k = hystgen_step_not_reached(t->start_level, *k, c->end - 1u, hystgen_half(x + c->pass[!rising]));
        }
    }
    return left;
}

/* Whether a move to output x, or to the input `limit` if that comes first, takes along the last play that a corner
   holds, whose output is reached from `level` on. */
static bool hystgen_taken(const hystgen_tables_t *t, const hystgen_corner_t *c, hystgen_real_t x, hystgen_real_t level,
                          hystgen_real_t limit, bool rising)
{
    return x >= level && hystgen_reached(limit, hystgen_activation(t, c, c->end - 1u, rising), rising);
}

/* First of the plays k .. high-1 that such a move does not take along, by the way of its output or by that to the limit,
   or high. */
HYSTGEN_COPIES unsigned int hystgen_play_not_taken(const hystgen_tables_t *t, unsigned int k, unsigned int high,
                                                   hystgen_real_t way, hystgen_real_t most)
{
    const hystgen_real_t *level = t->start_level;
    const hystgen_real_t *threshold = t->threshold;
    while (k < high) {
        const unsigned int middle = (k + high) / 2;
        if (most < threshold[middle]) {
            high = middle;
            continue;
        }
        if (way >= level[middle]) {
            k = middle + 1;
        } else {
            high = middle;
        }
    }
    return k;
}

/* Where such a move leads that leaves no corners but those of the start: as below. */
HYSTGEN_COPIES unsigned int hystgen_corners_find_start(const hystgen_tables_t *t, const hystgen_corner_t *corner,
                                                       unsigned int left, unsigned int *k, unsigned int *end,
                                                       hystgen_real_t x, hystgen_real_t limit, bool rising)
{
    unsigned int low = 1;
    const hystgen_corner_t *c;
    while (low < left) {
        const unsigned int middle = (low + left) / 2;
        c = &corner[middle];
        if (hystgen_taken(t, c, x, t->start_level[c->end - 1] - c->pass[!rising], limit, rising)) {
            left = middle;
            *k = c->end;
            *end = *k;
        } else {
            low = middle + 1;
        }
    }
    if (left == 0) {
        return 0;
    }
    c = &corner[left - 1];
    *k = hystgen_play_not_taken(t, *k, left == 1 ? c->end : c->end - 1u, x + c->pass[!rising],
                                rising ? limit - c->extremum : c->extremum - limit);
    if (*k == c->end) { /* the last one too */
        *end = *k;
        return 0;
    }
    return left;
}

/* Where a move leads that ends at the input `limit`, that of a limit of the drive, if that comes before output x; what
   begins and ends it as above. No turning point lies beyond the limit, so that all corners are left but those of the
   start and the first one above them, which the caller has asked x for. */
HYSTGEN_COPIES unsigned int hystgen_corners_find_within(const hystgen_tables_t *t, const hystgen_corner_t *corner,
                                                        unsigned int start, unsigned int depth, unsigned int *k,
                                                        unsigned int *end, hystgen_real_t x, hystgen_real_t limit,
                                                        bool rising)
{
    *end = 0;
    if (depth > start + 1u) {
        *k = corner[start + 1u].end;
        *end = *k;
    } else if (*k > 1) {
        *k = *k - 1; /* what the output tells to follow may lie beyond the limit */
    } else {
        /* a turn */
    }
    if (depth > start) {
        const hystgen_corner_t *c = &corner[start];
        const unsigned int high = c->end - 1u;
        const bool by_output = x >= c->pass[rising];
        if (!by_output || !hystgen_reached(limit, hystgen_activation(t, c, high, rising), rising)) {
            if (rising ? c->side > 0 : c->side < 0) { /* it lets go of its plays one by one */
                const hystgen_real_t most = hystgen_half(rising ? limit - c->extremum : c->extremum - limit);
                *k = by_output ? hystgen_step_not_reached(t->threshold, *k, high, most)
                               : hystgen_play_not_taken(t, *k, high, hystgen_half(x + c->pass[!rising]), most);
            }
            return start + 1u;
        }
        *k = c->end;
        *end = *k;
    }
    return hystgen_corners_find_start(t, corner, start, k, end, x, limit, rising);
}
