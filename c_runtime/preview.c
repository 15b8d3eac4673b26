#include "hystgen_runtime.h"

/* A line of references. The newest one is the argument of step and lies ahead of the motion. */

/* Appends a sample; the first one fills the line. Stores go through volatile where a compiler would
   otherwise call memmove, which a freestanding target need not have. */
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
