#ifndef HYSTGEN_FORWARD_FIXED_STATE_H
#define HYSTGEN_FORWARD_FIXED_STATE_H

/* One forward operator: drive in, output out. Plain data, owned by the caller. */
typedef struct {
    hystgen_place_t here;
    int32_t next; /* input of the plays at which another one begins to follow */
    unsigned int status;
    hystgen_kink_t kink; /* of the present step; here rather than on the stack */
    hystgen_corner_t corner[HYSTGEN_CORNERS];
} hystgen_forward_t;

#endif
