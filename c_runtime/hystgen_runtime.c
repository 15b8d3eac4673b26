/* The whole run time as one translation unit, as the shared-runtime layout compiles it. */
#include "hystgen_runtime.h"
#ifdef HYSTGEN_FIXED
#include "over_slope.c"
#include "corners_fixed.c"
#include "loop_absorb.c"
#include "loop_solve_fixed.c"
#include "curve.c"
#else
#ifdef HYSTGEN_REAL_IS_DOUBLE
#include "tanh_f64.c"
#include "atanh_f64.c"
#else
#include "tanh_f32.c"
#include "atanh_f32.c"
#endif
#include "envelope_forward.c"
#include "envelope_inverse.c"
#include "dead_zone_forward.c"
#include "dead_zone_inverse.c"
#include "corners_float.c"
#include "loop_absorb.c"
#include "loop_solve.c"
#endif
