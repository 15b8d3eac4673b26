/* The drive for an input of the plays, behind a memoryless part with one branch or two. Called by
   the inverse operators. */
#ifndef HYSTGEN_BRANCHES_C
#define HYSTGEN_BRANCHES_C
#ifndef HYSTGEN_CONFIGURED
#define HYSTGEN_HAS_FRONT
#endif
#include "compensator/model.h"
#include "front/front.c"
#include "compensator/clamp.c"

#ifdef HYSTGEN_HAS_TWO_BRANCHES
/* Whether the move to v belongs to the branch that v was computed on. */
static bool hystgen_inverse_fits(const hystgen_inverse_t *self, hystgen_reach_t v, bool ascending) {
    const hystgen_fine_t inside = hystgen_clamp_fine(v);
    if (inside > self->drive) {
        return ascending;
    }
    if (inside < self->drive) {
        return !ascending;
    }
    return self->ascending == ascending;
}

/* The drive that gives w on the branch of its own move. Tries the branch of the reference's move,
   then the other one; if neither fits, the drive holds. Sets `limited` if no drive gives w. */
HYSTGEN_APART_IN_FLOAT_CORNERS hystgen_reach_t hystgen_inverse_choose(const hystgen_inverse_t *self,
                                                                      hystgen_real_t level,
                                                                      hystgen_reach_t w,
                                                                      bool *limited) {
    bool up = self->ascending;
    if (level > self->last) {
        up = true;
    } else if (level < self->last) {
        up = false;
    }
    hystgen_reach_t v = hystgen_front_inverse(w, up, limited);
    if (!hystgen_inverse_fits(self, v, up)) {
        const hystgen_reach_t back = (hystgen_reach_t)hystgen_clamp_fine(v) - self->drive;
        if (up == self->ascending && back >= -HYSTGEN_HOLD && back <= HYSTGEN_HOLD) {
            /* it moves back only by rounding */
            v = self->drive;
        } else {
            v = hystgen_front_inverse(w, !up, limited);
            v = hystgen_inverse_fits(self, v, !up) ? v : self->drive;
        }
    }
    return v;
}
#else
/* The drive that gives w; sets `limited` if there is none. */
HYSTGEN_APART_IN_FLOAT_CORNERS hystgen_reach_t hystgen_inverse_choose(const hystgen_inverse_t *self,
                                                                      hystgen_real_t level,
                                                                      hystgen_reach_t w,
                                                                      bool *limited) {
    (void)self;
    (void)level;
    return hystgen_front_inverse(w, true, limited);
}
#endif

#endif
