/* Operators of engine loop: all plays start at one value. Called by init. */
#ifndef HYSTGEN_LOOP_START_C
#define HYSTGEN_LOOP_START_C
#include "compensator/model.h"

/* Start memory: all plays hold the same value. */
static void hystgen_loop_init(hystgen_play_t *play) {
    hystgen_loop_rest(&hystgen_model_tables, play, HYSTGEN_START);
}

#endif
