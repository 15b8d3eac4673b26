/* First include of a file for fixed point alone, so that the file compiles (in q31) when opened in
   an editor. */
#ifndef HYSTGEN_FIXED
#define HYSTGEN_FIXED
#endif
