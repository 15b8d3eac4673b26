#include "hystgen_runtime.h"

/* A drive as a signal. */
static inline hystgen_signal_t hystgen_entered_drive(hystgen_reach_t v) {
    return v;
}
