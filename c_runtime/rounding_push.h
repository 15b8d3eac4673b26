#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC push_options
#endif
