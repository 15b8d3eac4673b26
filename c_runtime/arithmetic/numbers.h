/* Number types and storage classes for each arithmetic. Needed by every other file. */
#ifndef HYSTGEN_NUMBERS_H
#define HYSTGEN_NUMBERS_H

#include <float.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include "arithmetic/build.h"
#include "arithmetic/storage.h"
#include "arithmetic/soft_float.h"

/* Types of a model's numbers: one type for all in floating point, integers of the necessary widths
   in fixed point. play: inputs of the plays; reach: inputs at which plays start to follow; sum:
   outputs before rounding; low: the lower part of the sum stored in a corner. */
#if defined(HYSTGEN_FIXED)
#ifdef HYSTGEN_REAL_IS_SHORT
typedef int32_t hystgen_reach_t;
typedef int16_t hystgen_real_t;
typedef uint16_t hystgen_low_t;
#define HYSTGEN_LOW_BITS 16
#else
typedef int64_t hystgen_reach_t;
typedef int32_t hystgen_real_t;
typedef uint32_t hystgen_low_t;
#define HYSTGEN_LOW_BITS 32
#endif
typedef int32_t hystgen_play_t;
typedef int64_t hystgen_sum_t;
#else
#ifdef HYSTGEN_REAL_IS_DOUBLE
typedef double hystgen_real_t;
#define HYSTGEN_REAL_MAX DBL_MAX
#else
typedef float hystgen_real_t;
#define HYSTGEN_REAL_MAX FLT_MAX
#endif
typedef hystgen_real_t hystgen_play_t;
typedef hystgen_real_t hystgen_reach_t;
typedef hystgen_real_t hystgen_sum_t;
#endif

/* In a model with effects, signal: a value between blocks, in fixed point wider than a code;
   narrow: a block's number with half the bits of a signal; fine: the output of the drive side,
   in fixed point finer than a code; travel: the distance covered by the drive; factor:
   multiplies a signal. Without effects, and in floating point, all of them have the caller's type;
   only the loop engine's signals in fixed point have the type of its play sums. */
#if defined(HYSTGEN_FIXED) && defined(HYSTGEN_CHAIN)
typedef hystgen_sum_t hystgen_signal_t;
typedef int32_t hystgen_narrow_t;
typedef hystgen_play_t hystgen_fine_t;
typedef hystgen_sum_t hystgen_travel_t;
#else
#if defined(HYSTGEN_FIXED) && defined(HYSTGEN_LOOP)
typedef hystgen_sum_t hystgen_signal_t;
#else
typedef hystgen_real_t hystgen_signal_t;
#endif
typedef hystgen_real_t hystgen_narrow_t;
typedef hystgen_real_t hystgen_fine_t;
typedef hystgen_real_t hystgen_travel_t;
typedef hystgen_real_t hystgen_number_t;
#ifndef HYSTGEN_FIXED
typedef hystgen_real_t hystgen_factor_t;
#endif
#define HYSTGEN_FINE_MIN HYSTGEN_DRIVE_MIN
#define HYSTGEN_FINE_MAX HYSTGEN_DRIVE_MAX
#define hystgen_clamp_fine hystgen_clamp_drive
#endif

/* Storage classes of functions in emitted files: a model's own copies of kernels are static; some
   of them are not inlined, to save stack. */
#define HYSTGEN_API
#define HYSTGEN_KERNEL
#define HYSTGEN_FIXED_KERNEL
#define HYSTGEN_APART_IN_FLOAT_CORNERS HYSTGEN_APART
#define HYSTGEN_APART_IN_FIXED HYSTGEN_APART
#define HYSTGEN_APART_IN_FIXED_CHAIN HYSTGEN_APART
#define HYSTGEN_APART_IN_FIXED_BLOCK HYSTGEN_APART
#define HYSTGEN_APART_IN_CHAIN HYSTGEN_APART
#define HYSTGEN_APART_IF_MOVED HYSTGEN_APART
#ifndef HYSTGEN_CHAIN
#define HYSTGEN_ALONE
#endif
#define HYSTGEN_APART_IN_FLOAT HYSTGEN_APART
#define HYSTGEN_APART_BUT_IN_FLOAT_LOOP HYSTGEN_APART

#endif
