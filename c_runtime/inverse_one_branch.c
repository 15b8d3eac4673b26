#include "hystgen_runtime.h"

/* The drive that gives w; `limited`: an envelope cannot give w. */
static hystgen_reach_t hystgen_inverse_choose(const hystgen_inverse_t *self, hystgen_real_t level, hystgen_reach_t w,
                                              bool *limited, bool *moves)
{
    (void)self;
    (void)level;
    (void)moves;
    return hystgen_front_inverse(w, true, limited);
}
