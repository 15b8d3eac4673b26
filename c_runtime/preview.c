#include "hystgen_runtime.h"

/* The line of references, of which the newest is the argument of step and lies ahead of the motion.
 */

/* The next sample; the first one stands for all before it too. Stores go through volatile where a
   compiler would otherwise call memmove, which a freestanding target need not have. */
static void hystgen_preview_put(hystgen_real_t *line, bool *filled, hystgen_real_t x)
{
    volatile hystgen_real_t *entry = line;
    unsigned int i;
    for (i = 0; i + 1u < HYSTGEN_TAPS; ++i) {
        entry[i] = *filled ? line[i + 1u] : x;
    }
    line[HYSTGEN_TAPS - 1u] = x;
    *filled = true;
}

/* The newest sample once more, where there is one. */
static void hystgen_preview_repeat(hystgen_real_t *line, bool *filled)
{
    if (*filled) {
        hystgen_preview_put(line, filled, line[HYSTGEN_TAPS - 1u]);
    }
}

/* What has to be given for the motion at this sample: the weighted sum of the line. */
static hystgen_real_t hystgen_preview_target(const hystgen_real_t *tap, const hystgen_real_t *line)
{
    hystgen_real_t sum = tap[0] * line[0];
    unsigned int i;
    for (i = 1; i < HYSTGEN_TAPS; ++i) {
        sum = sum + tap[i] * line[i];
    }
    return sum;
}
