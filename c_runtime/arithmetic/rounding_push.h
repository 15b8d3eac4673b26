/* In floating point, before rounding_begin.h of a single header: saves the settings of the user's
   code. */

#if defined(__GNUC__) && !defined(__clang__) && (defined(__FP_FAST_FMA) || defined(__FP_FAST_FMAF))
#pragma GCC push_options
#endif
