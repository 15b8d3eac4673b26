/* A line of references. The newest one is the argument of step and lies ahead of the motion. Called
   by the functions that emission writes for a chain, see compensator/chain/model.h. */
#include "compensator/chain/model.h"
#include "arithmetic/factors.c"

/* Appends a sample; the first one fills the line. Stores go through volatile where a compiler would
   otherwise call memmove, which a freestanding target may lack. */
static void hystgen_preview_put(hystgen_signal_t *line, bool *filled, hystgen_signal_t x) {
    volatile hystgen_signal_t *entry = line;
    unsigned int i;
    for (i = 0; i + 1u < HYSTGEN_TAPS; ++i) {
        entry[i] = *filled ? line[i + 1u] : x;
    }
    line[HYSTGEN_TAPS - 1u] = x;
    *filled = true;
}

/* Appends the newest sample again, if there is one. */
static void hystgen_preview_repeat(hystgen_signal_t *line, bool *filled) {
    if (*filled) {
        hystgen_preview_put(line, filled, line[HYSTGEN_TAPS - 1u]);
    }
}

/* The output to reach at this sample: the weighted sum of the line. */
static hystgen_signal_t hystgen_preview_target(const hystgen_factor_t *tap,
                                               const hystgen_signal_t *line) {
    hystgen_signal_t sum = hystgen_times(line[0], &tap[0]);
    unsigned int i;
    for (i = 1; i < HYSTGEN_TAPS; ++i) {
        sum += hystgen_times(line[i], &tap[i]);
    }
    return sum;
}
