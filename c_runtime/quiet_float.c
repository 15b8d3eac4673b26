#include "hystgen_runtime.h"

/* A drive as a signal. */
static inline hystgen_signal_t hystgen_quiet_signal(hystgen_real_t v) {
    return v;
}
