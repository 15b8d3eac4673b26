/* What emission writes for each model, before the operators: constants, tables and, for a
   memoryless part in floating point, functions. Those below belong to a small model, so that each
   file compiles when opened in an editor. With HYSTGEN_CONFIGURED, a real model replaces them.

   A function whose name begins with hystgen_operator_ is the same in the forward and in the inverse
   operator: emission writes a copy for each. In an editor the operator is the inverse, or the
   forward one with HYSTGEN_FORWARD. */
#ifndef HYSTGEN_MODEL_H
#define HYSTGEN_MODEL_H
#if !defined(HYSTGEN_CONFIGURED) && !defined(HYSTGEN_HAS_CORNERS) && !defined(HYSTGEN_CHAIN)
#define HYSTGEN_CHAIN /* the loop engine is a chain */
#endif
#include "hystgen_runtime.h"
#ifndef HYSTGEN_CONFIGURED
#ifndef HYSTGEN_FORWARD
#define HYSTGEN_INVERSE
#endif

#define HYSTGEN_N_PLAYS 6
#define HYSTGEN_CORNERS 7
#define HYSTGEN_STATUS_INPUT_CLAMPED 1u
#define HYSTGEN_STATUS_OUTPUT_CLAMPED 2u
#define HYSTGEN_STATUS_HELD 4u
#define HYSTGEN_STATUS_DOMAIN 8u
#define HYSTGEN_STATUS_SLEW_LIMITED 16u
#define HYSTGEN_STATUS_LIMITED_SETTING 32u
#define HYSTGEN_STATUS_MODEL_LEFT 64u
#define HYSTGEN_HEALTH_WINDOW 4096u
#define HYSTGEN_OPERATOR_INIT_DRIVE 0
#define HYSTGEN_OPERATOR_INIT_ASCENDING true
#define HYSTGEN_OPERATOR_RESET_DRIVE 0
#define HYSTGEN_OPERATOR_RESET_ASCENDING true
#define HYSTGEN_OFFSET 0
#define HYSTGEN_START 0
extern const hystgen_tables_t hystgen_model_tables;
extern const hystgen_play_t hystgen_model_start[HYSTGEN_N_PLAYS + 1];

#ifdef HYSTGEN_FIXED
#define HYSTGEN_DRIVE_MIN (-32767)
#define HYSTGEN_DRIVE_MAX 32767
#define HYSTGEN_OUTPUT_MIN (-30000)
#define HYSTGEN_OUTPUT_MAX 30000
#define HYSTGEN_CODE_MAX 32767
#define HYSTGEN_HEALTH_BITS 12u
#define HYSTGEN_HEALTH_HALVED 1u
#define HYSTGEN_HEALTH_SHIFT 6u
#define HYSTGEN_HEALTH_MEAN_MOST 1234
#define HYSTGEN_HEALTH_SQUARE_MOST 123456789
#define HYSTGEN_HOLD 2
#define HYSTGEN_START_STEP 0
#define HYSTGEN_FRACTION 28u
#define HYSTGEN_FINE 0u
#define HYSTGEN_SHY 63
#define HYSTGEN_BELOW 0u
#define HYSTGEN_DEGREE 5u
extern const hystgen_curve_t hystgen_model_curve;
extern const hystgen_play_t hystgen_model_zero[HYSTGEN_N_PLAYS + 1];
#else
#define HYSTGEN_DRIVE_MIN (-4.0f)
#define HYSTGEN_DRIVE_MAX 4.0f
#define HYSTGEN_OUTPUT_MIN (-10.0f)
#define HYSTGEN_OUTPUT_MAX 10.0f
#define HYSTGEN_HEALTH_SHARE 0.000244140625f
#define HYSTGEN_HEALTH_MEAN_MOST 0.0001f
#define HYSTGEN_HEALTH_SQUARE_MOST 0.0004f
#define HYSTGEN_HOLD 0.001f
extern const hystgen_curve_t hystgen_operator_curve;
extern const hystgen_start_t hystgen_operator_start[2];
#endif

