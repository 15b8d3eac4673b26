#include "hystgen_runtime.h"

/* Operators of engine loop and of every model with effects: signals in floating point, of the type
   of drives. */

static bool hystgen_finite(hystgen_signal_t x) {
    return x >= -HYSTGEN_REAL_MAX && x <= HYSTGEN_REAL_MAX; /* false for NaN */
}

static inline hystgen_fine_t hystgen_arriving(hystgen_signal_t a) {
    return a;
}

static inline hystgen_signal_t hystgen_entered_level(hystgen_real_t u) {
    return u;
}

static inline hystgen_reach_t hystgen_drive_code(hystgen_signal_t v) {
    return v;
}

static inline bool hystgen_is_drive(hystgen_real_t v) {
    return v >= HYSTGEN_DRIVE_MIN && v <= HYSTGEN_DRIVE_MAX; /* false for NaN */
}

static inline bool hystgen_is_reference(hystgen_real_t u) {
    return u >= HYSTGEN_OUTPUT_MIN && u <= HYSTGEN_OUTPUT_MAX;
}

/* An applied drive, limited to its range; never -0. */
static inline hystgen_real_t hystgen_applied_drive(hystgen_real_t v) {
    return hystgen_clamp_drive(v) + 0;
}

static inline hystgen_real_t hystgen_output_code(hystgen_signal_t y, unsigned int *status) {
    (void)status;
    return y;
}

/* A share of x. */
static inline hystgen_signal_t hystgen_shared(hystgen_real_t share, hystgen_signal_t x) {
    return share * x;
}

/* A sum of the plays as a signal, and the sum of the plays that a signal asks for. */
static inline hystgen_signal_t hystgen_level(hystgen_sum_t sum) {
    return sum;
}

static inline hystgen_sum_t hystgen_asked(hystgen_signal_t h) {
    return h;
}

/* A constant share of a way of the plays' input. */
static inline hystgen_sum_t hystgen_share_of(hystgen_sum_t x, const hystgen_real_t *share) {
    return *share * x;
}

/* A play of threshold r once its input has gone to w. */
static inline hystgen_play_t hystgen_drawn(hystgen_play_t play, hystgen_play_t w, hystgen_sum_t r) {
    const hystgen_play_t low = w - r;
    const hystgen_play_t high = w + r;
    const hystgen_play_t upper = play > high ? high : play;
    return upper < low ? low : upper;
}
