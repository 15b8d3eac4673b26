/* What the oracle and the emitted modules under test agree on: numbers pass as double, which holds every float and
   every code exactly. */
#ifndef ORACLE_H
#define ORACLE_H

#include <stddef.h>

enum { ORACLE_F32, ORACLE_F64, ORACLE_FIXED };

/* An emitted module as a C compiler sees it: its macros and its functions. */
typedef struct {
    int kind;
    double drive_min, drive_max, output_min, output_max; /* values of NAME_real_t */
    double drive_lsb, output_lsb;                        /* 1 for float */
    double forward_bound, inverse_bound, rounding_bound; /* as the header states them */
    size_t forward_size, inverse_size;                   /* 0: not emitted */
    void (*forward_init)(void *);
    void (*forward_reset)(void *, double);
    double (*forward_step)(void *, double);
    unsigned (*forward_status)(void *);
    void (*inverse_init)(void *);
    void (*inverse_reset)(void *, double);
    double (*inverse_step)(void *, double);
    void (*inverse_commit)(void *, double);
    unsigned (*inverse_status)(void *);
} oracle_probe_t;

/* One stage of the memoryless part: dead zone (thresholds, weights) or tanh (a0 .. a3 ascending, then descending). */
typedef struct {
    int count; /* 0: tanh */
    const double *threshold, *weight;
    double a[8];
} oracle_stage_t;

/* The numbers of a parameter file. */
typedef struct {
    int n;
    const double *threshold, *weight; /* n + 1 each */
    int listed;                       /* whether `start` has n + 1 numbers, else one */
    const double *start;
    int stages;
    const oracle_stage_t *stage;
    double offset, low, high;
} oracle_model_t;

enum { ORACLE_INIT, ORACLE_RESET, ORACLE_STEP, ORACLE_COMMIT };

/* One call of a run, for reproduction. */
typedef struct {
    int call;
    double x, answer;
} oracle_call_t;

/* What a run has found. Ratios are errors over stated bounds. */
typedef struct {
    long samples;
    long over_forward, over_single, over_own, wrong; /* `wrong`: status bits, ranges, macros */
    double worst_forward, worst_single, worst_own;
    double worst_same_branch; /* of the inverse with two branches, over the bound for the same branch */
    long over_same_branch;
    long first; /* call of the first fault, -1 without one */
    char message[400];
} oracle_result_t;

#endif
