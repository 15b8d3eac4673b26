/* Ends a single header in floating point: restores the user's settings. */

#if defined(__clang__) || !defined(__GNUC__)
#pragma STDC FP_CONTRACT DEFAULT
#elif defined(__FP_FAST_FMA) || defined(__FP_FAST_FMAF)
#pragma GCC pop_options
#endif
