#include "hystgen_runtime.h"

/* Input at y of a dead-zone sum, by bisection for the straight piece. */
HYSTGEN_API hystgen_real_t hystgen_dead_zone_inverse(const hystgen_dead_zone_t *z,
                                                     hystgen_real_t y) {
    unsigned int low = 0;
    unsigned int high = z->n;
    while (low < high) {
        const unsigned int middle = (low + high) / 2;
        if (y >= z->break_y[middle]) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    return z->anchor_x[low] + (y - z->anchor_y[low]) * z->inverse_slope[low];
}
