/* Operators of a model with effects: plays moved or bent by an effect. The state of play i is the
   value at which the play would come to rest (`play`). In floating point, its contribution there is
   kept (`bent`). Called by chain.c and moving_search.c. */
#ifndef HYSTGEN_CHAIN_MOVING_PLAYS_C
#define HYSTGEN_CHAIN_MOVING_PLAYS_C
#include "compensator/chain/model.h"
#include "compensator/chain/signals.c"
#define HYSTGEN_ASKS_MOVES
#include "effects/catalogue.h"

#ifdef HYSTGEN_HAS_ELEMENTS
/* The distance of w from the last turn of the elements, in the direction in which they move. */
static inline hystgen_sum_t hystgen_operator_way(const hystgen_operator_t *self, hystgen_play_t w) {
    const hystgen_sum_t rise = (hystgen_sum_t)w - self->turned;
    return self->upward ? rise : -rise;
}

#ifdef HYSTGEN_FIXED
/* Sum of the elements after their input has moved on to w, in the direction in which they move, or
   at rest: along the slope at a place near w (`near`). */
static inline hystgen_sum_t hystgen_operator_joined(const hystgen_operator_t *self,
                                                    hystgen_play_t w) {
    return self->moving ? self->joined + self->slope * ((hystgen_sum_t)w - self->near) : 0;
}

/* The elements depart from the input w, where this is their sum, in a new direction. */
static void hystgen_operator_depart(hystgen_operator_t *self, hystgen_play_t w, hystgen_sum_t sum) {
    unsigned int j;
    self->near = w;
    self->joined = sum;
    self->slope = 0;
    self->departs = true;
    HYSTGEN_ROLLED
    for (j = 0; j < HYSTGEN_ELEMENTS; ++j) {
        self->slope += hystgen_element_slope(j, self->element[j].c[0] >> HYSTGEN_STEEP);
    }
}
#endif

/* The elements turn at the present input of the plays. Their sum goes on from there. */
HYSTGEN_APART void hystgen_operator_turn_elements(hystgen_operator_t *self) {
    const hystgen_sum_t way = hystgen_operator_way(self, self->play[0]);
    unsigned int j;
    HYSTGEN_ROLLED
    for (j = 0; j < HYSTGEN_ELEMENTS; ++j) {
        hystgen_element_turn(j, &self->element[j], hystgen_element_distance(j, way), self->play[0]);
    }
#ifdef HYSTGEN_FIXED
    hystgen_operator_depart(self, self->play[0], hystgen_operator_joined(self, self->play[0]));
#endif
    self->turned = self->play[0];
    self->upward = !self->upward;
}

#ifdef HYSTGEN_FIXED
/* Computes the sum of the elements at w, and its slope, unless it has been computed near w since
   they departed. */
HYSTGEN_APART void hystgen_operator_approach(hystgen_operator_t *self, hystgen_play_t w) {
    const hystgen_sum_t on = (hystgen_sum_t)w - self->near;
    const hystgen_sum_t way = hystgen_operator_way(self, w);
    hystgen_sum_t sum = 0;
    unsigned int j;
    if (!self->moving || on == 0 ||
        (!self->departs && on <= HYSTGEN_STRAIGHT && on >= -HYSTGEN_STRAIGHT)) {
        return;
    }
    self->near = w;
    self->departs = false;
    self->slope = 0;
    HYSTGEN_ROLLED
    for (j = 0; j < HYSTGEN_ELEMENTS; ++j) {
        sum += hystgen_element_part(j, &self->element[j], hystgen_element_distance(j, way),
                                    &self->slope);
    }
#ifdef HYSTGEN_HAS_TILT
    sum -= self->upward ? HYSTGEN_BASE : -HYSTGEN_BASE;
#endif
    self->joined = self->upward ? sum : -sum;
}

#else
/* Sum of the elements after their input has moved on to w, in the direction in which they move,
   or at rest. Sets its slope. */
