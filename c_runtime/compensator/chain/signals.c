/* Operators of the loop engine and of every model with effects: signals between blocks. In
   floating point they have the type of drives. In fixed point they are finer than codes; without
   effects, drives remain codes up to the plays, and sums of the plays have HYSTGEN_FRACTION bits
   below an output code. Called by chain.c, chain_calls.c and the plays. */
#ifndef HYSTGEN_CHAIN_SIGNALS_C
#define HYSTGEN_CHAIN_SIGNALS_C
#include "compensator/chain/model.h"
#include "compensator/clamp.c"
#ifdef HYSTGEN_FIXED
#ifdef HYSTGEN_CHAIN
#include "arithmetic/factors.c"
#endif
#include "compensator/code.c"
#endif

#ifdef HYSTGEN_FIXED
/* Every code is a finite number. */
static inline bool hystgen_finite(hystgen_signal_t x) {
    (void)x;
    return true;
}

static inline bool hystgen_is_drive(hystgen_real_t v) {
    return hystgen_clamp_drive(v) == v;
}

static inline bool hystgen_is_reference(hystgen_real_t u) {
    return hystgen_inverse_clamp(u) == u;
}

/* An applied drive, limited to its range. */
static inline hystgen_real_t hystgen_applied_drive(hystgen_real_t v) {
    return hystgen_clamp_drive(v);
}

#ifdef HYSTGEN_CHAIN
/* The output of the drive side, in units of the plays' input. */
static inline hystgen_fine_t hystgen_arriving(hystgen_signal_t a) {
    return (hystgen_fine_t)hystgen_nearest(a, HYSTGEN_ARRIVING_BITS);
}

static inline hystgen_signal_t hystgen_level_signal(hystgen_real_t u) {
    return (hystgen_signal_t)u * ((hystgen_signal_t)1 << HYSTGEN_LEVEL_BITS);
}

/* Drive code of a signal, limited to two spans beyond the range. */
static hystgen_reach_t hystgen_drive_code(hystgen_signal_t v) {
    const hystgen_signal_t code = hystgen_nearest(v, HYSTGEN_DRIVE_BITS);
    if (code > HYSTGEN_MOST_CODE) {
        return (hystgen_reach_t)HYSTGEN_MOST_CODE;
    }
    if (code < HYSTGEN_LEAST_CODE) {
        return (hystgen_reach_t)HYSTGEN_LEAST_CODE;
    }
    return (hystgen_reach_t)code;
}

/* Output code of a signal, limited to the type. */
static hystgen_real_t hystgen_output_code(hystgen_signal_t y, unsigned int *status) {
    return hystgen_limited_code(hystgen_nearest(y, HYSTGEN_LEVEL_BITS), status);
}

/* A share of x. The largest code stands for the share just below 1. */
static hystgen_signal_t hystgen_shared(hystgen_real_t share, hystgen_signal_t x) {
    const hystgen_factor_t f = {(int32_t)share * ((int32_t)1 << HYSTGEN_SHARE_BITS), 31u};
    return hystgen_times(x, &f);
}

/* A sum of the plays, which has more low-order bits than a signal, as a signal. */
static inline hystgen_signal_t hystgen_level(hystgen_sum_t sum) {
    return hystgen_nearest(sum, HYSTGEN_LEVEL_DROP);
}

/* The sum of the plays for a signal, limited to the largest possible sum. */
static inline hystgen_sum_t hystgen_asked(hystgen_signal_t h) {
    hystgen_signal_t inside;
    if (h > HYSTGEN_LARGEST_LEVEL) {
        inside = HYSTGEN_LARGEST_LEVEL;
    } else if (h < -HYSTGEN_LARGEST_LEVEL) {
        inside = -HYSTGEN_LARGEST_LEVEL;
    } else {
        inside = h;
    }
    return inside * ((hystgen_sum_t)1 << HYSTGEN_LEVEL_DROP);
}

/* A constant share of a move of the plays' input. */
static inline hystgen_sum_t hystgen_share_of(hystgen_sum_t x, const hystgen_factor_t *share) {
    return hystgen_short_times(x, share);
}

/* A play of threshold r after its input has moved to w. Their distance fits in 32 bits. */
static inline hystgen_play_t hystgen_drawn(hystgen_play_t play, hystgen_play_t w, hystgen_sum_t r) {
    const uint32_t way = (uint32_t)(w > play ? (hystgen_sum_t)w - play : (hystgen_sum_t)play - w);
    if ((hystgen_sum_t)way <= r) {
        return play;
    }
    return (hystgen_play_t)(w > play ? (hystgen_sum_t)w - r : (hystgen_sum_t)w + r);
}
#else
static inline hystgen_fine_t hystgen_arriving(hystgen_signal_t a) {
    return (hystgen_fine_t)a;
}

static inline hystgen_signal_t hystgen_level_signal(hystgen_real_t u) {
    return (hystgen_signal_t)u * ((hystgen_signal_t)1 << HYSTGEN_FRACTION);
}

static inline hystgen_reach_t hystgen_drive_code(hystgen_signal_t v) {
    return (hystgen_reach_t)v;
}

static inline hystgen_real_t hystgen_output_code(hystgen_signal_t y, unsigned int *status) {
    return hystgen_code(y, status);
}

static inline hystgen_signal_t hystgen_level(hystgen_sum_t sum) {
    return sum;
}

static inline hystgen_sum_t hystgen_asked(hystgen_signal_t h) {
    return h;
}
#endif
#else
static bool hystgen_finite(hystgen_signal_t x) {
    return x >= -HYSTGEN_REAL_MAX && x <= HYSTGEN_REAL_MAX; /* false for NaN */
}

static inline hystgen_fine_t hystgen_arriving(hystgen_signal_t a) {
    return a;
}

static inline hystgen_signal_t hystgen_level_signal(hystgen_real_t u) {
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

/* A sum of the plays as a signal, and the sum of the plays for a signal. */
static inline hystgen_signal_t hystgen_level(hystgen_sum_t sum) {
    return sum;
}

static inline hystgen_sum_t hystgen_asked(hystgen_signal_t h) {
    return h;
}

/* A constant share of a move of the plays' input. */
static inline hystgen_sum_t hystgen_share_of(hystgen_sum_t x, const hystgen_real_t *share) {
    return *share * x;
}

/* A play of threshold r after its input has moved to w. */
static inline hystgen_play_t hystgen_drawn(hystgen_play_t play, hystgen_play_t w, hystgen_sum_t r) {
    const hystgen_play_t low = w - r;
    const hystgen_play_t high = w + r;
    const hystgen_play_t upper = play > high ? high : play;
    return upper < low ? low : upper;
}
#endif

#endif
