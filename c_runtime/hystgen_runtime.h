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
#include <stdint.h>

#ifdef HYSTGEN_REAL_IS_DOUBLE
typedef double hystgen_real_t;
#define HYSTGEN_REAL_MAX DBL_MAX
#else
typedef float hystgen_real_t;
#define HYSTGEN_REAL_MAX FLT_MAX
#endif
#define HYSTGEN_API

#include "hystgen_state.h"
#include "hystgen_tables.h"

hystgen_real_t hystgen_tanh(hystgen_real_t x);
hystgen_real_t hystgen_atanh(hystgen_real_t x);
hystgen_real_t hystgen_envelope_forward(const hystgen_envelope_t *e, hystgen_real_t x);
hystgen_real_t hystgen_envelope_inverse(const hystgen_envelope_t *e, hystgen_real_t y, bool *limited);
hystgen_real_t hystgen_dead_zone_forward(const hystgen_dead_zone_t *z, hystgen_real_t x);
hystgen_real_t hystgen_dead_zone_inverse(const hystgen_dead_zone_t *z, hystgen_real_t y);

void hystgen_corners_rest(const hystgen_tables_t *t, hystgen_memory_t *m, hystgen_corner_t *corner,
                          hystgen_real_t w);
void hystgen_corners_start(const hystgen_tables_t *t, hystgen_memory_t *m, hystgen_corner_t *corner,
                           const hystgen_real_t *play);
void hystgen_corners_absorb(const hystgen_tables_t *t, hystgen_memory_t *m, hystgen_corner_t *corner,
                            hystgen_real_t w);
hystgen_real_t hystgen_corners_output(const hystgen_tables_t *t, const hystgen_memory_t *m);
hystgen_real_t hystgen_corners_solve(const hystgen_tables_t *t, const hystgen_memory_t *m,
                                     hystgen_corner_t *corner, hystgen_real_t output);

void hystgen_loop_rest(const hystgen_tables_t *t, hystgen_real_t *play, hystgen_real_t w);
void hystgen_loop_start(const hystgen_tables_t *t, hystgen_real_t *play, const hystgen_real_t *start);
void hystgen_loop_absorb(const hystgen_tables_t *t, hystgen_real_t *play, hystgen_real_t w);
hystgen_real_t hystgen_loop_output(const hystgen_tables_t *t, const hystgen_real_t *play);
hystgen_real_t hystgen_loop_solve(const hystgen_tables_t *t, const hystgen_real_t *play, hystgen_real_t output);

#endif
