"""Numbers that the bit reference shares with the C: places in the arrays of limits, status bits and calls."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.jit import jit

Reals = NDArray[Any]
Counts = NDArray[np.int64]
Bytes = NDArray[np.uint8]

# arithmetic-independent names for places in the arrays below
DRIVE_MIN, DRIVE_MAX, OUTPUT_MIN, OUTPUT_MAX, OFFSET = 0, 1, 2, 3, 4
HOLD, REAL_MAX, ZERO = 7, 8, 9

CORNERS, LOOP = 0, 1
TANH, DEAD_ZONE = 0, 1

INPUT_CLAMPED, OUTPUT_CLAMPED, HELD, DOMAIN, SLEW_LIMITED, LIMITED_SETTING = 1, 2, 4, 8, 16, 32

OP_STEP, OP_COMMIT, OP_RESET, OP_INIT = 0, 1, 2, 3
# further calls of models with effects
OP_PUSH, OP_SETTLE, OP_OFFSET, OP_GAIN, OP_TEMPERATURE, OP_TRAVEL, OP_CORRECT, OP_EXPECTED, OP_TRAVELLED = range(4, 13)
# the bits of a call that identify it, and one that leaves its status bits for a later call to read with its own
OP_CALL, OP_UNREAD = 127, 128
# more places in `limits`, of fixed point
PLAY_MIN, PLAY_MAX, MARGIN, FRACTION, FINE, CODE_MAX, SATURATED, SHY = range(10, 18)


@jit(inline=True)
def zero(x: Any) -> Any:
    """0 of the type of a finite x."""
    return x - x
