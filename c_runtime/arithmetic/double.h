/* Included first by files for float64 only, so that they compile when opened in an editor. */
#ifndef HYSTGEN_REAL_IS_DOUBLE
#define HYSTGEN_REAL_IS_DOUBLE
#endif
