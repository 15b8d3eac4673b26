#if defined(__SOFTFP__) || defined(__AVR__) || (defined(__riscv) && !defined(__riscv_flen))
#define HYSTGEN_SOFT_FLOAT /* each operation is a library call */
#endif
