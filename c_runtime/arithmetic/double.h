/* The first include of a file for float64 alone, so that it compiles as it is opened. */
#ifndef HYSTGEN_REAL_IS_DOUBLE
#define HYSTGEN_REAL_IS_DOUBLE
#endif
