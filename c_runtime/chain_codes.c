#include "hystgen_runtime.h"

/* Operators of engine loop without effects, in fixed point: drives are codes on their way to the
   plays, and sums of the plays have HYSTGEN_FRACTION bits below an output code. */

/* A drive code as a signal. */
static inline hystgen_signal_t hystgen_entered_drive(hystgen_reach_t v) {
    return v;
}

static inline hystgen_fine_t hystgen_arriving(hystgen_signal_t a) {
    return (hystgen_fine_t)a;
}

static inline hystgen_signal_t hystgen_entered_level(hystgen_real_t u) {
    return (hystgen_signal_t)u * ((hystgen_signal_t)1 << HYSTGEN_FRACTION);
}

static inline hystgen_reach_t hystgen_drive_code(hystgen_signal_t v) {
    return (hystgen_reach_t)v;
}

static inline hystgen_real_t hystgen_output_code(hystgen_signal_t y, unsigned int *status) {
    return hystgen_code(y, status);
}

static inline hystgen_signal_t hystgen_level(hystgen_sum_t sum) {
    return sum;
}

static inline hystgen_sum_t hystgen_asked(hystgen_signal_t h) {
    return h;
}
