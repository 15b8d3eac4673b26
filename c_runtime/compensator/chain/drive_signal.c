/* A drive as a signal between blocks. Called by chain.c and by blocks that compare a drive with a
   signal. */
#ifndef HYSTGEN_CHAIN_DRIVE_SIGNAL_C
#define HYSTGEN_CHAIN_DRIVE_SIGNAL_C
#include "compensator/chain/model.h"

#if defined(HYSTGEN_FIXED) && defined(HYSTGEN_CHAIN)
/* A drive, possibly outside the range of codes, as a signal. */
static inline hystgen_signal_t hystgen_drive_signal(hystgen_reach_t v) {
    return (hystgen_signal_t)v * ((hystgen_signal_t)1 << HYSTGEN_DRIVE_BITS);
}
#else
/* A drive as a signal. */
static inline hystgen_signal_t hystgen_drive_signal(hystgen_reach_t v) {
    return v;
}
#endif

#endif
