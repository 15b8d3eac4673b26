/* What else emission writes for each model with effects: numbers, tables, the types of its
   instances, and the functions that call its blocks. Those below belong to a model with every
   effect, so that each file compiles when opened in an editor; see compensator/model.h. */
#ifndef HYSTGEN_CHAIN_MODEL_H
#define HYSTGEN_CHAIN_MODEL_H
#if !defined(HYSTGEN_CHAIN) && !defined(HYSTGEN_CONFIGURED)
#define HYSTGEN_CHAIN
#endif
#include "compensator/model.h"
#ifdef HYSTGEN_CHAIN
#include "compensator/chain/attempt.h"
#include "compensator/chain/types.h"
#endif
#ifndef HYSTGEN_CONFIGURED

#define HYSTGEN_WAITING 3u
#define HYSTGEN_TAPS 3u
#define HYSTGEN_QUIET 8u
#define HYSTGEN_YIELDS 8u
#define HYSTGEN_ELEMENTS 2u
#define HYSTGEN_PIECES 20u
#define HYSTGEN_BASE 1

#ifdef HYSTGEN_FIXED
#define HYSTGEN_FINE_MIN (-32767)
#define HYSTGEN_FINE_MAX 32767
#define HYSTGEN_FARTHEST_OFFSET 998850172410LL
#define HYSTGEN_SLEW_RISING 1600
#define HYSTGEN_SLEW_FALLING 1600
#define HYSTGEN_SLEW_RISING_REST 268435491
#define HYSTGEN_SLEW_FALLING_REST 268435491
#define HYSTGEN_DITHER 41
#define HYSTGEN_LEAST_CODE (-163835)
#define HYSTGEN_MOST_CODE 163835
#define HYSTGEN_DRIVE_BITS 8u
#define HYSTGEN_ARRIVING_BITS 8u
#define HYSTGEN_LEVEL_BITS 8u
#define HYSTGEN_LEVEL_DROP 20u
#define HYSTGEN_LARGEST_LEVEL 782495278648LL
#define HYSTGEN_LARGEST_INPUT 2147483647
#define HYSTGEN_NEAR 500
#define HYSTGEN_SECANTS 10u
#define HYSTGEN_RATE_BITS 60u
#define HYSTGEN_FASTEST 2147483647
#define HYSTGEN_SHARE_BITS 0u
#define HYSTGEN_BRAKED_DROP 4u
#define HYSTGEN_BUMP_DEGREE 5u
#define HYSTGEN_BUMP_LIFT 4u
#define HYSTGEN_BUMP_BITS 8u
#define HYSTGEN_BUMP_END 2000000000
#define HYSTGEN_YIELD_BITS 8u
#define HYSTGEN_STRETCH 2147483648u
#define HYSTGEN_STRAIGHT 1000
extern const hystgen_factor_t hystgen_relaxing_late;
extern const hystgen_factor_t hystgen_relaxing_kept;
extern const hystgen_tables_t hystgen_relaxing_tables;
extern const hystgen_factor_t hystgen_late[HYSTGEN_N_PLAYS + 1];
extern const hystgen_factor_t hystgen_kept[HYSTGEN_N_PLAYS + 1];
extern const hystgen_factor_t hystgen_wider[HYSTGEN_N_PLAYS + 1];
extern const hystgen_factor_t hystgen_standing_share;
extern const hystgen_yield_t hystgen_yields[HYSTGEN_YIELDS];
extern const hystgen_bump_t hystgen_bump[1];
extern const hystgen_piece_t hystgen_piece[HYSTGEN_PIECES];
extern const hystgen_element_table_t hystgen_element_table[HYSTGEN_ELEMENTS];
extern const uint16_t hystgen_bump_of[HYSTGEN_N_PLAYS + 1];
#else
#define HYSTGEN_FARTHEST_OFFSET 20.0f
#define HYSTGEN_SLEW_RISING 3.0f
#define HYSTGEN_SLEW_FALLING 3.0f
#define HYSTGEN_SLEW_RISING_REST 0.0f
#define HYSTGEN_SLEW_FALLING_REST 0.0f
#define HYSTGEN_DITHER 0.0001f
#define HYSTGEN_LATE 0.1f
#define HYSTGEN_KEPT 0.2f
#define HYSTGEN_STANDING_SHARE 0.3f
#define HYSTGEN_NEWTON_TRIES 8u
#define HYSTGEN_HALVES 40u
#define HYSTGEN_TURNS 4u
#define HYSTGEN_RATE 1.0f
#define HYSTGEN_CLOSE 1.0e-6f
#define HYSTGEN_LEAST_INPUT (-8.0f)
#define HYSTGEN_LARGEST_INPUT 8.0f
#define HYSTGEN_CENTRE 0.5f
#define HYSTGEN_INVERSE_WIDTH 2.0f
#define HYSTGEN_AMPLITUDE 0.3f
#define HYSTGEN_STEEPEST 1.3f
#define HYSTGEN_TANH_CENTRE 0.2f
#define HYSTGEN_TERMS 2u
#define HYSTGEN_SCALE 4.0f
#define HYSTGEN_INVERSE_SCALE 0.25f
extern const struct {
    hystgen_real_t threshold[HYSTGEN_N_PLAYS + 1];
    hystgen_real_t weight[HYSTGEN_N_PLAYS + 1];
} hystgen_play;
extern const struct {
    hystgen_real_t share[HYSTGEN_N_PLAYS + 1];
    hystgen_real_t inverse[HYSTGEN_N_PLAYS + 1];
} hystgen_relaxing;
extern const hystgen_real_t hystgen_late[HYSTGEN_N_PLAYS + 1];
extern const hystgen_real_t hystgen_kept[HYSTGEN_N_PLAYS + 1];
extern const hystgen_real_t hystgen_wider[HYSTGEN_N_PLAYS + 1];
extern const hystgen_real_t hystgen_yields[HYSTGEN_YIELDS][5];
extern const hystgen_real_t hystgen_curve[HYSTGEN_N_PLAYS + 1][HYSTGEN_TERMS];
extern const hystgen_piece_t hystgen_piece[HYSTGEN_PIECES];
extern const hystgen_real_t hystgen_element_weight[HYSTGEN_ELEMENTS];
extern const hystgen_real_t hystgen_element_amplitude[HYSTGEN_ELEMENTS];
extern const hystgen_real_t hystgen_element_inverse_width[HYSTGEN_ELEMENTS];
#endif

