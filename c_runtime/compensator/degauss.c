/* Drives that erase the memory of an actuator: turns that decay about the last one. Called by
   users. */
#ifndef HYSTGEN_DEGAUSS_C
#define HYSTGEN_DEGAUSS_C
#include "compensator/clamp.c"
#include "compensator/model.h"
#ifndef HYSTGEN_CONFIGURED
#include "compensator/api.h"
#endif

void hystgen_degauss_init(hystgen_degauss_t *self, hystgen_real_t start) {
    const hystgen_reach_t from = start;
    self->drive = HYSTGEN_DRIVE_MIN;
    if (from > HYSTGEN_DRIVE_MIN) { /* not NaN */
        self->drive = hystgen_clamp_drive(from);
    }
    self->turn = 0;
    self->left = 0;
}

hystgen_real_t hystgen_degauss_step(hystgen_degauss_t *self) {
    if (self->left > 0) {
        --self->left;
    } else if (self->turn < HYSTGEN_DEGAUSS_TURN_COUNT) {
        const hystgen_reach_t way = (hystgen_reach_t)hystgen_degauss_turn[self->turn] - self->drive;
        const hystgen_reach_t move = hystgen_degauss_move[0];
        if (way > move) {
            self->drive = hystgen_clamp_drive(self->drive + move);
        } else if (way < -move) {
            self->drive = hystgen_clamp_drive(self->drive - move);
        } else {
            self->drive = hystgen_clamp_drive(hystgen_degauss_turn[self->turn]);
            ++self->turn;
            self->left = hystgen_degauss_rest[self->turn < HYSTGEN_DEGAUSS_TURN_COUNT ? 0 : 1];
        }
    }
    return self->drive;
}

bool hystgen_degauss_done(const hystgen_degauss_t *self) {
    return self->turn == HYSTGEN_DEGAUSS_TURN_COUNT && self->left == 0;
}

#endif