#define HYSTGEN_REFERENCE_CODE_MIN 0
#define HYSTGEN_REFERENCE_CODE_MAX 4095
#define HYSTGEN_REFERENCE_AT_ZERO HYSTGEN_OUTPUT_MIN
#define HYSTGEN_REFERENCE_STEP 1
#define HYSTGEN_REFERENCE_BITS 1u
#define HYSTGEN_DRIVE_CODE_MIN (-2048)
#define HYSTGEN_DRIVE_CODE_MAX 2047
#define HYSTGEN_DRIVE_AT_ZERO 0
#define HYSTGEN_DRIVE_STEP 1
#define HYSTGEN_DRIVE_STEP_BITS 1u
#define HYSTGEN_CODE_AT_ZERO 0
#define HYSTGEN_CODE_STEP 1
#define HYSTGEN_CODE_STEP_BITS 1u

/* The numbers of a unit, of a module that loads them. */
typedef struct {
    hystgen_real_t drive_min;
    hystgen_real_t drive_max;
} hystgen_parameters_t;

#define HYSTGEN_DEGAUSS_TURN_COUNT 3u
typedef struct {
    hystgen_real_t drive;
    uint_least16_t turn;
    uint32_t left;
} hystgen_degauss_t;
extern const hystgen_real_t hystgen_degauss_turn[HYSTGEN_DEGAUSS_TURN_COUNT];
extern const hystgen_real_t hystgen_degauss_move[1];
extern const uint32_t hystgen_degauss_rest[2];

#ifdef HYSTGEN_HAS_FRONT
#ifdef HYSTGEN_FIXED
#define HYSTGEN_FRONT_PIECES 20u
#define HYSTGEN_FRONT_ASCENDING_PIECES 20u
#define HYSTGEN_FRONT_DESCENDING_PIECES 20u
#define HYSTGEN_BACK_PIECES 51u
#define HYSTGEN_BACK_ASCENDING_PIECES 51u
#define HYSTGEN_BACK_DESCENDING_PIECES 51u
extern const int32_t hystgen_front_knot[20];
extern const uint8_t hystgen_front_scale[20];
extern const int32_t hystgen_front_coefficient[120];
extern const int32_t hystgen_front_ascending_knot[20];
extern const uint8_t hystgen_front_ascending_scale[20];
extern const int32_t hystgen_front_ascending_coefficient[120];
extern const int32_t hystgen_front_descending_knot[20];
extern const uint8_t hystgen_front_descending_scale[20];
extern const int32_t hystgen_front_descending_coefficient[120];
extern const int32_t hystgen_back_knot[51];
extern const uint8_t hystgen_back_scale[51];
extern const int32_t hystgen_back_coefficient[306];
extern const int32_t hystgen_back_ascending_knot[51];
extern const uint8_t hystgen_back_ascending_scale[51];
extern const int32_t hystgen_back_ascending_coefficient[306];
extern const int32_t hystgen_back_descending_knot[51];
extern const uint8_t hystgen_back_descending_scale[51];
extern const int32_t hystgen_back_descending_coefficient[306];
extern const hystgen_ends_t hystgen_back_ends;
extern const hystgen_ends_t hystgen_back_ascending_ends;
extern const hystgen_ends_t hystgen_back_descending_ends;
#else
hystgen_real_t hystgen_front_forward(hystgen_real_t v, bool ascending);
hystgen_real_t hystgen_front_inverse(hystgen_real_t w, bool ascending, bool *limited);
#endif
#ifdef HYSTGEN_HAS_CORNERS
extern const hystgen_drive_t hystgen_operator_first_drive[2];
#endif
#endif

#ifdef HYSTGEN_CHAIN
#include "compensator/chain/model.h"
#else
#include "compensator/corners/state.h"
#ifdef HYSTGEN_FORWARD
typedef hystgen_forward_t hystgen_operator_t;
#else
typedef hystgen_inverse_t hystgen_operator_t;
#endif
#include "compensator/api.h"
#endif

#endif
#endif
