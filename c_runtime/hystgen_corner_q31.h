#ifndef HYSTGEN_CORNER_Q31_H
#define HYSTGEN_CORNER_Q31_H

/* A turning point. It holds the plays of its block: those above the plays of the next corner, up to
 * play `top`. */
typedef struct {
    int32_t high; /* output at the turning point: high 2^32 + low */
    int32_t input;
    uint32_t low;
    uint_least16_t top;
    bool rose; /* whether a rising move ended here, or a falling one */
} hystgen_corner_t;

#endif
