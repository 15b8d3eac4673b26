"""Numbers that the bit reference shares with the C: indices into the array of limits, status bits and calls."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.jit import N, jit
from hystgen.basics.structures import Flag, NumberArray, Real, Struct, UInt32

Reals = NumberArray
Counts = NumberArray
Bytes = NDArray[np.uint8]

# indices into `limits`, the same in every arithmetic
DRIVE_MIN, DRIVE_MAX, OUTPUT_MIN, OUTPUT_MAX, OFFSET = 0, 1, 2, 3, 4
HOLD, REAL_MAX, ZERO = 7, 8, 9

CORNERS, LOOP = 0, 1
TANH, DEAD_ZONE = 0, 1

INPUT_CLAMPED, OUTPUT_CLAMPED, HELD, DOMAIN, SLEW_LIMITED, LIMITED_SETTING = 1, 2, 4, 8, 16, 32

OP_STEP, OP_COMMIT, OP_RESET, OP_INIT = 0, 1, 2, 3
# further calls of models with effects
OP_PUSH, OP_SETTLE, OP_OFFSET, OP_GAIN, OP_TEMPERATURE, OP_TRAVEL, OP_CORRECT, OP_EXPECTED, OP_TRAVELLED = range(4, 13)
# the bits that identify a call, and a bit that leaves its status for a later call to read together with its own
OP_CALL, OP_UNREAD = 127, 128
# further indices into `limits`, only in fixed point
PLAY_MIN, PLAY_MAX, MARGIN, FRACTION, FINE, CODE_MAX, SATURATED, SHY = range(10, 18)


class StepState(Struct):
    """The memory of one operator apart from its plays; each engine uses a part of it."""

    pending: Real  # drive sent but not yet part of the memory
    drive: Real  # seen last
    undo_drive: Real  # `drive` before the last step
    before: Real  # input of the plays before the last step
    returned: Real  # by the last step, if another drive has been committed since
    reference: Real  # of the last step
    last: Real  # `reference`, limited: the next reference rises or falls from here
    next: Real  # input or output at which another play begins to follow
    level: Real  # sum of the plays
    answer: Real  # returned last
    ascending: Flag  # direction of the drive's last move
    undo_ascending: Flag
    has_pending: Flag
    stepped: Flag  # a step has answered
    committed: Flag  # a drive has been committed since
    repeated: Flag  # the last answer is still valid for `reference`
    usual: Flag  # in the last step the same plays followed
    sought: Flag  # a solution has been found since the plays last followed
    bits: UInt32  # status of the last answer
    status: UInt32


@jit(inline=True)
def zero(x: N) -> N:
    """0 in the type of x, which is finite."""
    return x - x
