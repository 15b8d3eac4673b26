/* Checks of the build settings. Copied whole into every emitted file. */
#include <float.h>

#ifdef HYSTGEN_FIXED
#if (-1 >> 1) != -1
#error "hystgen: right shifts of negative numbers must keep the sign; here they do not"
#endif
#else
/* Build settings that floating-point code requires. */
#if defined(__FAST_MATH__) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__ > 0)
#error "hystgen: build without -ffast-math and -ffinite-math-only, which delete the NaN checks"
#endif
#ifdef __ASSOCIATIVE_MATH__
#error "hystgen: build without -fassociative-math: the order of additions is part of the answer"
#endif
/* <float.h> hides FLT_EVAL_METHOD before C99 and C++11, and in every C++ dialect of avr-gcc 5; the
   compiler's own macro remains defined. */
#if defined(FLT_EVAL_METHOD)
#define HYSTGEN_EVAL_METHOD FLT_EVAL_METHOD
#elif defined(__FLT_EVAL_METHOD__)
#define HYSTGEN_EVAL_METHOD __FLT_EVAL_METHOD__
#else
#error "hystgen: compile as C99 or C++11 or later; here <float.h> has no FLT_EVAL_METHOD"
#define HYSTGEN_EVAL_METHOD 0
#endif
#if HYSTGEN_EVAL_METHOD != 0 && HYSTGEN_EVAL_METHOD != 16
#error "hystgen: this target does not compute in the precision of hystgen_real_t"
#endif

#ifdef HYSTGEN_REAL_IS_DOUBLE
#if DBL_MANT_DIG != 53
#error "hystgen: double is not IEEE binary64 here"
#endif
#else
#if FLT_MANT_DIG != 24
#error "hystgen: float is not IEEE binary32 here"
#endif
#endif
#endif
