/* The memory of the forward operator of engine loop, behind two branches. */
#ifndef HYSTGEN_CONFIGURED
#define HYSTGEN_HAS_FRONT
#define HYSTGEN_HAS_TWO_BRANCHES
#endif
#include "compensator/model.h"
#ifndef HYSTGEN_LOOP_FORWARD_BRANCHES_STATE_H
#define HYSTGEN_LOOP_FORWARD_BRANCHES_STATE_H

/* One forward operator: drive in, output out. Plain data, owned by the caller. */
typedef struct {
    hystgen_real_t drive;  /* seen last */
    hystgen_real_t answer; /* output returned last */
    bool ascending;        /* direction of the drive's last move */
    unsigned int status;
    hystgen_play_t play[HYSTGEN_N_PLAYS + 1]; /* play 0 is the input of the plays */
} hystgen_forward_t;

#endif