HYSTGEN_APART hystgen_sum_t hystgen_operator_joined(const hystgen_operator_t *self,
                                                    hystgen_play_t w, hystgen_sum_t *slope) {
    const hystgen_sum_t way = hystgen_operator_way(self, w);
    hystgen_sum_t sum = 0;
    unsigned int j;
    *slope = 0;
    if (!self->moving) {
        return 0;
    }
    HYSTGEN_ROLLED
    for (j = 0; j < HYSTGEN_ELEMENTS; ++j) {
        hystgen_sum_t change;
        const hystgen_sum_t s =
            hystgen_element_at(&self->element[j], hystgen_element_distance(j, way), &change);
        sum = sum + hystgen_element_amplitude[j] * s;
        *slope = *slope + hystgen_element_weight[j] * change;
    }
#ifdef HYSTGEN_HAS_TILT
    sum = sum - (self->upward ? HYSTGEN_BASE : -HYSTGEN_BASE);
#endif
    return self->upward ? sum : -sum;
}
#endif

/* The elements turn where their input, on its way to w, moves in the other direction; or they come
   to rest there. Returns whether they have turned. */
static bool hystgen_operator_elements(hystgen_operator_t *self, hystgen_play_t w) {
    unsigned int j;
    if (self->moving) {
        const bool turns = self->upward ? w < self->play[0] : w > self->play[0];
        if (turns) {
            hystgen_operator_turn_elements(self);
        }
        return turns;
    }
    self->turned = w;
    self->upward = true;
    HYSTGEN_ROLLED
    for (j = 0; j < HYSTGEN_ELEMENTS; ++j) {
        hystgen_element_unload(j, &self->element[j], w);
    }
#ifdef HYSTGEN_FIXED
    hystgen_operator_depart(self, w, 0);
#endif
    return false;
}
#endif

/* Play i at rest with its input at w. */
static hystgen_play_t hystgen_resting(unsigned int i, const hystgen_play_t *play,
                                      hystgen_play_t w) {
    return hystgen_drawn(play[i], w, hystgen_model_tables.threshold[i]);
}

#ifndef HYSTGEN_HAS_DASHPOT_PLAYS
/* Play i after the input of the plays has moved from x to w. Not inlined where this saves
   stack. */
HYSTGEN_APART_IF_MOVED hystgen_play_t hystgen_reached(unsigned int i, const hystgen_play_t *play,
                                                      hystgen_play_t x, hystgen_play_t w) {
    return hystgen_moved(i, play, x, w);
}

/* Play i moves while the input of the plays moves from x to w. Returns whether it does. */
static bool hystgen_move(unsigned int i, hystgen_play_t *play, hystgen_play_t x, hystgen_play_t w) {
    const hystgen_play_t before = play[i];
    play[i] = hystgen_reached(i, play, x, w);
    return play[i] < before || play[i] > before;
}

/* Play i rests at z. */
static void hystgen_put(unsigned int i, hystgen_play_t *play, hystgen_play_t z) {
    play[i] = z;
}
#endif

#if defined(HYSTGEN_FIXED) && defined(HYSTGEN_HAS_PLAIN_PLAYS)
/* Bent plays leave their places in the order of their thresholds; the contributions of those that
   stay are kept as a sum (`staying`). Removes the plays that leave for w from this sum. */
HYSTGEN_APART void hystgen_operator_release(hystgen_operator_t *self, hystgen_play_t w) {
    unsigned int i;
    HYSTGEN_ROLLED
    for (i = self->released + 1u; i <= HYSTGEN_N_PLAYS; ++i) {
        if (hystgen_resting(i, self->play, w) == self->play[i]) {
            break;
        }
        self->staying -=
            (hystgen_sum_t)hystgen_model_tables.weight[i] * hystgen_bent(i, self->play[i]);
        self->released = i;
    }
}

/* Sum of the plays after their input has moved to w, once those that leave for w are released;
   increases with w. */
