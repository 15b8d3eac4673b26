/* The catalogue in C, for an editor: functions of the effects that a file selects by macros defined
   before this header. Emission takes them from the `SOURCES` of each effect. */
#ifdef HYSTGEN_ASKS_LIMITS
#include "effects/delay/forward.c"
#include "effects/slew_limit/slewed.c"
#endif
#if defined(HYSTGEN_ASKS_BENDS) || defined(HYSTGEN_ASKS_MOVES)
#include "effects/noncongruent/bent.c"
#endif
#ifdef HYSTGEN_ASKS_MOVES
#include "effects/bouc_wen/elements.c"
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
#include "effects/lag/steady.c"
#include "effects/lag/braked.c"
#endif
