#ifndef TEXTBOOK_H
#define TEXTBOOK_H

#include <stdint.h>

/* written by the benchmark: TEXTBOOK_REAL and _SUM, TEXTBOOK_N_PLAYS, TEXTBOOK_REAL_MAX or, in fixed point, _FRACTION */
#include "textbook_sizes.h"

typedef TEXTBOOK_REAL textbook_real_t;
typedef TEXTBOOK_SUM textbook_sum_t;

#define TEXTBOOK_STATUS_INPUT_CLAMPED 1u
#define TEXTBOOK_STATUS_OUTPUT_CLAMPED 2u
#define TEXTBOOK_STATUS_HELD 4u

typedef struct {
    textbook_real_t play[TEXTBOOK_N_PLAYS];
    textbook_real_t answer;
    unsigned int status;
} textbook_forward_t;

void textbook_forward_init(textbook_forward_t *self);
void textbook_forward_reset(textbook_forward_t *self, textbook_real_t x);
textbook_real_t textbook_forward_step(textbook_forward_t *self, textbook_real_t x);
unsigned int textbook_forward_status(textbook_forward_t *self);

#endif