HYSTGEN_APART hystgen_sum_t hystgen_operator_sum(const hystgen_operator_t *self, hystgen_play_t w) {
    hystgen_sum_t sum = (hystgen_sum_t)hystgen_model_tables.weight[0] * w + self->staying;
    unsigned int i;
    HYSTGEN_ROLLED
    for (i = 1; i <= self->released; ++i) {
        sum += (hystgen_sum_t)hystgen_model_tables.weight[i] *
               hystgen_bent(i, hystgen_resting(i, self->play, w));
    }
#ifdef HYSTGEN_HAS_ELEMENTS
    sum += hystgen_operator_joined(self, w);
#endif
    return sum;
}

/* The plays move with their input to w; their sum is now `sum`. All stay if the last mover does. */
HYSTGEN_APART void hystgen_operator_move(hystgen_operator_t *self, hystgen_play_t w,
                                         hystgen_sum_t sum) {
    hystgen_play_t before = 0;
    unsigned int i;
    HYSTGEN_ROLLED
    for (i = 1; i <= self->released; ++i) {
        before = self->play[i];
        self->play[i] = hystgen_resting(i, self->play, w);
    }
    self->play[0] = w;
    if (self->play[self->released] == before) {
        self->staying = sum - (hystgen_sum_t)hystgen_model_tables.weight[0] * w;
#ifdef HYSTGEN_HAS_ELEMENTS
        self->staying -= hystgen_operator_joined(self, w);
#endif
        self->released = 0;
    }
    self->level = hystgen_level(sum);
}

/* The plays follow their input w, or come to rest there, and a search begins anew. Updates their
   sum, unless a search has just found it. */
