/* The memory of the inverse of engine loop, behind two branches. */
#ifndef HYSTGEN_CONFIGURED
#define HYSTGEN_HAS_FRONT
#define HYSTGEN_HAS_TWO_BRANCHES
#endif
#include "compensator/model.h"
#ifndef HYSTGEN_LOOP_INVERSE_BRANCHES_STATE_H
#define HYSTGEN_LOOP_INVERSE_BRANCHES_STATE_H

/* One inverse operator: reference in, drive out. Plain data, owned by the caller. */
typedef struct {
    hystgen_real_t pending;   /* drive sent but not yet part of the memory */
    hystgen_real_t drive;     /* seen last */
    hystgen_real_t reference; /* of the last step */
    hystgen_real_t level;     /* the same, limited: the next reference moves up or down from here */
    hystgen_real_t answer;    /* drive returned last */
    bool ascending;           /* direction of the drive's last move */
    bool has_pending;
    bool repeat;       /* the last answer still stands for `reference` */
    bool stepped;      /* a step has answered */
    unsigned int bits; /* status of that answer */
    unsigned int status;
    hystgen_play_t play[HYSTGEN_N_PLAYS + 1]; /* play 0 is the input of the plays */
} hystgen_inverse_t;

#endif
