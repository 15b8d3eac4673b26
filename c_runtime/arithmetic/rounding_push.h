/* In floating point, before rounding_begin.h where a user's own code follows in a single header. */

#if defined(__GNUC__) && !defined(__clang__) && (defined(__FP_FAST_FMA) || defined(__FP_FAST_FMAF))
#pragma GCC push_options
#endif
