/* First include of a file for float64 alone, so that the file compiles when opened in an editor. */
#ifndef HYSTGEN_REAL_IS_DOUBLE
#define HYSTGEN_REAL_IS_DOUBLE
#endif
