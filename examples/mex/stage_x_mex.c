/* SPDX-License-Identifier: 0BSD
 * The emitted C of stage_x as a function of MATLAB and Octave. Instances stay between calls.
 *
 *     axis = stage_x_mex('inverse')       a new instance: 'inverse' or 'forward'
 *     v = stage_x_mex('step', axis, u)    one step for each element of u
 *     s = stage_x_mex('status', axis)     status bits, read and cleared
 *     stage_x_mex('reset', axis, u)       all plays at 0, then one step to u
 *     stage_x_mex('free', axis)           releases the instance
 *
 * For another model, replace stage_x; for float32, drive and reference are rounded to float in `stepped`.
 */
#include <mex.h>
#include <string.h>

#include "stage_x.h"

#define MOST 64 /* instances at a time */

typedef enum { FREE, INVERSE, FORWARD } role_t;

static struct {
    role_t role;
    stage_x_inverse_t inverse;
    stage_x_forward_t forward;
} axes[MOST];

static double stepped(int k, double x) {
    return axes[k].role == INVERSE ? (double)stage_x_inverse_step(&axes[k].inverse, (stage_x_real_t)x)
                                   : (double)stage_x_forward_step(&axes[k].forward, (stage_x_real_t)x);
}

/* Index of a new instance */
static int created(role_t role) {
    for (int k = 0; k < MOST; k++) {
        if (axes[k].role == FREE) {
            axes[k].role = role;
            stage_x_inverse_init(&axes[k].inverse);
            stage_x_forward_init(&axes[k].forward);
            return k;
        }
    }
    mexErrMsgIdAndTxt("stage_x:full", "%d instances are in use; free one", MOST);
    return -1;
}

/* Index of the instance that an argument names */
static int named(const mxArray *handle) {
    if (!mxIsDouble(handle) || mxIsComplex(handle) || mxGetNumberOfElements(handle) != 1) {
        mexErrMsgIdAndTxt("stage_x:handle", "the second argument is the instance that stage_x_mex returned");
    }
    const double number = mxGetScalar(handle);
    const int k = number >= 1.0 && number <= MOST ? (int)number - 1 : -1;
    if (k < 0 || (double)(k + 1) != number || axes[k].role == FREE) {
        mexErrMsgIdAndTxt("stage_x:handle", "there is no such instance");
    }
    return k;
}

void mexFunction(int answers, mxArray *answer[], int given, const mxArray *argument[]) {
    char word[16];
    (void)answers;
    if (given < 1 || mxGetString(argument[0], word, sizeof word) != 0) {
        mexErrMsgIdAndTxt("stage_x:call", "start with 'inverse', 'forward', 'step', 'status', 'reset' or 'free'");
    }
    if (given == 1 && (strcmp(word, "inverse") == 0 || strcmp(word, "forward") == 0)) {
        answer[0] = mxCreateDoubleScalar(created(word[0] == 'i' ? INVERSE : FORWARD) + 1);
        return;
    }
    const int with_signal = strcmp(word, "step") == 0 || strcmp(word, "reset") == 0;
    if (given != (with_signal ? 3 : 2)) {
        mexErrMsgIdAndTxt("stage_x:call", "unknown call, or the wrong number of arguments");
    }
    const int k = named(argument[1]);
    if (with_signal && (!mxIsDouble(argument[2]) || mxIsComplex(argument[2]))) {
        mexErrMsgIdAndTxt("stage_x:signal", "the signal is an array of real doubles");
    }
    if (strcmp(word, "step") == 0) {
        const double *x = mxGetPr(argument[2]);
        const size_t count = mxGetNumberOfElements(argument[2]);
        answer[0] = mxCreateDoubleMatrix(mxGetM(argument[2]), mxGetN(argument[2]), mxREAL);
        double *y = mxGetPr(answer[0]);
        for (size_t i = 0; i < count; i++) {
            y[i] = stepped(k, x[i]);
        }
    } else if (strcmp(word, "reset") == 0) {
        if (mxGetNumberOfElements(argument[2]) != 1) {
            mexErrMsgIdAndTxt("stage_x:signal", "reset takes one number");
        }
        const stage_x_real_t x = (stage_x_real_t)mxGetScalar(argument[2]);
        if (axes[k].role == INVERSE) {
            stage_x_inverse_reset(&axes[k].inverse, x);
        } else {
            stage_x_forward_reset(&axes[k].forward, x);
        }
    } else if (strcmp(word, "status") == 0) {
        const unsigned int bits = axes[k].role == INVERSE ? stage_x_inverse_status(&axes[k].inverse)
                                                          : stage_x_forward_status(&axes[k].forward);
        answer[0] = mxCreateDoubleScalar(bits);
    } else if (strcmp(word, "free") == 0) {
        axes[k].role = FREE;
    } else {
        mexErrMsgIdAndTxt("stage_x:call", "start with 'inverse', 'forward', 'step', 'status', 'reset' or 'free'");
    }
}
