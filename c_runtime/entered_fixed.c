#include "hystgen_runtime.h"

/* A drive, which may lie beyond every code, as a signal. */
static inline hystgen_signal_t hystgen_entered_drive(hystgen_reach_t v) {
    return (hystgen_signal_t)v * ((hystgen_signal_t)1 << HYSTGEN_DRIVE_BITS);
}
