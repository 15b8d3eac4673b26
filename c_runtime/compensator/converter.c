/* Codes of converters, over which a quantity is a straight line. Called by users. */
#ifndef HYSTGEN_CONVERTER_C
#define HYSTGEN_CONVERTER_C
#include "compensator/model.h"
#include "compensator/clamp.c"
#ifndef HYSTGEN_CONFIGURED
#include "compensator/api.h"
#endif

/* The nearest of a converter's codes. */
static int32_t hystgen_nearest_code(int32_t code, int32_t least, int32_t most) {
    const int32_t above = code < least ? least : code;
    return above > most ? most : above;
}

#ifdef HYSTGEN_FIXED
/* A quantity as a code of the model; `sum` has `bits` fraction bits. */
static hystgen_real_t hystgen_converted(int64_t sum, unsigned int bits) {
    const int64_t code = hystgen_nearest(sum, bits);
    const int64_t above = code < -HYSTGEN_CODE_MAX ? -HYSTGEN_CODE_MAX : code;
    return (hystgen_real_t)(above > HYSTGEN_CODE_MAX ? HYSTGEN_CODE_MAX : above);
}

hystgen_real_t hystgen_reference_from_code(int32_t code) {
    const int64_t inside =
        hystgen_nearest_code(code, HYSTGEN_REFERENCE_CODE_MIN, HYSTGEN_REFERENCE_CODE_MAX);
    return hystgen_converted(HYSTGEN_REFERENCE_AT_ZERO + inside * HYSTGEN_REFERENCE_STEP,
                             HYSTGEN_REFERENCE_BITS);
}

hystgen_real_t hystgen_drive_from_code(int32_t code) {
    const int64_t inside =
        hystgen_nearest_code(code, HYSTGEN_DRIVE_CODE_MIN, HYSTGEN_DRIVE_CODE_MAX);
    return hystgen_converted(HYSTGEN_DRIVE_AT_ZERO + inside * HYSTGEN_DRIVE_STEP,
                             HYSTGEN_DRIVE_STEP_BITS);
}

int32_t hystgen_code_from_drive(hystgen_real_t drive) {
    const int64_t code = hystgen_nearest(HYSTGEN_CODE_AT_ZERO + (int64_t)drive * HYSTGEN_CODE_STEP,
                                         HYSTGEN_CODE_STEP_BITS);
    if (code < HYSTGEN_DRIVE_CODE_MIN) {
        return HYSTGEN_DRIVE_CODE_MIN;
    }
    return code > HYSTGEN_DRIVE_CODE_MAX ? HYSTGEN_DRIVE_CODE_MAX : (int32_t)code;
}
#else
hystgen_real_t hystgen_reference_from_code(int32_t code) {
    const int32_t inside =
        hystgen_nearest_code(code, HYSTGEN_REFERENCE_CODE_MIN, HYSTGEN_REFERENCE_CODE_MAX);
    return HYSTGEN_REFERENCE_AT_ZERO + (hystgen_real_t)inside * HYSTGEN_REFERENCE_STEP;
}

hystgen_real_t hystgen_drive_from_code(int32_t code) {
    const int32_t inside =
        hystgen_nearest_code(code, HYSTGEN_DRIVE_CODE_MIN, HYSTGEN_DRIVE_CODE_MAX);
    return HYSTGEN_DRIVE_AT_ZERO + (hystgen_real_t)inside * HYSTGEN_DRIVE_STEP;
}

int32_t hystgen_code_from_drive(hystgen_real_t drive) {
    const hystgen_real_t code = (drive - HYSTGEN_DRIVE_AT_ZERO) * HYSTGEN_CODE_STEP;
    if (!(code > (hystgen_real_t)HYSTGEN_DRIVE_CODE_MIN)) { /* NaN too */
        return HYSTGEN_DRIVE_CODE_MIN;
    }
    if (code >= (hystgen_real_t)HYSTGEN_DRIVE_CODE_MAX) {
        return HYSTGEN_DRIVE_CODE_MAX;
    }
    const int32_t whole = (int32_t)code;
    const hystgen_real_t part = code - (hystgen_real_t)whole;
    if (part + part < -1) {
        return whole - 1;
    }
    return part + part < 1 ? whole : whole + 1;
}
#endif

#ifndef HYSTGEN_FORWARD
int32_t hystgen_inverse_step_code(hystgen_inverse_t *self, int32_t code) {
    const hystgen_real_t drive = hystgen_operator_step(self, hystgen_reference_from_code(code));
    const int32_t sent = hystgen_code_from_drive(drive);
    hystgen_inverse_commit(self, hystgen_clamp_drive(hystgen_drive_from_code(sent)));
    return sent;
}
#endif

#endif
