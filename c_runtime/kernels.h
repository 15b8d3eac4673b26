/* Functions that a shared run time provides to models. */
#ifdef HYSTGEN_FIXED
#include "plays/tables_fixed.h"
#else
#include "plays/tables_float.h"
#endif
#ifndef HYSTGEN_KERNELS_H
#define HYSTGEN_KERNELS_H

#ifdef HYSTGEN_FIXED
uint64_t hystgen_wide(uint32_t a, uint32_t b);
int64_t hystgen_quotient(int64_t x, int64_t y, unsigned int bits);
int64_t hystgen_divide_by_slope(int64_t d, uint32_t reciprocal, unsigned int shift);
int64_t hystgen_nearest(int64_t x, unsigned int bits);
int64_t hystgen_curve(const int32_t *knot, const uint8_t *scale, const int32_t *coefficient,
                      unsigned int pieces, unsigned int degree, int32_t x);
hystgen_reach_t hystgen_beyond(const hystgen_ends_t *e, hystgen_reach_t w, int32_t drive_min,
                               int32_t drive_max, bool *limited);
void hystgen_copy_place(hystgen_place_t *to, const hystgen_place_t *from);
void hystgen_move_to_input(const hystgen_curve_t *t, hystgen_place_t *here,
                           hystgen_corner_t *corner, hystgen_kink_t *kink, int32_t to);
int64_t hystgen_plays_step(const hystgen_curve_t *t, hystgen_place_t *here,
                           hystgen_corner_t *corner, hystgen_kink_t *kink, int32_t *next,
                           int32_t to);
int64_t hystgen_solve(const hystgen_curve_t *t, hystgen_place_t *here, hystgen_corner_t *corner,
                      int64_t output, int64_t next, hystgen_kink_t *kink);
int64_t hystgen_move_to_solution(const hystgen_curve_t *t, hystgen_place_t *here,
                                 hystgen_corner_t *corner, hystgen_kink_t *kink, int32_t to);
void hystgen_start(const hystgen_curve_t *t, hystgen_place_t *here, hystgen_corner_t *corner,
                   const int32_t *play, unsigned int step);
#else
hystgen_real_t hystgen_tanh(hystgen_real_t x);
hystgen_real_t hystgen_atanh(hystgen_real_t x);
hystgen_real_t hystgen_envelope_forward(const hystgen_envelope_t *e, hystgen_real_t x);
hystgen_real_t hystgen_envelope_inverse(const hystgen_envelope_t *e, hystgen_real_t y,
                                        bool *limited);
hystgen_real_t hystgen_dead_zone_forward(const hystgen_dead_zone_t *z, hystgen_real_t x);
hystgen_real_t hystgen_dead_zone_inverse(const hystgen_dead_zone_t *z, hystgen_real_t y);
void hystgen_copy_place(hystgen_place_t *to, const hystgen_place_t *from);
void hystgen_take_back(hystgen_plays_t *m, const hystgen_place_t *to);
void hystgen_move_to_output(const hystgen_curve_t *t, hystgen_plays_t *m, hystgen_corner_t *corner,
                            hystgen_real_t output);
bool hystgen_move_to_input(const hystgen_curve_t *t, hystgen_plays_t *m, hystgen_corner_t *corner,
                           hystgen_real_t input);
hystgen_real_t hystgen_plays_step(const hystgen_curve_t *t, hystgen_plays_t *m,
                                  hystgen_corner_t *corner, hystgen_real_t input);
void hystgen_start(const hystgen_curve_t *t, hystgen_plays_t *m, hystgen_corner_t *corner,
                   const hystgen_start_t *start);
#endif

void hystgen_loop_rest(const hystgen_tables_t *t, hystgen_play_t *play, hystgen_play_t w);
void hystgen_loop_start(const hystgen_tables_t *t, hystgen_play_t *play,
                        const hystgen_play_t *start);
void hystgen_loop_absorb(const hystgen_tables_t *t, hystgen_play_t *play, hystgen_play_t w);
hystgen_sum_t hystgen_loop_output(const hystgen_tables_t *t, const hystgen_play_t *play);
#ifdef HYSTGEN_FIXED
hystgen_reach_t hystgen_loop_solve(const hystgen_tables_t *t, const hystgen_play_t *play,
                                   hystgen_sum_t output);
#else
hystgen_reach_t hystgen_loop_solve(const hystgen_tables_t *t, const hystgen_play_t *play,
                                   hystgen_sum_t here, hystgen_sum_t output);
#endif

#endif
