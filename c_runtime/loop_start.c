#include "hystgen_runtime.h"

/* Start memory: all plays hold the same value. */
static void hystgen_loop_init(hystgen_play_t *play) {
    hystgen_loop_rest(&hystgen_model_tables, play, HYSTGEN_START);
}
