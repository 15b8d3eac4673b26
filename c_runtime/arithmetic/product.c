/* The product for effects written once for every arithmetic: a user's own, and those in the
   catalogue with a part.c. Called by the C files of these effects. */
#ifndef HYSTGEN_ARITHMETIC_PRODUCT_C
#define HYSTGEN_ARITHMETIC_PRODUCT_C
#ifdef HYSTGEN_FIXED
#include "compensator/chain/model.h"
#include "arithmetic/factors.c"
#endif
#include "arithmetic/numbers.h"

#ifdef HYSTGEN_FIXED
/* x times a number from the table of a user's own block. */
static hystgen_signal_t hystgen_product(const hystgen_number_t *number, hystgen_signal_t x) {
    return hystgen_times(x >> number->drop, &number->factor) *
           ((hystgen_signal_t)1 << number->lift);
}
#else
/* x times a number from the table of a user's own block. */
static inline hystgen_signal_t hystgen_product(const hystgen_number_t *number, hystgen_signal_t x) {
    return *number * x;
}
#endif

#endif
