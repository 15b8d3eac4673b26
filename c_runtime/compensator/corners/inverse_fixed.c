/* The inverse without a memoryless part, in fixed point. Called by users and by start.c. */
#include "arithmetic/fixed.h"
#ifndef HYSTGEN_CONFIGURED
#define HYSTGEN_HAS_CORNERS
#endif
#include "compensator/model.h"
#include "front/front.c"
#include "compensator/clamp.c"

#ifdef HYSTGEN_INVERSE
#ifdef HYSTGEN_HAS_FINE_PLAYS
/* Remainder of an output move `on` after an input move `way`; the input is finer than a code. */
static inline int64_t hystgen_inverse_left(int64_t on, uint32_t slope, uint32_t way) {
    return on - (int64_t)hystgen_wide(slope, way);
}
#else
/* Remainder of an output move `on` after an input move `way`. The input moves by whole drive codes,
   to the nearest one: the remainder is less than the output of one code, which fits 32 bits. */
static inline int64_t hystgen_inverse_left(int64_t on, uint32_t slope, uint32_t way) {
    const uint32_t left = (uint32_t)on - slope * way;
    const uint32_t sign = 0x80000000u;
    return (int64_t)(left ^ sign) - (int64_t)sign;
}
#endif

/* A reference along the present move; ~u is -u - 1, which overflows for no code. */
static inline int32_t hystgen_inverse_along(const hystgen_inverse_t *self, int32_t u) {
    return self->here.rising ? u : ~u;
}

/* No step is usual until another search, which starts from the present place. */
static void hystgen_inverse_stay(hystgen_inverse_t *self) {
    self->next = -HYSTGEN_LARGEST - 1;
    self->usual = false;
}

/* Steps are usual up to the next kink or limit, minus a margin for rounding, but not below the
   smallest reference. */
HYSTGEN_APART void hystgen_inverse_look_ahead(hystgen_inverse_t *self, int64_t next) {
    const hystgen_place_t *here = &self->here;
    const int32_t most =
        hystgen_inverse_along(self, here->rising ? HYSTGEN_OUTPUT_MAX : HYSTGEN_OUTPUT_MIN);
    const int32_t end = hystgen_front_forward(here->rising ? HYSTGEN_DRIVE_MAX : HYSTGEN_DRIVE_MIN);
    const uint32_t room = here->rising ? (uint32_t)end - (uint32_t)here->input
                                       : (uint32_t)here->input - (uint32_t)end;
    const int64_t more = (int64_t)hystgen_wide(hystgen_model_curve.segment[here->k].slope, room);
    const int64_t last = here->rising ? here->output + more : more - here->output;
    const int64_t usual = ((next < last ? next : last) >> HYSTGEN_FRACTION) - HYSTGEN_SHY;
    const int64_t least = (int64_t)(here->rising ? HYSTGEN_OUTPUT_MIN : HYSTGEN_OUTPUT_MAX) *
                          ((int64_t)1 << HYSTGEN_FRACTION);
    if (usual > self->next && (here->rising ? here->output >= least : here->output <= least)) {
        self->next = usual < most ? (int32_t)usual : most;
    }
}

/* Any sample that needs a search. */
HYSTGEN_APART hystgen_real_t hystgen_inverse_search(hystgen_inverse_t *self, hystgen_real_t u) {
    hystgen_copy_place(&self->undo, &self->here);
    self->usual = false;
    if (!self->repeated || u != self->reference) {
        const hystgen_real_t level = hystgen_inverse_clamp(u);
        const int64_t output = (int64_t)level * ((int64_t)1 << HYSTGEN_FRACTION);
        self->reference = u;
        self->repeated = true;
        self->bits = level != u ? HYSTGEN_STATUS_INPUT_CLAMPED : 0u;
        const int64_t w = hystgen_solve(&hystgen_model_curve, &self->here, self->corner, output,
                                        -HYSTGEN_FAR, &self->kink);
        const hystgen_reach_t v = hystgen_front_inverse((hystgen_reach_t)w);
        const hystgen_real_t inside = hystgen_clamp_drive(v);
        if (inside != v) {
            self->bits |= HYSTGEN_STATUS_OUTPUT_CLAMPED;
        }
        hystgen_inverse_stay(self);
        const int64_t next =
            hystgen_move_to_solution(&hystgen_model_curve, &self->here, self->corner, &self->kink,
                                     hystgen_front_forward(inside));
        if (self->bits == 0) {
            hystgen_inverse_look_ahead(self, next);
        }
    }
    self->status |= self->bits;
    return (hystgen_real_t)hystgen_front_inverse(self->here.input);
}

/* One sample. The memory takes the returned drive as applied at once; a commit undoes the step and
   applies the committed drive instead.

   last call   memory at             commit replaces       the same reference again
   init        the start memory      nothing               is solved
   step        the returned drive    the returned drive    returns the same drive
   commit      the committed drive   the committed drive   is solved again */
hystgen_real_t hystgen_operator_step(hystgen_operator_t *self, hystgen_real_t u) {
    hystgen_place_t *here = &self->here;
    const int64_t output = (int64_t)u * ((int64_t)1 << HYSTGEN_FRACTION);
    const int64_t on = here->rising ? output - here->output : here->output - output;
    if (hystgen_inverse_along(self, u) < self->next && on > 0 && u != self->reference) {
        /* usual: the same plays follow */
        const hystgen_segment_t *s = &hystgen_model_curve.segment[here->k];
        const int64_t step = hystgen_divide_by_slope(on, s->reciprocal, s->shift);
        const int64_t w = here->rising ? here->input + step : here->input - step;
        const hystgen_real_t v = (hystgen_real_t)hystgen_front_inverse((hystgen_reach_t)w);
        const int32_t to = hystgen_front_forward(v);
        const uint32_t way = here->rising ? (uint32_t)to - (uint32_t)here->input
                                          : (uint32_t)here->input - (uint32_t)to;
        const int64_t left = hystgen_inverse_left(on, s->slope, way);
        self->before = here->input;
        self->usual = true;
        self->reference = u;
        here->input = to;
        here->output = here->rising ? output - left : output + left;
        return v;
    }
    return hystgen_inverse_search(self, u);
}

void hystgen_inverse_commit(hystgen_inverse_t *self, hystgen_real_t applied) {
    const hystgen_real_t v = hystgen_clamp_drive(applied);
    if (v != applied) {
        self->status |= HYSTGEN_STATUS_INPUT_CLAMPED;
    }
    if (self->usual) {
        hystgen_copy_place(&self->undo, &self->here);
        self->undo.input = self->before;
        const int64_t way = (int64_t)self->here.input - self->before;
        self->undo.output -= way * (int64_t)hystgen_model_curve.segment[self->here.k].slope;
    }
    hystgen_copy_place(&self->here, &self->undo);
    hystgen_inverse_stay(self);
    self->repeated = false;
    hystgen_move_to_input(&hystgen_model_curve, &self->here, self->corner, &self->kink,
                          hystgen_front_forward(v));
}

/* The part common to init and reset. */
static void hystgen_operator_begin(hystgen_operator_t *self, bool reset) {
    hystgen_start(&hystgen_model_curve, &self->here, self->corner,
                  reset ? hystgen_model_zero : hystgen_model_start,
                  reset ? 0u : HYSTGEN_START_STEP);
    hystgen_copy_place(&self->undo, &self->here);
    hystgen_inverse_stay(self);
    self->before = 0;
    self->reference = 0;
    self->repeated = false;
    self->bits = 0;
    self->status = 0;
}
#endif
