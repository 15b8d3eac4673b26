/* Operators of a model with effects: plays moved or bent by an effect. The state of play i is the
   value at which the play would come to rest (`play`). In floating point, its contribution there is
   kept (`bent`). Called by chain.c and moving_search.c. */
#ifndef HYSTGEN_CHAIN_MOVING_PLAYS_C
#define HYSTGEN_CHAIN_MOVING_PLAYS_C
#include "compensator/chain/model.h"
#include "compensator/chain/signals.c"
#define HYSTGEN_ASKS_MOVES
#include "effects/catalogue.h"

/* Play i at rest with its input at w. */
static hystgen_play_t hystgen_resting(unsigned int i, const hystgen_play_t *play,
                                      hystgen_play_t w) {
    return hystgen_drawn(play[i], w, hystgen_model_tables.threshold[i]);
}

#ifndef HYSTGEN_HAS_DASHPOT_PLAYS
/* Play i moves while the input of the plays moves from x to w. */
#if defined(HYSTGEN_HAS_BUMP) && !defined(HYSTGEN_FIXED)
HYSTGEN_APART void hystgen_move(unsigned int i, hystgen_play_t *play, hystgen_play_t x,
                                hystgen_play_t w) {
#else
static void hystgen_move(unsigned int i, hystgen_play_t *play, hystgen_play_t x, hystgen_play_t w) {
#endif
    play[i] = hystgen_moved(i, play, x, w);
}

/* Play i rests at z. */
static void hystgen_put(unsigned int i, hystgen_play_t *play, hystgen_play_t z) {
    play[i] = z;
}
#endif

#if defined(HYSTGEN_FIXED) && defined(HYSTGEN_HAS_PLAIN_PLAYS)
/* Plays that are bent but move with their input alone leave their places in the order of their
   thresholds. The contributions of those that stay are kept as a sum (`staying`). Takes those that
   leave for w out of it. */
HYSTGEN_APART void hystgen_operator_release(hystgen_operator_t *self, hystgen_play_t w) {
    unsigned int i;
    HYSTGEN_ROLLED
    for (i = self->released + 1u; i <= HYSTGEN_N_PLAYS; ++i) {
        if (hystgen_resting(i, self->play, w) == self->play[i]) {
            break;
        }
        self->staying -= hystgen_model_tables.weight[i] * hystgen_bent(i, self->play[i]);
        self->released = i;
    }
}

/* Sum of the plays after their input has moved to w, for which those that leave are released;
   increases with w. */
HYSTGEN_APART hystgen_sum_t hystgen_operator_sum(const hystgen_operator_t *self, hystgen_play_t w) {
    hystgen_sum_t sum = (hystgen_sum_t)hystgen_model_tables.weight[0] * w + self->staying;
    unsigned int i;
    HYSTGEN_ROLLED
    for (i = 1; i <= self->released; ++i) {
        sum += hystgen_model_tables.weight[i] *
               hystgen_bent(i, hystgen_resting(i, self->play, w));
    }
    return sum;
}

/* The plays move while their input moves to w, where their sum is `sum`. All of them stay once the
   last one that has moved does. */
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
    if (!self->moving || w != self->search.input) {
        hystgen_operator_release(self, w);
        self->search.input = w;
        self->search.found = hystgen_operator_sum(self, w);
    }
    self->search.rate = self->moving ? self->search.rate : INT32_MAX;
    hystgen_operator_move(self, w, self->search.found);
#else
    hystgen_operator_release(self, w);
    hystgen_operator_move(self, w, hystgen_operator_sum(self, w));
#endif
}
#elif defined(HYSTGEN_FIXED)
/* Sum of the plays after their input has moved to w, or at rest at w; increases with w. */
HYSTGEN_APART hystgen_sum_t hystgen_operator_sum(const hystgen_operator_t *self, hystgen_play_t w) {
    hystgen_sum_t sum = (hystgen_sum_t)hystgen_model_tables.weight[0] * w;
    unsigned int i;
#ifdef HYSTGEN_HAS_DILATED_PLAYS
    if (self->moving && w != self->play[0]) { /* thresholds do not grow with no move */
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
    HYSTGEN_ROLLED
    for (i = 1; i <= HYSTGEN_N_PLAYS; ++i) {
        if (self->moving) {
            hystgen_move(i, self->play, x, w);
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
    self->search.rate = self->moving ? self->search.rate : INT32_MAX;
#endif
    hystgen_operator_move(self, w);
#ifdef HYSTGEN_HAS_RELAXING_PLAYS
    if (self->moving) {
        hystgen_relax(self->play, NULL);
    }
#endif
}
#else
#ifdef HYSTGEN_HAS_BENT_PLAYS
/* Contribution of play i at z; `bent` holds the contribution at the play's rest value. */
static hystgen_sum_t hystgen_contributed(unsigned int i, const hystgen_play_t *play,
                                         const hystgen_sum_t *bent, hystgen_play_t z) {
    return z >= play[i] && z <= play[i] ? bent[i] : hystgen_bent(i, z);
}

/* Play i has moved from z. Updates its contribution. Returns it. */
static hystgen_sum_t hystgen_rebent(unsigned int i, const hystgen_play_t *play, hystgen_sum_t *bent,
                                    hystgen_play_t z) {
    if (play[i] < z || play[i] > z) {
        return hystgen_bent_anew(i, play[i], bent);
    }
    return bent[i];
}
#else
/* Contribution of play i at z: z itself. */
static inline hystgen_sum_t hystgen_contributed(unsigned int i, const hystgen_play_t *play,
                                                const hystgen_sum_t *bent, hystgen_play_t z) {
    (void)i;
    (void)play;
    (void)bent;
    return z;
}

/* Contribution of play i: where it is. */
static inline hystgen_sum_t hystgen_rebent(unsigned int i, const hystgen_play_t *play,
                                           hystgen_sum_t *bent, hystgen_play_t z) {
    (void)bent;
    (void)z;
    return play[i];
}
#endif

/* The plays move while their input moves to w. Returns their sum. */
HYSTGEN_APART hystgen_sum_t hystgen_moved_follow(hystgen_play_t *play, hystgen_sum_t *bent,
                                                 hystgen_play_t w) {
    hystgen_sum_t sum = (hystgen_sum_t)hystgen_model_tables.weight[0] * w;
#ifdef HYSTGEN_HAS_BENT_PLAYS
    const hystgen_play_t *from = play; /* read for each play: saved across calls, it takes stack */
#else
    const hystgen_play_t x = play[0];
    const hystgen_play_t *from = &x;
#endif
    unsigned int i;
    HYSTGEN_ROLLED
    for (i = 1; i <= HYSTGEN_N_PLAYS; ++i) {
        const hystgen_play_t before = play[i];
        hystgen_move(i, play, *from, w);
        sum = sum + hystgen_model_tables.weight[i] * hystgen_rebent(i, play, bent, before);
    }
    play[0] = w;
    return sum;
}

/* The plays come to rest with their input at w. Returns their sum. */
HYSTGEN_APART hystgen_sum_t hystgen_moved_rest(hystgen_play_t *play, hystgen_sum_t *bent,
                                               hystgen_play_t w) {
    hystgen_sum_t sum = (hystgen_sum_t)hystgen_model_tables.weight[0] * w;
    unsigned int i;
    HYSTGEN_ROLLED
    for (i = 1; i <= HYSTGEN_N_PLAYS; ++i) {
        hystgen_put(i, play, hystgen_resting(i, play, w));
        sum = sum + hystgen_model_tables.weight[i] * hystgen_bent_anew(i, play[i], bent);
    }
    play[0] = w;
    return sum;
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

/* The plays follow their input w, or come to rest there. Updates their sum. */
static void hystgen_operator_follow(hystgen_operator_t *self, hystgen_play_t w) {
    hystgen_sum_t *bent = hystgen_operator_bent(self);
    if (self->moving) {
        self->level = hystgen_level(hystgen_moved_follow(self->play, bent, w));
#ifdef HYSTGEN_HAS_RELAXING_PLAYS
        hystgen_relax(self->play, bent);
#endif
    } else {
        self->level = hystgen_level(hystgen_moved_rest(self->play, bent, w));
    }
}
#endif

/* Sum of the plays in the start memory, at rest. */
static hystgen_signal_t hystgen_operator_started(hystgen_operator_t *self) {
    hystgen_operator_follow(self, self->play[0]);
    return self->level;
}

#if defined(HYSTGEN_INVERSE) && !defined(HYSTGEN_FIXED)
#ifdef HYSTGEN_HAS_BUMP
/* Play i with its input at that of the search. Sets the play's slope. */
HYSTGEN_APART hystgen_real_t hystgen_inverse_tried(hystgen_inverse_t *self, unsigned int i) {
    const hystgen_real_t w = self->search.input;
    const hystgen_real_t z = hystgen_tried(i, self->play, w, &self->search.steep);
    return self->moving ? z : hystgen_resting(i, self->play, w);
}

/* Adds play i to the sum and the slope of a search. In memory, which needs less stack than numbers
   that are saved across a call. */
HYSTGEN_APART void hystgen_inverse_add(hystgen_inverse_t *self, unsigned int i) {
    hystgen_search_t *search = &self->search;
    const hystgen_real_t z = hystgen_inverse_tried(self, i);
    const hystgen_real_t value = hystgen_contributed(i, self->play, hystgen_operator_bent(self), z);
    search->left = search->left + hystgen_model_tables.weight[i] * value;
    search->slope = search->slope + hystgen_bent_steep(i, z, value, search->steep);
}

/* Sum of the plays after their input has moved to w, or at rest at w; increases with w. Sets the
   slope of the search to its change per change of w. */
static hystgen_real_t hystgen_inverse_sum(hystgen_inverse_t *self, hystgen_real_t w) {
    unsigned int i;
    self->search.left = hystgen_model_tables.weight[0] * w;
    self->search.slope = hystgen_model_tables.weight[0];
    HYSTGEN_ROLLED
    for (i = 1; i <= HYSTGEN_N_PLAYS; ++i) {
        hystgen_inverse_add(self, i);
    }
    return self->search.left;
}
#else
/* Sum of the plays after their input has moved to w, or at rest at w; increases with w. Sets the
   slope of the search to its change per change of w. */
static hystgen_real_t hystgen_inverse_sum(hystgen_inverse_t *self, hystgen_real_t w) {
    hystgen_real_t sum = hystgen_model_tables.weight[0] * w;
    hystgen_real_t slope = hystgen_model_tables.weight[0];
    unsigned int i;
    HYSTGEN_ROLLED
    for (i = 1; i <= HYSTGEN_N_PLAYS; ++i) {
        hystgen_real_t steep;
        hystgen_real_t z = hystgen_tried(i, self->play, w, &steep);
        if (!self->moving) {
            z = hystgen_resting(i, self->play, w);
        }
        const hystgen_real_t value =
            hystgen_contributed(i, self->play, hystgen_operator_bent(self), z);
        sum = sum + hystgen_model_tables.weight[i] * value;
        slope = slope + hystgen_bent_steep(i, z, value, steep);
    }
    self->search.slope = slope;
    return sum;
}
#endif
#endif

#endif
