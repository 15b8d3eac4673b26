#if defined(__SOFTFP__) || defined(__AVR__) || (defined(__riscv) && !defined(__riscv_flen))
#define HYSTGEN_SOFT_FLOAT /* each operation of a number is a call of a library */
#endif
