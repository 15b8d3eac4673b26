"""Numbers that the bit-exact reference shares with the C: limits, status bits and calls."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.structures import Flag, NumberArray, Real, Struct, UInt32

Reals = NumberArray
Counts = NumberArray
Bytes = NDArray[np.uint8]

CORNERS, LOOP = 0, 1
TANH, DEAD_ZONE = 0, 1

INPUT_CLAMPED, OUTPUT_CLAMPED, HELD, DOMAIN, SLEW_LIMITED, LIMITED_SETTING = 1, 2, 4, 8, 16, 32

OP_STEP, OP_COMMIT, OP_RESET, OP_INIT = 0, 1, 2, 3
# further calls of models with effects; the last, of an inverse with other tables: carry the memory over to their plays
OP_PUSH, OP_SETTLE, OP_OFFSET, OP_GAIN, OP_TEMPERATURE, OP_TRAVEL, OP_CORRECT, OP_EXPECTED, OP_TRAVELLED, OP_CARRY = (
    range(4, 14)
)
# the first of the calls that set a column, and their largest number
OP_INFLUENCE = 64
MOST_COLUMNS = 64
# the bits that identify a call, and a flag: leave its status unread, for a later call to report along with its own
OP_CALL, OP_UNREAD = 127, 128


class Range(Struct):
    """The ends of a range."""

    low: Real
    high: Real


class LimitTable(Struct):
    """Limits of drive and output, and related numbers; those from `play` on are for fixed point only."""

    drive: Range
    output: Range
    offset: Real  # added to every output
    hold: Real  # largest backward step of the drive that is suppressed: the drive is held instead
    real_max: Real  # largest number
    zero: Real  # in the type of the arithmetic
    play: Range  # of the inputs of the plays
    margin: Real  # by which rounding can take such an input out of its range
    fraction: Real  # fraction bits of a sum, in output codes
    fine: Real  # fraction bits of an input of the plays, in drive codes
    code_max: Real  # largest code of either sign
    saturated: Real  # largest sum that is not reported as limited
    shy: Real  # [output codes] safety margin for telling in advance that a step cannot end at a limit


class StepState(Struct):
    """The memory of one operator apart from its plays; each engine uses a part of it."""

    pending: Real  # drive sent but not yet part of the memory
    drive: Real  # last drive seen
    undo_drive: Real  # `drive` before the last step
    before: Real  # input of the plays before the last step
    returned: Real  # the last step's drive, if another has been committed since
    reference: Real  # reference of the last step
    last: Real  # `reference`, limited: the next reference rises or falls from here
    next: Real  # input or output at which another play begins to follow
    level: Real  # sum of the plays
    answer: Real  # last number returned
    ascending: Flag  # direction of the drive's last move
    undo_ascending: Flag
    has_pending: Flag
    stepped: Flag  # a step has answered
    committed: Flag  # a drive has been committed since
    repeated: Flag  # the last answer is still valid for `reference`
    usual: Flag  # the last step took the fast path: the same plays followed
    sought: Flag  # a solution has been found since the plays last followed
    bits: UInt32  # status of the last answer
    status: UInt32
