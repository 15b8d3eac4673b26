/* Kernels of fixed point. */
#ifndef HYSTGEN_KERNELS_FIXED_H
#define HYSTGEN_KERNELS_FIXED_H

uint64_t hystgen_wide(uint32_t a, uint32_t b);
int64_t hystgen_over_slope(int64_t d, uint32_t reciprocal, unsigned int shift);
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

#endif
