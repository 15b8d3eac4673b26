/* Precedes all code of an emitted file in floating point. */

/* Products are rounded before they are added, whatever the compiler's default. clang and others
   obey the C99 pragma. gcc ignores it and fuses products and sums even across statements,
   assignments, casts and inline functions; only a volatile object or a call for each product would
   keep the bits. GCC's manual recommends its own pragma for debugging only, so the pragma is used
   only on targets with a fused instruction. */
#if defined(__clang__) || !defined(__GNUC__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__FP_FAST_FMA) || defined(__FP_FAST_FMAF)
#pragma GCC optimize("fp-contract=off")
#endif

#ifdef HYSTGEN_REAL_IS_DOUBLE
/* With -fsingle-precision-constant the literals below would lose bits. */
typedef char hystgen_constants_are_double[sizeof(1.0) == sizeof(double) ? 1 : -1];
#endif
