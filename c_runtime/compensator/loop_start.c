/* Operators of the loop engine: plays start at one value, or each at its own. Called by init. */
#ifndef HYSTGEN_LOOP_START_C
#define HYSTGEN_LOOP_START_C
#include "compensator/model.h"

/* Start memory. */
static void hystgen_loop_init(hystgen_play_t *play) {
#ifdef HYSTGEN_HAS_START_LIST
    hystgen_loop_start(&hystgen_model_tables, play, hystgen_model_start);
#else
    hystgen_loop_rest(&hystgen_model_tables, play, HYSTGEN_START);
#endif
}

#endif
