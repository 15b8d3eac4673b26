#include "hystgen_runtime.h"

/* Arguments in fixed point and their limits. */

/* Every code is a finite number. */
static inline bool hystgen_finite(hystgen_signal_t x) {
    (void)x;
    return true;
}

static inline bool hystgen_is_drive(hystgen_real_t v) {
    return hystgen_clamp_drive(v) == v;
}

static inline bool hystgen_is_reference(hystgen_real_t u) {
    return hystgen_inverse_clamp(u) == u;
}

/* An applied drive, limited to its range. */
static inline hystgen_real_t hystgen_applied_drive(hystgen_real_t v) {
    return hystgen_clamp_drive(v);
}
