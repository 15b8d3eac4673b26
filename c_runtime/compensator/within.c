/* Answers and inputs of a module that loads its parameters, whatever the numbers in its block.
   Called by the steps of its operators. */
#ifndef HYSTGEN_WITHIN_C
#define HYSTGEN_WITHIN_C
#include "compensator/model.h"

/* The drive, or the nearest end of its range; the lower one for NaN. */
static inline hystgen_real_t hystgen_within_drives(hystgen_real_t v) {
    const hystgen_real_t least = v >= HYSTGEN_DRIVE_MIN ? v : HYSTGEN_DRIVE_MIN;
    return least <= HYSTGEN_DRIVE_MAX ? least : HYSTGEN_DRIVE_MAX;
}

#if defined(HYSTGEN_FIXED) && !defined(HYSTGEN_HAS_CORNERS) && !defined(HYSTGEN_HAS_MOVED_PLAYS)
/* The input of the plays, or the nearest end of their range. */
static inline hystgen_play_t hystgen_within_inputs(hystgen_play_t w) {
    const hystgen_reach_t least = w >= hystgen_model_tables.least ? w : hystgen_model_tables.least;
    return (hystgen_play_t)(least <= hystgen_model_tables.most ? least : hystgen_model_tables.most);
}
#endif

#ifndef HYSTGEN_FIXED
/* The displacement; 0 for one that is not finite. */
static inline hystgen_real_t hystgen_answer(hystgen_real_t y) {
    return y >= -HYSTGEN_REAL_MAX && y <= HYSTGEN_REAL_MAX ? y : 0;
}
#endif

#endif
