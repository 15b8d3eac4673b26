/* Kernels of floating point. */
#ifndef HYSTGEN_KERNELS_FLOAT_H
#define HYSTGEN_KERNELS_FLOAT_H

hystgen_real_t hystgen_tanh(hystgen_real_t x);
hystgen_real_t hystgen_atanh(hystgen_real_t x);
hystgen_real_t hystgen_envelope_forward(const hystgen_envelope_t *e, hystgen_real_t x);
hystgen_real_t hystgen_envelope_inverse(const hystgen_envelope_t *e, hystgen_real_t y,
                                        bool *limited);
hystgen_real_t hystgen_dead_zone_forward(const hystgen_dead_zone_t *z, hystgen_real_t x);
hystgen_real_t hystgen_dead_zone_inverse(const hystgen_dead_zone_t *z, hystgen_real_t y);
void hystgen_copy_place(hystgen_place_t *to, const hystgen_place_t *from);
void hystgen_forget_line(hystgen_plays_t *m);
void hystgen_move_to_output(const hystgen_curve_t *t, hystgen_plays_t *m, hystgen_corner_t *corner,
                            hystgen_real_t output);
bool hystgen_move_to_input(const hystgen_curve_t *t, hystgen_plays_t *m, hystgen_corner_t *corner,
                           hystgen_real_t input);
void hystgen_stop_in_block(const hystgen_curve_t *t, hystgen_plays_t *m,
                           const hystgen_corner_t *corner, hystgen_real_t output,
                           hystgen_real_t input);
bool hystgen_move_in_block(const hystgen_curve_t *t, hystgen_plays_t *m, hystgen_real_t input);
hystgen_real_t hystgen_plays_step(const hystgen_curve_t *t, hystgen_plays_t *m,
                                  hystgen_corner_t *corner, hystgen_real_t input);
void hystgen_start(const hystgen_curve_t *t, hystgen_plays_t *m, hystgen_corner_t *corner,
                   const hystgen_start_t *start);

#endif
