#include "hystgen_runtime.h"

/* A drive code as a signal. */
static inline hystgen_signal_t hystgen_quiet_signal(hystgen_real_t v) {
    return (hystgen_signal_t)v * ((hystgen_signal_t)1 << HYSTGEN_DRIVE_BITS);
}
