/* Two functions that compilers call on their own and that a C library would have. */

void *memcpy(void *to, const void *from, __SIZE_TYPE__ size);
void *memset(void *to, int value, __SIZE_TYPE__ size);

void *memcpy(void *to, const void *from, __SIZE_TYPE__ size) {
    volatile char *a = to; /* volatile, so that the loop does not become a call of memcpy */
    const char *b = from;
    while (size-- > 0u) {
        *a++ = *b++;
    }
    return to;
}

void *memset(void *to, int value, __SIZE_TYPE__ size) {
    volatile char *a = to;
    while (size-- > 0u) {
        *a++ = (char)value;
    }
    return to;
}
