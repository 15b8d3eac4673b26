/* Two axes of a scanner at 20 kHz: the code of a reference comes in, the code of a drive goes out. Three scans are made,
   each with another compensator, and the tracking errors are compared. */
#include "board.h"
#include "stage.h"

#include "axis_x.h"
#include "axis_x_selftest.h"
#include "axis_y.h"
#include "axis_y_selftest.h"
#include "plays_x.h"
#include "plays_y.h"

#define APPROACH 2000 /* samples on the way to the scan's first corner, which are not judged */
#define SAMPLES 9000  /* and seven lines of the fast axis, 0.45 s in all */
#define LINE 1000     /* samples of a line, back and forth */
#define START 2294    /* code of 0.7 um, about where the stages stand at 0 V */
#define CORNER 13107  /* code of 4 um */
#define LIMITED (AXIS_X_STATUS_INPUT_CLAMPED | AXIS_X_STATUS_OUTPUT_CLAMPED)

enum { LINEAR, PLAYS, WHOLE, WAYS };

/* The plant, with a stage for each axis. */
static stage_t stage[2];

static axis_x_inverse_t x;
static axis_y_inverse_t y;
static plays_x_inverse_t plays_x;
static plays_y_inverse_t plays_y;

static volatile int way;     /* which compensator is on */
static volatile int sample = SAMPLES; /* of the scan */
static volatile unsigned int seen; /* status bits of both axes */
static float sum[2];         /* of errors, um, */
static float square[2];      /* and of their squares, um^2 */
static float position[2];    /* um, after the last sample */

/* The ADC: codes of 16 bits for 0 .. 20 um. The fast axis goes back and forth, the slow one along. */
static int32_t adc(int axis, int at) {
    const int scanned = at - APPROACH;
    if (scanned < 0) {
        return START + (int32_t)(CORNER - START) * at / APPROACH;
    }
    if (axis == 0) {
        const int part = scanned % LINE;
        return CORNER + 52 * (part < LINE / 2 ? part : LINE - part); /* 16 nm a sample */
    }
    return CORNER + 3 * scanned;
}

/* The DAC: codes of 16 bits for -10 .. 110 V. */
static float dac(int32_t code) {
    return (float)code * (120.0f / 65535.0f) - 10.0f;
}

static int32_t linear(int32_t reference) { /* the straight line through the ends: 16.7 um in 100 V */
    const float drive = (float)reference * (20.0f / 65535.0f) * (100.0f / 16.7f);
    return (int32_t)((drive + 10.0f) * (65535.0f / 120.0f) + 0.5f);
}

/* The control interrupt. Everything from the ADC to the DAC is one call per axis. */
static void control(void) {
    const int at = sample;
    int axis;
    if (at >= SAMPLES) { /* the scan is over */
        return;
    }
    for (axis = 0; axis < 2; ++axis) {
        const int32_t reference = adc(axis, at);
        int32_t drive = linear(reference);
        float error;
        if (way == PLAYS) {
            drive = axis == 0 ? plays_x_inverse_step_code(&plays_x, reference)
                              : plays_y_inverse_step_code(&plays_y, reference);
        } else if (way == WHOLE) {
            drive = axis == 0 ? axis_x_inverse_step_code(&x, reference) : axis_y_inverse_step_code(&y, reference);
            seen |= axis == 0 ? axis_x_inverse_status(&x) : axis_y_inverse_status(&y);
        }
        /* what the stage has reached by the time of this sample belongs to this reference */
        error = position[axis] - (float)adc(axis, at) * (20.0f / 65535.0f);
        position[axis] = stage_step(&stage[axis], dac(drive));
        if (at >= APPROACH) {
            sum[axis] += error;
            square[axis] += error * error;
        }
    }
    ++sample;
}

static float root(float a) { /* Newton's method from above */
    float r = a > 1.0f ? a : 1.0f;
    int i;
    for (i = 0; i < 40; ++i) {
        r = 0.5f * (r + a / r);
    }
    return r;
}

static void print_nm(float um) {
    char text[12];
    uint32_t nm = (uint32_t)(1000.0f * um + 0.5f);
    int at = 11;
    text[at] = '\0';
    do {
        text[--at] = (char)('0' + nm % 10u);
        nm /= 10u;
    } while (nm > 0u);
    while (at > 5) {
        text[--at] = ' ';
    }
    board_print(text + at);
}

int main(void) {
    static const char *const name[WAYS] = {"linear scale   ", "plain plays    ", "plays, creep.. "};
    float rms[WAYS]; /* of both axes together */
    int axis;
    if (axis_x_selftest() != 0 || axis_y_selftest() != 0) {
        board_print("self-test: the C does not compute here what it computed when it was made\n");
        return 1;
    }
    board_print("rms error, nm     x     y\n");
    for (way = LINEAR; way < WAYS; ++way) {
        float all = 0.0f;
        stage_init(&stage[0], 1u);
        stage_init(&stage[1], 1000u);
        axis_x_inverse_init(&x);
        axis_y_inverse_init(&y);
        plays_x_inverse_init(&plays_x);
        plays_y_inverse_init(&plays_y);
        for (axis = 0; axis < 2; ++axis) {
            sum[axis] = 0.0f;
            square[axis] = 0.0f;
            position[axis] = stage_step(&stage[axis], 0.0f);
        }
        sample = 0;
        board_start(control); /* the last thing: from here on, the interrupt owns these variables */
        while (sample < SAMPLES) {
            board_wait();
        }
        board_print(name[way]);
        for (axis = 0; axis < 2; ++axis) {
            const float mean = sum[axis] / (float)(SAMPLES - APPROACH); /* an image has no origin */
            const float variance = square[axis] / (float)(SAMPLES - APPROACH) - mean * mean;
            print_nm(root(variance));
            all += variance;
        }
        rms[way] = root(all);
        board_print("\n");
    }
    if (board_late()) {
        board_print("a control step took longer than its period\n");
        return 1;
    }
    if (seen & LIMITED) {
        board_print("a reference or a drive was limited\n");
        return 1;
    }
    if (rms[WHOLE] > 0.2f * rms[LINEAR] || rms[WHOLE] > 0.5f * rms[PLAYS]) {
        board_print("the compensators do not help as they should\n");
        return 1;
    }
    return 0;
}
