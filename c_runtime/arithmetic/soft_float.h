/* Whether floating-point operations are library calls here; the corner engine then avoids them.
   Next to them a call costs little, so functions inlined elsewhere are called, to save code. */

#ifdef HYSTGEN_REAL_IS_DOUBLE
#if (defined(__arm__) && (!defined(__ARM_FP) || (__ARM_FP & 8) == 0)) ||                           \
    (defined(__riscv) && (!defined(__riscv_flen) || __riscv_flen < 64)) || defined(__AVR__)
#define HYSTGEN_SOFT_FLOAT /* each operation is a library call */
#define HYSTGEN_SWIFT HYSTGEN_APART
#else
#define HYSTGEN_SWIFT static inline
#endif
#else
#if defined(__SOFTFP__) || defined(__AVR__) || (defined(__riscv) && !defined(__riscv_flen))
#define HYSTGEN_SOFT_FLOAT /* each operation is a library call */
#define HYSTGEN_SWIFT HYSTGEN_APART
#else
#define HYSTGEN_SWIFT static inline
#endif
#endif
