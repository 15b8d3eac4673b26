/* Operators of engine loop: each play starts at its own value. Called by init. */
#include "compensator/model.h"

/* Start memory: each play holds its own value. */
static void hystgen_loop_init(hystgen_play_t *play) {
    hystgen_loop_start(&hystgen_model_tables, play, hystgen_model_start);
}
