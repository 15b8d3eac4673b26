#include "hystgen_runtime.h"

/* What play i contributes at z, whether it rests there or not. */
static inline hystgen_sum_t hystgen_contributed(unsigned int i, const hystgen_play_t *play,
                                                const hystgen_sum_t *bent, hystgen_play_t z) {
    (void)i;
    (void)play;
    (void)bent;
    return z;
}

/* What play i contributes once the input of the plays has gone to w, or rests there. */
static inline hystgen_sum_t hystgen_inverse_value(const hystgen_inverse_t *self, unsigned int i,
                                                  hystgen_play_t w) {
    const hystgen_play_t z =
        self->moving ? hystgen_moved(i, self->play, w) : hystgen_resting(i, self->play, w);
    return hystgen_contributed(i, self->play, self->bent, z);
}
