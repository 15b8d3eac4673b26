/* A sum of dead zones in floating point and its inverse. Called by the functions that emission
   writes for a model's stages. */
#include "hystgen_runtime.h"

/* Output of a dead-zone sum at x; finds the straight piece by bisection. */
HYSTGEN_API hystgen_real_t hystgen_dead_zone_forward(const hystgen_dead_zone_t *z,
                                                     hystgen_real_t x) {
    unsigned int low = 0;
    unsigned int high = z->n;
    while (low < high) {
        const unsigned int middle = (low + high) / 2;
        if (x >= z->break_x[middle]) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    return z->anchor_y[low] + (x - z->anchor_x[low]) * z->slope[low];
}

/* Input of a dead-zone sum for its output y; finds the straight piece by bisection. */
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
