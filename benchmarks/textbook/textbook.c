/*
 * The yardstick for emitted modules: formula (35) written out directly, with two ternaries and a product for every play
 * in every sample, and with the same care for NaN, range and status as the emitted code. The inverse's weights and
 * thresholds make it the inverse, and the model's make it the model; the benchmark writes the tables.
 */
#include "textbook.h"

#include <float.h>

#include "textbook_tables.h"

void textbook_forward_init(textbook_forward_t *self)
{
    volatile textbook_real_t *play = self->play; /* or a compiler would call memset, which a bare core may lack */
    int i;
    for (i = 0; i < TEXTBOOK_N_PLAYS; ++i) {
        play[i] = 0;
    }
    self->answer = 0;
    self->status = 0;
}

void textbook_forward_reset(textbook_forward_t *self, textbook_real_t x)
{
    textbook_forward_init(self);
    (void)textbook_forward_step(self, x);
}

textbook_real_t textbook_forward_step(textbook_forward_t *self, textbook_real_t x)
{
    textbook_sum_t y;
    int i;
#ifndef TEXTBOOK_FRACTION
    if (!(x >= -TEXTBOOK_REAL_MAX && x <= TEXTBOOK_REAL_MAX)) {
        self->status |= TEXTBOOK_STATUS_HELD;
        return self->answer;
    }
#endif
    if (x < TEXTBOOK_INPUT_MIN) {
        x = TEXTBOOK_INPUT_MIN;
        self->status |= TEXTBOOK_STATUS_INPUT_CLAMPED;
    } else if (x > TEXTBOOK_INPUT_MAX) {
        x = TEXTBOOK_INPUT_MAX;
        self->status |= TEXTBOOK_STATUS_INPUT_CLAMPED;
    }
    y = (textbook_sum_t)textbook_weight[0] * x;
    for (i = 0; i < TEXTBOOK_N_PLAYS; ++i) {
        const textbook_real_t low = (textbook_real_t)(x - textbook_threshold[i + 1]);
        const textbook_real_t high = (textbook_real_t)(x + textbook_threshold[i + 1]);
        const textbook_real_t upper = self->play[i] > high ? high : self->play[i];
        self->play[i] = upper < low ? low : upper;
        y = y + (textbook_sum_t)textbook_weight[i + 1] * self->play[i];
    }
#ifdef TEXTBOOK_FRACTION
    y = (y + ((textbook_sum_t)1 << (TEXTBOOK_FRACTION - 1))) >> TEXTBOOK_FRACTION;
#endif
    if (y < TEXTBOOK_OUTPUT_MIN) {
        y = TEXTBOOK_OUTPUT_MIN;
        self->status |= TEXTBOOK_STATUS_OUTPUT_CLAMPED;
    } else if (y > TEXTBOOK_OUTPUT_MAX) {
        y = TEXTBOOK_OUTPUT_MAX;
        self->status |= TEXTBOOK_STATUS_OUTPUT_CLAMPED;
    }
    self->answer = (textbook_real_t)y;
    return self->answer;
}

unsigned int textbook_forward_status(textbook_forward_t *self)
{
    const unsigned int status = self->status;
    self->status = 0;
    return status;
}
