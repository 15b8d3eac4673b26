#include "hystgen_runtime.h"

/* Play i has moved, and comes to rest at z, while the input of the plays goes to w. */
static void hystgen_keep(unsigned int i, hystgen_real_t *play, hystgen_real_t w, hystgen_real_t z)
{
    (void)w;
    play[i] = z;
}

/* Play i rests at z. */
static void hystgen_put(unsigned int i, hystgen_real_t *play, hystgen_real_t z)
{
    play[i] = z;
}