extern const hystgen_tilt_t hystgen_tilt[HYSTGEN_ELEMENTS];
extern const hystgen_factor_t hystgen_waited[1];
extern const hystgen_lag_table_t hystgen_braked_1;
extern const hystgen_ageing_table_t hystgen_ageing_1;

typedef hystgen_operator_t hystgen_forward_t;
typedef hystgen_operator_t hystgen_inverse_t;

/* Blocks before the plays, and after them. */
hystgen_signal_t hystgen_operator_drive_side_rest(hystgen_operator_t *self, hystgen_signal_t v);
hystgen_signal_t hystgen_operator_drive_side_absorb(hystgen_operator_t *self, hystgen_signal_t v);
hystgen_signal_t hystgen_inverse_drive_side_solve(hystgen_inverse_t *self, hystgen_signal_t a);
hystgen_signal_t hystgen_inverse_missed(hystgen_signal_t way);
hystgen_signal_t hystgen_operator_output_side_rest(hystgen_operator_t *self, hystgen_signal_t h);
hystgen_signal_t hystgen_operator_output_side_absorb(hystgen_operator_t *self, hystgen_signal_t h);
hystgen_signal_t hystgen_inverse_output_side_solve(hystgen_inverse_t *self, hystgen_signal_t y);
hystgen_signal_t hystgen_inverse_output_side_resting(hystgen_inverse_t *self, hystgen_signal_t y);
/* Sum of the plays, and the last output of the output side. */
hystgen_signal_t hystgen_operator_level(const hystgen_operator_t *self);
hystgen_signal_t hystgen_operator_output(const hystgen_operator_t *self);
/* Conversion between the output of the chain and the displacement, and the line of references. */
hystgen_signal_t hystgen_operator_displaced(const hystgen_operator_t *self, hystgen_signal_t y);
hystgen_signal_t hystgen_inverse_undisplaced(hystgen_inverse_t *self, hystgen_signal_t u,
                                             bool *limited);
hystgen_signal_t hystgen_inverse_ahead(hystgen_inverse_t *self, hystgen_signal_t y);
void hystgen_inverse_repeat(hystgen_inverse_t *self);
/* The inverse's copies of functions of either operator, which an exchange of parameters calls. */
hystgen_play_t hystgen_inverse_arrive(hystgen_inverse_t *self, hystgen_fine_t v);
hystgen_signal_t hystgen_inverse_started(hystgen_inverse_t *self);
hystgen_real_t hystgen_inverse_shown(const hystgen_inverse_t *self);
hystgen_real_t hystgen_inverse_step(hystgen_inverse_t *self, hystgen_real_t u);
/* Settings from outside, and the state that depends on the travel of the drive. */
void hystgen_operator_settings_init(hystgen_operator_t *self);
void hystgen_operator_travelled(hystgen_operator_t *self, hystgen_real_t v);
void hystgen_operator_clock_start(hystgen_operator_t *self);
bool hystgen_operator_heat(hystgen_operator_t *self, hystgen_real_t temperature);
bool hystgen_operator_influence(hystgen_operator_t *self, unsigned int i, hystgen_real_t value);
void hystgen_operator_tick(hystgen_operator_t *self);

#include "compensator/api.h"
#include "compensator/chain/api.h"

#endif
#endif
