/* The whole run time as one translation unit, as the shared-runtime layout compiles it. */
#include "hystgen_runtime.h"
#ifdef HYSTGEN_FIXED
#include "arithmetic/division.c"
#include "plays/corners_fixed.c"
#include "plays/loop_absorb.c"
#include "plays/loop_solve_fixed.c"
#include "front/curve.c"
#else
#ifdef HYSTGEN_REAL_IS_DOUBLE
#include "front/tanh_f64.c"
#include "front/atanh_f64.c"
#else
#include "front/tanh_f32.c"
#include "front/atanh_f32.c"
#endif
#include "front/envelope.c"
#include "front/dead_zones.c"
#include "plays/corners_float.c"
#include "plays/loop_absorb.c"
#include "plays/loop_solve.c"
#endif
