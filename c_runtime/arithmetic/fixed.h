/* Included first by files for fixed point only, so that they compile (in q31) when opened in an
   editor. */
#ifndef HYSTGEN_FIXED
#define HYSTGEN_FIXED
#endif
