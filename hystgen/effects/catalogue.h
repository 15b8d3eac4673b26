/* The catalogue in C, for files as they are opened in an editor: the functions of effects that a
   file asks for by what it defines in front of this. Emission lists them by `SOURCES` of each
   effect instead. */
#ifdef HYSTGEN_ASKS_LIMITS
#include "effects/delay/forward.c"
#include "effects/slew_limit/slewed.c"
#endif
#ifdef HYSTGEN_ASKS_BENDS
#include "effects/noncongruent/bent.c"
#endif
#ifdef HYSTGEN_ASKS_MOVES
#ifdef HYSTGEN_HAS_DASHPOT_PLAYS
#include "effects/rate_dependence/dashpot.c"
#else
#include "effects/rate_dependence/moved.c"
#endif
#endif
#ifdef HYSTGEN_ASKS_LED
#ifdef HYSTGEN_HAS_QUIET_DRIVE
#include "effects/lag/quiet.c"
#endif
#ifdef HYSTGEN_FIXED
#ifdef HYSTGEN_HAS_STEADY_LAG
#include "effects/lag/steady_fixed.c"
#endif
#include "effects/lag/braked_fixed.c"
#else
#ifdef HYSTGEN_HAS_STEADY_LAG
#include "effects/lag/steady.c"
#endif
#include "effects/lag/braked.c"
#endif
#endif
