/* Answers of a module that loads its parameters, whatever the numbers in its block. Called by the
   steps of its operators. */
#ifndef HYSTGEN_WITHIN_C
#define HYSTGEN_WITHIN_C
#include "compensator/model.h"

/* The drive, or the nearest end of its range; the lower one for NaN. */
static inline hystgen_real_t hystgen_within_drives(hystgen_real_t v) {
    const hystgen_real_t least = v >= HYSTGEN_DRIVE_MIN ? v : HYSTGEN_DRIVE_MIN;
    return least <= HYSTGEN_DRIVE_MAX ? least : HYSTGEN_DRIVE_MAX;
}

#ifndef HYSTGEN_FIXED
/* The displacement; 0 for one that is not finite. */
static inline hystgen_real_t hystgen_answer(hystgen_real_t y) {
    return y >= -HYSTGEN_REAL_MAX && y <= HYSTGEN_REAL_MAX ? y : 0;
}
#endif

#endif
