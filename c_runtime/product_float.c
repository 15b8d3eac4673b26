#include "hystgen_runtime.h"

/* x times a number from the table of a user's own block. */
static inline hystgen_signal_t hystgen_product(const hystgen_number_t *number, hystgen_signal_t x) {
    return *number * x;
}
