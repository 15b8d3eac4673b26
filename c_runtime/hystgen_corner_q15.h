#ifndef HYSTGEN_CORNER_Q15_H
#define HYSTGEN_CORNER_Q15_H

/* A turning point. It holds the plays of its block: those above the plays of the next corner, up to
 * play `top`. */
typedef struct {
    int32_t high; /* output at the turning point: high 2^16 + low */
    int32_t input;
    unsigned int low : 16;
    unsigned int top : 15;
    bool rose : 1; /* whether a rising move ended here, or a falling one */
} hystgen_corner_t;

#endif
