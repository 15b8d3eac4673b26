/* The memory of the inverse of engine loop. */
#include "compensator/model.h"
#ifndef HYSTGEN_LOOP_INVERSE_STATE_H
#define HYSTGEN_LOOP_INVERSE_STATE_H

/* One inverse operator: reference in, drive out. Plain data, owned by the caller. */
typedef struct {
    hystgen_real_t pending;   /* drive sent but not yet part of the memory */
    hystgen_real_t drive;     /* seen last */
    hystgen_real_t reference; /* of the last step */
    hystgen_real_t answer;    /* drive returned last */
    bool has_pending;
    bool repeat;       /* the last answer still stands for `reference` */
    bool stepped;      /* a step has answered */
    unsigned int bits; /* status of that answer */
    unsigned int status;
    hystgen_play_t play[HYSTGEN_N_PLAYS + 1]; /* play 0 is the input of the plays */
} hystgen_inverse_t;

#endif
