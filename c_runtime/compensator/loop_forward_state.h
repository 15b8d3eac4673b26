/* The memory of the forward operator of engine loop. */
#include "compensator/model.h"
#ifndef HYSTGEN_LOOP_FORWARD_STATE_H
#define HYSTGEN_LOOP_FORWARD_STATE_H

/* One forward operator: drive in, output out. Plain data, owned by the caller. */
typedef struct {
    hystgen_real_t answer; /* output returned last */
    unsigned int status;
    hystgen_play_t play[HYSTGEN_N_PLAYS + 1]; /* play 0 is the input of the plays */
} hystgen_forward_t;

#endif
