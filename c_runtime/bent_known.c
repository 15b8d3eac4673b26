#include "hystgen_runtime.h"

/* What play i contributes at z; where the play rests, `bent` holds it. */
static hystgen_sum_t hystgen_contributed(unsigned int i, const hystgen_play_t *play,
                                         const hystgen_sum_t *bent, hystgen_play_t z) {
    return z >= play[i] && z <= play[i] ? bent[i] : hystgen_bent(i, z);
}
