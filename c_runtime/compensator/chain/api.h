/* Additional calls for users of models with effects. */
#include "compensator/chain/model.h"
#ifndef HYSTGEN_CHAIN_API_H
#define HYSTGEN_CHAIN_API_H

#ifdef HYSTGEN_INVERSE
/* Takes the next reference of the preview without returning a drive; to be called HYSTGEN_PREVIEW
   times before the first step. */
void hystgen_inverse_push(hystgen_inverse_t *self, hystgen_real_t u);
#endif
/* Brings everything to rest at drive v; the next step moves on from there. */
void hystgen_operator_settle(hystgen_operator_t *self, hystgen_real_t v);
/* Sets an offset of the displacement, from the next step on. */
void hystgen_operator_set_offset(hystgen_operator_t *self, hystgen_real_t d);
/* Sets the temperature, degC, from the next step on. */
void hystgen_operator_set_temperature(hystgen_operator_t *self, hystgen_real_t temperature);
/* Sets column i, from the next step on. */
void hystgen_operator_set_influence(hystgen_operator_t *self, unsigned int i, hystgen_real_t value);
/* Sets a gain that replaces the gain by travel, from the next step on, until a travel is set. */
void hystgen_operator_set_gain(hystgen_operator_t *self, hystgen_real_t gain);
/* Distance travelled by the drive: store this number where it survives a power cycle, and set it
   again after init. */
hystgen_travel_t hystgen_operator_travel(const hystgen_operator_t *self);
/* Sets the distance travelled so far, and with it the gain. */
void hystgen_operator_set_travel(hystgen_operator_t *self, hystgen_travel_t travel);
#ifdef HYSTGEN_INVERSE
/* The displacement that the model expects from the last applied drive. */
hystgen_real_t hystgen_inverse_expected(const hystgen_inverse_t *self);
/* Trims the offset by a share, 0 to 1, of the measured minus the expected displacement. */
void hystgen_inverse_correct(hystgen_inverse_t *self, hystgen_real_t measured,
                             hystgen_real_t share);
#endif

#endif
