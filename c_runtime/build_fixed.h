#if (-1 >> 1) != -1
#error "hystgen: right shifts of negative numbers have to keep the sign here"
#endif
