#include "hystgen_runtime.h"

/* Whether a drive that should go back by `back` goes to the other branch, `way` from there: only if
   holding misses more than what the lag misses of that way in the first sample of a turn. */
static inline bool hystgen_turns(hystgen_signal_t back, hystgen_signal_t way) {
    return back - HYSTGEN_HOLD > hystgen_inverse_missed(way < 0 ? -way : way);
}
