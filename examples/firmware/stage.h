/* A simulated piezo stage: an amplifier with a time constant, a ceramic made of relays, creep. It stands in for the
   hardware, and shares neither code nor the form of its model with what hystgen emits. */
#ifndef STAGE_H
#define STAGE_H

#include <stdint.h>

#define STAGE_RELAYS 600
#define STAGE_CREEPS 3

typedef struct {
    int32_t up[STAGE_RELAYS];   /* uV at which a domain switches on, */
    int32_t down[STAGE_RELAYS]; /* and off */
    uint8_t on[STAGE_RELAYS];
    float voltage; /* behind the amplifier */
    float crept[STAGE_CREEPS];
} stage_t;

/* A stage whose domains depend on `seed`, at rest at 0 V. */
void stage_init(stage_t *self, uint32_t seed);
/* 50 us with this drive, V. Returns the displacement, um. */
float stage_step(stage_t *self, float drive);

#endif
