#ifndef HYSTGEN_FORWARD_FRONT_STATE_H
#define HYSTGEN_FORWARD_FRONT_STATE_H

/* One forward operator: drive in, output out. Plain data, owned by the caller. */
typedef struct {
    hystgen_plays_t plays;
    hystgen_real_t drive; /* of the last step */
    bool ascending;       /* direction of the drive's last move */
    unsigned int status;
    hystgen_corner_t corner[HYSTGEN_CORNERS];
} hystgen_forward_t;

#endif
