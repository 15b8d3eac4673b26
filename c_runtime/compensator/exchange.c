/* Takes other parameters while the inverse runs: its memory is carried over to their plays. For
   engine loop. Called by users. */
#ifndef HYSTGEN_EXCHANGE_C
#define HYSTGEN_EXCHANGE_C
#include "compensator/chain/model.h"
#ifndef HYSTGEN_CONFIGURED
#include "compensator/chain/chain_calls.c"
#endif

/* Byte by byte: for a whole structure a compiler may call memcpy. */
HYSTGEN_APART void hystgen_inverse_copy(hystgen_inverse_t *self, const hystgen_inverse_t *from) {
    volatile unsigned char *to = (volatile unsigned char *)self;
    const unsigned char *byte = (const unsigned char *)from;
    size_t left = sizeof *from;
    while (left > 0) {
        --left;
        to[left] = byte[left];
    }
}

/* Takes other parameters, which emission adds as an argument. Play 0 is then at the input for the
   last drive, and each other play as near to where it was as the one before it allows; plays that
   an effect moves or bends come to rest there. */
HYSTGEN_APART void hystgen_inverse_carry(hystgen_inverse_t *self) {
    unsigned int i;
    self->play[0] = hystgen_inverse_arrive(self, self->drive);
    for (i = 1; i <= HYSTGEN_N_PLAYS; ++i) {
        const hystgen_reach_t room = (hystgen_reach_t)hystgen_model_tables.threshold[i] -
                                     hystgen_model_tables.threshold[i - 1u];
        const hystgen_reach_t low = self->play[i - 1u] - room;
        const hystgen_reach_t high = self->play[i - 1u] + room;
        const hystgen_reach_t upper = self->play[i] > high ? high : self->play[i];
        self->play[i] = (hystgen_play_t)(upper < low ? low : upper);
    }
#ifdef HYSTGEN_HAS_MOVED_PLAYS
    const bool moving = self->moving;
    self->moving = false; /* the plays, but no other block */
    self->level = hystgen_inverse_started(self);
    self->moving = moving;
#else
    self->level = hystgen_inverse_started(self);
#endif
    self->repeated = false;
}

hystgen_real_t hystgen_inverse_exchange(hystgen_inverse_t *self, const hystgen_parameters_t *next,
                                        bool take) {
    hystgen_inverse_t old;
    hystgen_inverse_t other;
    hystgen_inverse_copy(&old, self);
    hystgen_inverse_take(&old);
    hystgen_inverse_copy(&other, &old);
    hystgen_inverse_carry(&other);
    if (take) {
        hystgen_inverse_copy(self, &other);
    }
    const hystgen_real_t u = hystgen_inverse_shown(&old);
    const hystgen_real_t before = hystgen_inverse_step(&old, u);
    const hystgen_reach_t jump = (hystgen_reach_t)hystgen_inverse_step(&other, u) - before;
#ifdef HYSTGEN_FIXED
    if (jump < -HYSTGEN_CODE_MAX) {
        return -HYSTGEN_CODE_MAX;
    }
    return (hystgen_real_t)(jump > HYSTGEN_CODE_MAX ? HYSTGEN_CODE_MAX : jump);
#else
    return jump;
#endif
}

#endif
