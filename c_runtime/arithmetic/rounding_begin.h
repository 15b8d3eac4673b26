/* In floating point, before all code of an emitted file. */

/* Products are rounded before they are added, whatever the compiler's default is. clang and others
   have the pragma of C99 for it. gcc does not, and fuses a product and a sum across statements,
   assignments, casts and inline functions alike: short of a volatile object or a call for each
   product, no wording of the arithmetic keeps the bits. GCC's manual means its own pragma for
   debugging; it stands here only where the target has a fused instruction. */
#if defined(__clang__) || !defined(__GNUC__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__FP_FAST_FMA) || defined(__FP_FAST_FMAF)
#pragma GCC optimize("fp-contract=off")
#endif

#ifdef HYSTGEN_REAL_IS_DOUBLE
/* With -fsingle-precision-constant the literals below would lose bits. */
typedef char hystgen_constants_are_double[sizeof(1.0) == sizeof(double) ? 1 : -1];
#endif