static void hystgen_operator_follow(hystgen_operator_t *self, hystgen_play_t w) {
    if (!self->moving) {
        self->staying = 0;
        self->released = HYSTGEN_N_PLAYS;
    }
#ifdef HYSTGEN_INVERSE
#ifdef HYSTGEN_HAS_ELEMENTS
    const bool turned = hystgen_operator_elements(self, w);
    if (!self->moving || turned || w != self->search.input) {
#else
    if (!self->moving || w != self->search.input) {
#endif
#ifdef HYSTGEN_HAS_ELEMENTS
        hystgen_operator_approach(self, w);
#endif
        hystgen_operator_release(self, w);
        self->search.input = w;
        self->search.found = hystgen_operator_sum(self, w);
    }
    self->search.rate = self->moving ? self->search.rate : HYSTGEN_FASTEST;
#ifdef HYSTGEN_HAS_SMOOTH_SUM
    self->steep = self->moving ? self->steep : 0;
#endif
    hystgen_operator_move(self, w, self->search.found);
#else
#ifdef HYSTGEN_HAS_ELEMENTS
    (void)hystgen_operator_elements(self, w);
    hystgen_operator_approach(self, w);
#endif
    hystgen_operator_release(self, w);
    hystgen_operator_move(self, w, hystgen_operator_sum(self, w));
#endif
}
#elif defined(HYSTGEN_FIXED)
/* Sum of the plays after their input has moved to w, or at rest at w; increases with w. */
HYSTGEN_APART hystgen_sum_t hystgen_operator_sum(const hystgen_operator_t *self, hystgen_play_t w) {
    hystgen_sum_t sum = (hystgen_sum_t)hystgen_model_tables.weight[0] * w;
    unsigned int i;
#ifdef HYSTGEN_HAS_ELEMENTS
    sum += hystgen_operator_joined(self, w);
#endif
#ifdef HYSTGEN_HAS_DILATED_PLAYS
    if (self->moving && w != self->play[0]) { /* thresholds grow only with a move */
#else
    if (self->moving) {
#endif
        for (i = 1; i <= HYSTGEN_N_PLAYS; ++i) {
            const hystgen_play_t z = hystgen_moved(i, self->play, self->play[0], w);
            sum += (hystgen_sum_t)hystgen_model_tables.weight[i] * hystgen_bent(i, z);
        }
        return sum;
    }
    HYSTGEN_ROLLED
    for (i = 1; i <= HYSTGEN_N_PLAYS; ++i) {
        const hystgen_play_t z = hystgen_resting(i, self->play, w);
        sum += (hystgen_sum_t)hystgen_model_tables.weight[i] * hystgen_bent(i, z);
    }
    return sum;
}

/* The plays move while their input moves to w, or come to rest. Updates their sum. */
HYSTGEN_APART void hystgen_operator_move(hystgen_operator_t *self, hystgen_play_t w) {
    const hystgen_play_t x = self->play[0];
    hystgen_sum_t sum = (hystgen_sum_t)hystgen_model_tables.weight[0] * w;
    unsigned int i;
#ifdef HYSTGEN_HAS_ELEMENTS
    (void)hystgen_operator_elements(self, w);
    hystgen_operator_approach(self, w);
    sum += hystgen_operator_joined(self, w);
#endif
    HYSTGEN_ROLLED
    for (i = 1; i <= HYSTGEN_N_PLAYS; ++i) {
        if (self->moving) {
            (void)hystgen_move(i, self->play, x, w);
        } else {
            hystgen_put(i, self->play, hystgen_resting(i, self->play, w));
        }
        sum += (hystgen_sum_t)hystgen_model_tables.weight[i] * hystgen_bent(i, self->play[i]);
    }
    self->play[0] = w;
    self->level = hystgen_level(sum);
}

/* The plays follow their input w, or come to rest there, and a search begins anew. Updates their
   sum. */
static void hystgen_operator_follow(hystgen_operator_t *self, hystgen_play_t w) {
#ifdef HYSTGEN_INVERSE
    self->search.rate = self->moving ? self->search.rate : HYSTGEN_FASTEST;
#endif
    hystgen_operator_move(self, w);
#ifdef HYSTGEN_HAS_RELAXING_PLAYS
    if (self->moving) {
        hystgen_relax(self->play, NULL);
    }
#endif
}
#else
/* Contribution of play i at its present place. */
static inline hystgen_sum_t hystgen_staying(unsigned int i, const hystgen_play_t *play,
                                            const hystgen_sum_t *bent) {
#ifdef HYSTGEN_HAS_BENT_PLAYS
    (void)play;
    return bent[i - 1u];
#else
    (void)bent;
    return play[i];
#endif
}

/* Adds the plays from i on, at their present places, to a sum of plays. */
HYSTGEN_APART hystgen_sum_t hystgen_with_staying(unsigned int i, const hystgen_play_t *play,
                                                 const hystgen_sum_t *bent, hystgen_sum_t sum) {
    HYSTGEN_ROLLED
    for (; i <= HYSTGEN_N_PLAYS; ++i) {
        sum = sum + hystgen_model_tables.weight[i] * hystgen_staying(i, play, bent);
    }
    return sum;
}

/* The plays move while their input moves to w. */
static void hystgen_moved_on(hystgen_play_t *play, hystgen_sum_t *bent, hystgen_play_t w) {
    unsigned int i;
    HYSTGEN_ROLLED
#ifdef HYSTGEN_HAS_ORDERED_PLAYS
    for (i = 1; i <= HYSTGEN_N_PLAYS && hystgen_move(i, play, play[0], w); ++i) {
        hystgen_bent_anew(i, play[i], bent);
    }
#else
    for (i = 1; i <= HYSTGEN_N_PLAYS; ++i) {
        if (hystgen_move(i, play, play[0], w)) {
            hystgen_bent_anew(i, play[i], bent);
        }
    }
#endif
    play[0] = w;
}

/* The same. Returns their sum. */
HYSTGEN_APART hystgen_sum_t hystgen_moved_follow(hystgen_play_t *play, hystgen_sum_t *bent,
                                                 hystgen_play_t w) {
    hystgen_sum_t sum = (hystgen_sum_t)hystgen_model_tables.weight[0] * w;
#ifdef HYSTGEN_HAS_ORDERED_PLAYS
    hystgen_moved_on(play, bent, w);
    sum = hystgen_with_staying(1, play, bent, sum);
#else
    unsigned int i;
    HYSTGEN_ROLLED
    for (i = 1; i <= HYSTGEN_N_PLAYS; ++i) {
        if (hystgen_move(i, play, play[0], w)) {
            hystgen_bent_anew(i, play[i], bent);
        }
        sum = sum + hystgen_model_tables.weight[i] * hystgen_staying(i, play, bent);
    }
    play[0] = w;
#endif
    return sum;
}

/* The plays come to rest with their input at w. Returns their sum. */
HYSTGEN_APART hystgen_sum_t hystgen_moved_rest(hystgen_play_t *play, hystgen_sum_t *bent,
                                               hystgen_play_t w) {
    unsigned int i;
    HYSTGEN_ROLLED
    for (i = 1; i <= HYSTGEN_N_PLAYS; ++i) {
        hystgen_put(i, play, hystgen_resting(i, play, w));
        hystgen_bent_anew(i, play[i], bent);
    }
    play[0] = w;
    return hystgen_with_staying(1, play, bent, (hystgen_sum_t)hystgen_model_tables.weight[0] * w);
}

/* Contributions of the plays, if they are bent. */
static inline hystgen_sum_t *hystgen_operator_bent(hystgen_operator_t *self) {
#ifdef HYSTGEN_HAS_BENT_PLAYS
    return self->bent;
#else
    (void)self;
    return NULL;
#endif
}

#ifdef HYSTGEN_HAS_ELEMENTS
/* Plays and elements move while their input moves to w. Updates their sum, unless a search has just
   led there. */
static void hystgen_operator_join(hystgen_operator_t *self, hystgen_sum_t *bent, hystgen_play_t w) {
    hystgen_sum_t slope;
#ifdef HYSTGEN_INVERSE
    const bool turned = hystgen_operator_elements(self, w);
    const bool known = !(turned || w < self->found || w > self->found);
    self->found = HYSTGEN_LARGEST_INPUT;
    hystgen_moved_on(self->play, bent, w);
    if (known) {
        self->level = self->asked;
        return;
    }
#else
    (void)hystgen_operator_elements(self, w);
    hystgen_moved_on(self->play, bent, w);
#endif
    self->level = hystgen_with_staying(1, self->play, bent, hystgen_model_tables.weight[0] * w);
    self->level = self->level + hystgen_operator_joined(self, w, &slope);
}
#endif

/* The plays follow their input w, or come to rest there, and a search begins anew. Updates their
   sum. */
static void hystgen_operator_follow(hystgen_operator_t *self, hystgen_play_t w) {
    hystgen_sum_t *bent = hystgen_operator_bent(self);
    if (self->moving) {
#ifdef HYSTGEN_HAS_ELEMENTS
        hystgen_operator_join(self, bent, w);
#else
        self->level = hystgen_level(hystgen_moved_follow(self->play, bent, w));
#endif
#ifdef HYSTGEN_HAS_RELAXING_PLAYS
        hystgen_relax(self->play, bent);
#endif
    } else {
#ifdef HYSTGEN_HAS_ELEMENTS
        (void)hystgen_operator_elements(self, w);
#ifdef HYSTGEN_INVERSE
        self->found = HYSTGEN_LARGEST_INPUT;
#endif
#endif
#ifdef HYSTGEN_INVERSE
        self->search.slope = hystgen_model_tables.weight[0];
#endif
        self->level = hystgen_level(hystgen_moved_rest(self->play, bent, w));
    }
}
#endif

/* Sum of the plays in the start memory, at rest. */
static hystgen_signal_t hystgen_operator_started(hystgen_operator_t *self) {
    hystgen_operator_follow(self, self->play[0]);
    return self->level;
}

#endif
