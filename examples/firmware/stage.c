#include "stage.h"

#define AMPLIFIER 0.1175f /* share of the way to the drive in 50 us: a time constant of 0.4 ms */
#define STIFF 0.11f       /* um per V that follow at once, */
#define DOMAIN (5.0f / STAGE_RELAYS) /* and um of each domain */

/* Shares of the creep's way in 50 us: time constants of 20 ms, 0.2 s and 2 s, 0.8 % of the motion each. */
static const float creep_share[STAGE_CREEPS] = {2.5e-3f, 2.5e-4f, 2.5e-5f};
#define CREEP 0.008f

/* Multiples of an irrational number, modulo 1: they fill 0 .. 1 evenly (R. Weyl, 1916). */
static float spread(uint32_t k, uint32_t irrational) {
    return (float)(k * irrational >> 8) / 16777216.0f;
}

void stage_init(stage_t *self, uint32_t seed) {
    int i;
    for (i = 0; i < STAGE_RELAYS; ++i) {
        const uint32_t k = seed + (uint32_t)i;
        const float centre = 130.0f * ((float)i + 0.5f) / STAGE_RELAYS - 15.0f;
        const float half = 16.0f * spread(k, 2654435769u) * spread(k, 1779033703u); /* most domains are narrow */
        self->up[i] = (int32_t)(1.0e6f * (centre + half));
        self->down[i] = (int32_t)(1.0e6f * (centre - half));
        self->on[i] = self->up[i] <= 0;
    }
    self->voltage = 0.0f;
    for (i = 0; i < STAGE_CREEPS; ++i) {
        self->crept[i] = 0.0f;
    }
    (void)stage_step(self, 0.0f);
    for (i = 0; i < STAGE_CREEPS; ++i) { /* creep has come to rest */
        self->crept[i] = stage_step(self, 0.0f) / (1.0f + STAGE_CREEPS * CREEP);
    }
}

float stage_step(stage_t *self, float drive) {
    float at_once, y;
    int32_t voltage;
    int i, on = 0;
    self->voltage += AMPLIFIER * (drive - self->voltage);
    voltage = (int32_t)(1.0e6f * self->voltage);
    for (i = 0; i < STAGE_RELAYS; ++i) {
        if (voltage >= self->up[i]) {
            self->on[i] = 1;
        } else if (voltage <= self->down[i]) {
            self->on[i] = 0;
        }
        on += self->on[i];
    }
    at_once = STIFF * self->voltage + DOMAIN * (float)on;
    y = at_once;
    for (i = 0; i < STAGE_CREEPS; ++i) {
        self->crept[i] += creep_share[i] * (at_once - self->crept[i]);
        y += CREEP * self->crept[i];
    }
    return y;
}
