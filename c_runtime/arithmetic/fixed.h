/* The first include of a file for fixed point alone, so that it compiles as it is opened: in q31.
 */
#ifndef HYSTGEN_FIXED
#define HYSTGEN_FIXED
#endif
