#if defined(__GNUC__)
#define HYSTGEN_APART __attribute__((noinline)) static /* has several callers, or rarely runs */
#else
#define HYSTGEN_APART static
#endif
