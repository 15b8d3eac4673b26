/* Files only for fixed point include this first, so that they compile (in q31) when opened in an
   editor. */
#ifndef HYSTGEN_FIXED
#define HYSTGEN_FIXED
#endif
