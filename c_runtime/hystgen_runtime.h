/*
 * hystgen run time: the kernels behind every emitted model.
 *
 * Emitted code carries these functions with its own prefix in place of "hystgen_" (self-contained and
 * single-header layouts) or calls them here (shared-runtime layout). Nothing in them fails, allocates, divides,
 * recurses or runs unbounded, and nothing but <float.h>, <stdbool.h> and <stdint.h> is needed.
 */
#ifndef HYSTGEN_RUNTIME_H
#define HYSTGEN_RUNTIME_H

#include <float.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* What the numbers of a model are: in floating point all of one type, in fixed point whole numbers as wide as they
   have to be. play: inputs of the plays; reach: where plays start to follow; sum: outputs before they are rounded. */
#ifdef HYSTGEN_FIXED
typedef int32_t hystgen_play_t;
typedef int64_t hystgen_reach_t;
typedef int64_t hystgen_sum_t;
typedef int32_t hystgen_real_t;
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
#define HYSTGEN_API
#define HYSTGEN_KERNEL
#if defined(__GNUC__)
#define HYSTGEN_APART __attribute__((noinline)) static
#else
#define HYSTGEN_APART static
#endif
#ifdef HYSTGEN_FIXED /* where less is on the stack once it is part of the step */
#define HYSTGEN_APART_IN_FLOAT static
#else
#define HYSTGEN_APART_IN_FLOAT HYSTGEN_APART
#endif

#ifdef HYSTGEN_FIXED
#include "hystgen_corners_fixed_state.h"
#include "hystgen_corners_fixed_tables.h"
#include "hystgen_tables_fixed.h"

uint64_t hystgen_wide(uint32_t a, uint32_t b);
int64_t hystgen_over_slope(int64_t d, uint32_t reciprocal, unsigned int shift);
int64_t hystgen_nearest(int64_t x, unsigned int bits);
int64_t hystgen_curve(const int32_t *knot, const uint8_t *scale, const int32_t *coefficient, unsigned int pieces,
                      unsigned int degree, int32_t x);
hystgen_reach_t hystgen_beyond(const hystgen_ends_t *e, hystgen_reach_t w, int32_t drive_min, int32_t drive_max,
                               bool *limited);
void hystgen_copy_place(hystgen_place_t *to, const hystgen_place_t *from);
void hystgen_move_to_input(const hystgen_curve_t *t, hystgen_place_t *here, hystgen_corner_t *corner,
                           hystgen_kink_t *kink, int32_t to);
int64_t hystgen_plays_step(const hystgen_curve_t *t, hystgen_place_t *here, hystgen_corner_t *corner,
                           hystgen_kink_t *kink, int32_t *next, int32_t to);
int64_t hystgen_solve(const hystgen_curve_t *t, hystgen_place_t *here, hystgen_corner_t *corner, int64_t output,
                      int64_t next, hystgen_kink_t *kink);
int64_t hystgen_move_to_solution(const hystgen_curve_t *t, hystgen_place_t *here, hystgen_corner_t *corner,
                                 hystgen_kink_t *kink, int32_t to);
void hystgen_start(const hystgen_curve_t *t, hystgen_place_t *here, hystgen_corner_t *corner, const int32_t *play,
                   unsigned int step);
#else
/* Whether each operation of a number is a call of a library. */
#ifdef HYSTGEN_REAL_IS_DOUBLE
#define HYSTGEN_HALF 0.5
#define HYSTGEN_SOFT_FLOAT 0
#else
#define HYSTGEN_HALF 0.5f
#define HYSTGEN_SOFT_FLOAT 0
#endif
#include "hystgen_corners_state.h"
#include "hystgen_corners_tables.h"
#include "hystgen_tables_float.h"

hystgen_real_t hystgen_tanh(hystgen_real_t x);
hystgen_real_t hystgen_atanh(hystgen_real_t x);
hystgen_real_t hystgen_envelope_forward(const hystgen_envelope_t *e, hystgen_real_t x);
hystgen_real_t hystgen_envelope_inverse(const hystgen_envelope_t *e, hystgen_real_t y, bool *limited);
hystgen_real_t hystgen_dead_zone_forward(const hystgen_dead_zone_t *z, hystgen_real_t x);
hystgen_real_t hystgen_dead_zone_inverse(const hystgen_dead_zone_t *z, hystgen_real_t y);
void hystgen_copy_place(hystgen_place_t *to, const hystgen_place_t *from);
void hystgen_forget_line(hystgen_plays_t *m);
void hystgen_move_to_output(const hystgen_curve_t *t, hystgen_plays_t *m, hystgen_corner_t *corner,
                            hystgen_real_t output);
bool hystgen_move_to_input(const hystgen_curve_t *t, hystgen_plays_t *m, hystgen_corner_t *corner, hystgen_real_t input);
void hystgen_stop_in_block(const hystgen_curve_t *t, hystgen_plays_t *m, const hystgen_corner_t *corner,
                           hystgen_real_t output, hystgen_real_t input);
bool hystgen_move_in_block(const hystgen_curve_t *t, hystgen_plays_t *m, hystgen_real_t input);
hystgen_real_t hystgen_plays_step(const hystgen_curve_t *t, hystgen_plays_t *m, hystgen_corner_t *corner,
                                  hystgen_real_t input);
void hystgen_start(const hystgen_curve_t *t, hystgen_plays_t *m, hystgen_corner_t *corner, const hystgen_start_t *start);
#endif

void hystgen_loop_rest(const hystgen_tables_t *t, hystgen_play_t *play, hystgen_play_t w);
void hystgen_loop_start(const hystgen_tables_t *t, hystgen_play_t *play, const hystgen_play_t *start);
void hystgen_loop_absorb(const hystgen_tables_t *t, hystgen_play_t *play, hystgen_play_t w);
hystgen_sum_t hystgen_loop_output(const hystgen_tables_t *t, const hystgen_play_t *play);
hystgen_reach_t hystgen_loop_solve(const hystgen_tables_t *t, const hystgen_play_t *play, hystgen_sum_t output);

#endif
