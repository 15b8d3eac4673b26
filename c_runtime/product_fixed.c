#include "hystgen_runtime.h"

/* x times a number from the table of a user's own block. */
static hystgen_signal_t hystgen_product(const hystgen_number_t *number, hystgen_signal_t x) {
    return hystgen_times(x >> number->drop, &number->factor) *
           ((hystgen_signal_t)1 << number->lift);
}
