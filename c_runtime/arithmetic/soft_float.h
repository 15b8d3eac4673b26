/* Whether floating-point operations are library calls here; the corner engine then avoids them.
   Next to them a call costs little, so functions inlined elsewhere are called, to save code. Floats
   are then compared by their bits; with doubles that would take more code than the calls. */

#ifdef HYSTGEN_REAL_IS_DOUBLE
#if (defined(__arm__) && (!defined(__ARM_FP) || (__ARM_FP & 8) == 0)) ||                           \
    (defined(__riscv) && (!defined(__riscv_flen) || __riscv_flen < 64)) || defined(__AVR__)
#define HYSTGEN_SOFT_FLOAT /* each operation is a library call */
#define HYSTGEN_SWIFT HYSTGEN_APART
#else
#define HYSTGEN_SWIFT static inline
#endif
#define hystgen_order(x) (x)
#define hystgen_above(a, b) ((a) > (b))
#else
#if defined(__SOFTFP__) || defined(__AVR__) || (defined(__riscv) && !defined(__riscv_flen))
#define HYSTGEN_SOFT_FLOAT /* each operation is a library call */
#define HYSTGEN_SWIFT HYSTGEN_APART
/* An integer in the order of x: 0 for both zeros, and for a NaN beyond those of all numbers. */
static inline int32_t hystgen_order(float x) {
    const union {
        float real;
        int32_t bits;
    } u = {x};
    return u.bits < 0 ? -(u.bits & 0x7fffffff) : u.bits;
}
HYSTGEN_APART bool hystgen_above(float a, float b) {
    return hystgen_order(a) > hystgen_order(b);
}
#else
#define HYSTGEN_SWIFT static inline
#define hystgen_order(x) (x)
#define hystgen_above(a, b) ((a) > (b))
#endif
#endif
