/* Operators of a model with effects: plays moved or bent by an effect. The state of play i is the
   value at which the play would come to rest (`play`) and its contribution at this value (`bent`).
   Called by chain.c and moving_search.c. */
#ifndef HYSTGEN_CHAIN_MOVING_PLAYS_C
#define HYSTGEN_CHAIN_MOVING_PLAYS_C
#include "compensator/chain/model.h"
#include "compensator/chain/signals.c"
#define HYSTGEN_ASKS_MOVES
#include "effects/catalogue.h"

/* Play i after the input of the plays has moved from x to w. Not inlined where that needs less
   stack. */
#ifdef HYSTGEN_HAS_MOVES_APART
HYSTGEN_APART
#else
static inline
#endif
hystgen_play_t hystgen_reached(unsigned int i, const hystgen_play_t *play, hystgen_play_t x,
                               hystgen_play_t w) {
    return hystgen_moved(i, play, x, w);
}

/* Play i at rest with its input at w. */
static hystgen_play_t hystgen_resting(unsigned int i, const hystgen_play_t *play,
                                      hystgen_play_t w) {
    return hystgen_drawn(play[i], w, hystgen_model_tables.threshold[i]);
}

#ifndef HYSTGEN_HAS_DASHPOT_PLAYS
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

/* Contribution of play i where it is. */
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

/* A sum of plays, with those from play i on where they are. */
HYSTGEN_APART hystgen_sum_t hystgen_with_staying(unsigned int i, const hystgen_play_t *play,
                                              const hystgen_sum_t *bent, hystgen_sum_t sum) {
    HYSTGEN_ROLLED
    for (; i <= HYSTGEN_N_PLAYS; ++i) {
        sum = sum + hystgen_model_tables.weight[i] * hystgen_staying(i, play, bent);
    }
    return sum;
}

/* The plays move while their input moves to w. Returns their sum. */
HYSTGEN_APART hystgen_sum_t hystgen_moved_follow(hystgen_play_t *play, hystgen_sum_t *bent,
                                                 hystgen_play_t w) {
    hystgen_sum_t sum = (hystgen_sum_t)hystgen_model_tables.weight[0] * w;
    unsigned int i;
    HYSTGEN_ROLLED
#ifdef HYSTGEN_HAS_ORDERED_PLAYS
    for (i = 1; i <= HYSTGEN_N_PLAYS && hystgen_move(i, play, play[0], w); ++i) {
        (void)hystgen_bent_anew(i, play[i], bent);
    }
    sum = hystgen_with_staying(1, play, bent, sum);
#else
    for (i = 1; i <= HYSTGEN_N_PLAYS; ++i) {
        if (hystgen_move(i, play, play[0], w)) {
            (void)hystgen_bent_anew(i, play[i], bent);
        }
        sum = sum + hystgen_model_tables.weight[i] * hystgen_staying(i, play, bent);
    }
#endif
    play[0] = w;
    return sum;
}

/* The plays come to rest with their input at w. Returns their sum. */
HYSTGEN_APART hystgen_sum_t hystgen_moved_rest(hystgen_play_t *play, hystgen_sum_t *bent,
                                               hystgen_play_t w) {
    unsigned int i;
    HYSTGEN_ROLLED
    for (i = 1; i <= HYSTGEN_N_PLAYS; ++i) {
        hystgen_put(i, play, hystgen_resting(i, play, w));
        (void)hystgen_bent_anew(i, play[i], bent);
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

/* The plays come to rest with their input at w, and a search begins anew. Updates their sum. */
static void hystgen_operator_settle_plays(hystgen_operator_t *self, hystgen_play_t w) {
#ifdef HYSTGEN_INVERSE
    self->search.slope = hystgen_model_tables.weight[0];
#endif
    self->level = hystgen_level(hystgen_moved_rest(self->play, hystgen_operator_bent(self), w));
}

/* The plays follow their input w. Updates their sum. */
static void hystgen_operator_follow(hystgen_operator_t *self, hystgen_play_t w) {
    if (self->moving) {
        hystgen_sum_t *bent = hystgen_operator_bent(self);
        self->level = hystgen_level(hystgen_moved_follow(self->play, bent, w));
        hystgen_relax(self->play, bent);
    } else {
        hystgen_operator_settle_plays(self, w);
    }
}

/* Sum of the plays in the start memory. */
static hystgen_signal_t hystgen_operator_started(hystgen_operator_t *self) {
    hystgen_operator_settle_plays(self, self->play[0]);
    return self->level;
}

#if defined(HYSTGEN_INVERSE) && defined(HYSTGEN_FIXED)
/* Contribution of play i at z. */
static inline hystgen_sum_t hystgen_contributed(unsigned int i, const hystgen_play_t *play,
                                                const hystgen_sum_t *bent, hystgen_play_t z) {
    return z >= play[i] && z <= play[i] ? hystgen_staying(i, play, bent) : hystgen_bent(i, z);
}

/* Sum of the plays after their input has moved to w, or at rest at w; increases with w. */
HYSTGEN_APART hystgen_sum_t hystgen_inverse_sum(hystgen_inverse_t *self, hystgen_play_t w) {
    hystgen_sum_t sum = (hystgen_sum_t)hystgen_model_tables.weight[0] * w;
    unsigned int i;
    if (self->moving) {
        for (i = 1; i <= HYSTGEN_N_PLAYS; ++i) {
            const hystgen_sum_t value =
                hystgen_contributed(i, self->play, hystgen_operator_bent(self),
                                    hystgen_reached(i, self->play, self->play[0], w));
            sum = sum + hystgen_model_tables.weight[i] * value;
        }
        return sum;
    }
    HYSTGEN_ROLLED
    for (i = 1; i <= HYSTGEN_N_PLAYS; ++i) {
        const hystgen_play_t z = hystgen_resting(i, self->play, w);
        const hystgen_sum_t value =
            hystgen_contributed(i, self->play, hystgen_operator_bent(self), z);
        sum = sum + hystgen_model_tables.weight[i] * value;
    }
    return sum;
}
#endif

#endif
