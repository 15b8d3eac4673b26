#if DBL_MANT_DIG != 53
#error "hystgen: double is not IEEE binary64 here"
#endif
