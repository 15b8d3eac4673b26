/* Files only for float64 include this first, so that they compile when opened in an editor. */
#ifndef HYSTGEN_REAL_IS_DOUBLE
#define HYSTGEN_REAL_IS_DOUBLE
#endif
