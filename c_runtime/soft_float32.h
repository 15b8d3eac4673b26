#define HYSTGEN_HALF 0.5f

/* Whether each operation of a number is a call of a library. */
#if (defined(__arm__) && !defined(__ARM_FP)) || (defined(__riscv) && !defined(__riscv_flen)) ||    \
    defined(__AVR__)
#define HYSTGEN_SOFT_FLOAT
#endif
