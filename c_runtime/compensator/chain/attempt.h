/* An input of moving or bent plays that a search in floating point tries. Needed by moving_search.c
   and by the files of effects that move plays. */
#include "arithmetic/numbers.h"
#ifndef HYSTGEN_ATTEMPT_H
#define HYSTGEN_ATTEMPT_H

/* An input of the plays that a search has tried. */
typedef struct {
    hystgen_real_t low; /* the solution lies between these */
    hystgen_real_t high;
    hystgen_real_t input;
    hystgen_real_t asked;   /* sum of the plays that the solution has */
    hystgen_real_t sum;     /* their sum at the input tried, */
    hystgen_real_t slope;   /* its change per unit change in the input, */
    hystgen_real_t steady;  /* and that in steady motion, in which plays follow in full; */
    hystgen_real_t reached; /* value that one of them reaches there, */
    hystgen_real_t share;   /* and its share of a further change in the input */
    unsigned int first;     /* the first of those that stay */
} hystgen_attempt_t;

#endif
