/* Kernels of engine loop, in any arithmetic. */
#ifndef HYSTGEN_KERNELS_LOOP_H
#define HYSTGEN_KERNELS_LOOP_H

void hystgen_loop_rest(const hystgen_tables_t *t, hystgen_play_t *play, hystgen_play_t w);
void hystgen_loop_start(const hystgen_tables_t *t, hystgen_play_t *play,
                        const hystgen_play_t *start);
void hystgen_loop_absorb(const hystgen_tables_t *t, hystgen_play_t *play, hystgen_play_t w);
hystgen_sum_t hystgen_loop_output(const hystgen_tables_t *t, const hystgen_play_t *play);
hystgen_reach_t hystgen_loop_solve(const hystgen_tables_t *t, const hystgen_play_t *play,
                                   hystgen_sum_t output);

#endif
