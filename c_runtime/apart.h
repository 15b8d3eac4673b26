#if defined(__GNUC__)
#define HYSTGEN_APART __attribute__((noinline)) static /* called from several places, or rarely */
#else
#define HYSTGEN_APART static
#endif
