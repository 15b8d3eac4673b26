/* Further functions of the forward operator of a model with effects. */
#ifndef HYSTGEN_CHAIN_FORWARD_API_H
#define HYSTGEN_CHAIN_FORWARD_API_H

/* Everything comes to rest at drive v; the next step finds it moving from there. */
void hystgen_forward_settle(hystgen_forward_t *self, hystgen_real_t v);
/* An offset of the displacement, from the next step on. */
void hystgen_forward_set_offset(hystgen_forward_t *self, hystgen_real_t d);
/* The temperature, degC, from the next step on. */
void hystgen_forward_set_temperature(hystgen_forward_t *self, hystgen_real_t temperature);
/* A gain in place of the one by travel, from the next step on, until a travel is set. */
void hystgen_forward_set_gain(hystgen_forward_t *self, hystgen_real_t gain);
/* Distance that the drive has travelled: store it where it survives a power cycle, and set it again
   after init. */
hystgen_travel_t hystgen_forward_travel(const hystgen_forward_t *self);
/* The distance travelled so far, and the gain that belongs to it. */
void hystgen_forward_set_travel(hystgen_forward_t *self, hystgen_travel_t travel);

#endif
