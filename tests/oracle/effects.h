/* What the oracle of models with effects and the emitted modules under test agree on. Numbers pass as double, which
   holds every float and every code exactly. */
#ifndef ORACLE_EFFECTS_H
#define ORACLE_EFFECTS_H

#include <stddef.h>

enum { EFFECTS_F32, EFFECTS_F64, EFFECTS_FIXED };

/* An emitted module as a C compiler sees it: its macros and its functions; those that it lacks are 0. */
typedef struct {
    int kind;
    double drive_min, drive_max, output_min, output_max; /* values of NAME_real_t */
    double drive_lsb, output_lsb;                        /* 1 for float */
    double fastest;                                      /* drive, input units per s */
    double forward_bound, inverse_bound, rounding_bound; /* as the header states them */
    size_t forward_size, inverse_size;
    void (*forward_init)(void *);
    double (*forward_step)(void *, double);
    void (*forward_temperature)(void *, double);
    void (*inverse_init)(void *);
    double (*inverse_step)(void *, double);
    void (*inverse_push)(void *, double);
    void (*inverse_commit)(void *, double);
    void (*inverse_settle)(void *, double);
    void (*inverse_temperature)(void *, double);
    unsigned (*inverse_status)(void *);
} effects_probe_t;

enum { AGES_NOT, AGES_LOGARITHMIC, AGES_EXPONENTIAL };
enum { SATURATES_NOT, SATURATES_TANH, SATURATES_HARD };

/* The numbers of a parameter file; an effect whose numbers are 0 is absent. */
typedef struct {
    int n;
    const double *threshold, *weight; /* n + 1 each */
    double start, low, high, offset, seconds;
    double rising, falling; /* input units per s */
    int creeps;
    const double *time_constant, *share;
    int ages;
    double loss, travel;
    double gain_per_degree, offset_per_degree, reference;
    int saturates;
    double level, centre;
    double drift; /* output units per s */
    double delay; /* s */
    double lag;   /* s */
    int elements; /* Bouc-Wen elements in parallel with the plays */
    const double *part, *width;
    double exponent, balance; /* an exponent of 1 or 2 */
    const double *tilt;       /* of the drive, with an exponent and a balance of 1; NULL without */
} effects_model_t;

enum { EFFECTS_STEP, EFFECTS_HELD, EFFECTS_COMMIT, EFFECTS_SETTLE, EFFECTS_TEMPERATURE, EFFECTS_PUSH };

/* One call, with a reference, drive or temperature in physical units. */
typedef struct {
    int call;
    double x;
} effects_call_t;

/* What a run has found. Ratios are errors over what is allowed. */
typedef struct {
    long samples, limited, faults;
    double worst_forward; /* against the exact chain */
    double worst_seen;    /* of the inverse, with the memory of what was applied, over the bound of its rounding */
    double worst_own;     /* with a memory of its own, over the bound of the inverse */
    double worst_ahead;   /* of an amplifier at its limit, over a last bit of the drive's range or a code */
    long first;           /* call of the first fault, -1 without one */
    char message[400];
} effects_result_t;

#endif
