#include "hystgen_runtime.h"

/* Whether a drive that should go back by `back` goes to the other branch, `way` from there. */
static inline bool hystgen_turns(hystgen_signal_t back, hystgen_signal_t way) {
    (void)way;
    return back > HYSTGEN_HOLD;
}
