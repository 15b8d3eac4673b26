/* Calls for users whose references come from a converter and whose drives go to one. */
#include "compensator/model.h"
#ifndef HYSTGEN_CONVERTER_H
#define HYSTGEN_CONVERTER_H

/* The reference that a code of the reference's converter stands for. */
hystgen_real_t hystgen_reference_from_code(int32_t code);
/* The drive that a code of the drive's converter makes. */
hystgen_real_t hystgen_drive_from_code(int32_t code);
/* The code whose drive is nearest to this one, among those of the drive's converter. */
int32_t hystgen_code_from_drive(hystgen_real_t drive);
#ifndef HYSTGEN_FORWARD
/* One sample: code of a reference in, code of a drive out. Commits the drive that this code
   makes. Cannot fail. */
int32_t hystgen_inverse_step_code(hystgen_inverse_t *self, int32_t code);
#endif

#endif
