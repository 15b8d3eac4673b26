#if FLT_MANT_DIG != 24
#error "hystgen: float is not IEEE binary32 here"
#endif
