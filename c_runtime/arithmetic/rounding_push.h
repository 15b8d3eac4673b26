/* Begins a single header in floating point: saves the user's settings. */

#if defined(__GNUC__) && !defined(__clang__) && (defined(__FP_FAST_FMA) || defined(__FP_FAST_FMAF))
#pragma GCC push_options
#endif
