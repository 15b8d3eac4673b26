/* Functions that compilers must not inline, to save stack. */

#if defined(__GNUC__)
#define HYSTGEN_APART __attribute__((noinline)) static /* has several callers, or rarely runs */
#else
#define HYSTGEN_APART static
#endif

#ifdef HYSTGEN_CHAIN
/* Step is not inlined into reset, and loops over plays are not unrolled: both save stack. */
#if defined(__GNUC__)
#define HYSTGEN_ALONE __attribute__((noinline))
#else
#define HYSTGEN_ALONE
#endif
#if defined(__clang__)
#define HYSTGEN_ROLLED _Pragma("clang loop unroll(disable)")
#else
#define HYSTGEN_ROLLED
#endif
#endif
