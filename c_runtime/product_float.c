#include "hystgen_runtime.h"

/* A number of the table of a user's own block times x. */
static inline hystgen_signal_t hystgen_product(const hystgen_number_t *number, hystgen_signal_t x) {
    return *number * x;
}
