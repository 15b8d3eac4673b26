#include "hystgen_runtime.h"

/* A drive at a limited rate. What rounding takes from it is kept beside it, as is what it took from
   the rate: no number of steps adds it up, and a step may be smaller than the drive's last bit. */

/* The drive `before`, of which rounding has left `rest`, one step of `move` and `more` later. */
static hystgen_ramp_t hystgen_ramp(hystgen_reach_t before, hystgen_play_t rest,
                                   hystgen_reach_t move, hystgen_play_t more) {
    const hystgen_reach_t next = before + move;
    const hystgen_reach_t moved = next - before;
    const hystgen_play_t lost = (before - (next - moved)) + (move - moved);
    const hystgen_play_t left = lost + (rest + more);
    const hystgen_reach_t drive = next + left;
    const hystgen_ramp_t ramp = {drive, left - (drive - next)};
    return ramp;
}
