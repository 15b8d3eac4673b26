#include "hystgen_runtime.h"

/* A drive at a limited rate. What rounding takes from it is kept beside it, as is what it took from
   the rate: no number of steps adds it up, and a step may be smaller than the drive's last bit. */

/* One step of `move`, from which rounding took `more`. */
static void hystgen_ramp_on(hystgen_ramp_t *ramp, hystgen_reach_t move, hystgen_play_t more) {
    const hystgen_reach_t before = ramp->drive;
    const hystgen_reach_t next = before + move;
    const hystgen_reach_t moved = next - before;
    const hystgen_play_t lost = (before - (next - moved)) + (move - moved);
    const hystgen_play_t left = lost + (ramp->rest + more);
    ramp->drive = next + left;
    ramp->rest = left - (ramp->drive - next);
}
