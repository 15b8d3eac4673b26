"""What the corner engine computes with: constants of an operator in floating point, and the memory of an instance."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.jit import jit

Reals = NDArray[Any]
Counts = NDArray[np.int64]

# places in `Memory.real`: the plays, then what an operator keeps beside them
(INPUT, OUTPUT, NEXT, CAP, BEHIND, FROM, BASE, BEGIN, START, GAIN, SIGN, UNDO_INPUT, UNDO_OUTPUT, BEFORE, RETURNED,
 DRIVE, UNDO_DRIVE, REFERENCE, LEVEL) = range(19)  # fmt: skip  (CAP .. SIGN: in floating point)
# and in `Memory.counts`
(K, DEPTH, RISING, LIMITED, UNDO_K, UNDO_DEPTH, UNDO_RISING, STEPPED, COMMITTED, REPEAT, BITS, STATUS,
 ASCENDING, UNDO_ASCENDING, ON) = range(15)  # fmt: skip  (ON: in fixed point)
# `here` and `undo` of the operators in C: where the first numbers of each are, in `Memory.real` and `Memory.counts`
HERE, UNDO = (INPUT, K), (UNDO_INPUT, UNDO_K)
BOTTOM = 2  # `rose` of the bottom, which is opposite to both directions
# places in `Curve.constant`
MOST, ZERO, HALF, ONE = range(4)


class Curve(NamedTuple):
    """`hystgen_curve_t`: one operator; [0] is for falling moves, with signs changed, [1] for rising ones."""

    way: Reals  # (n + 2): play k begins to follow when a move has come this far
    reach: Reals  # (n + 2): the same in output
    gain: Reals  # (n + 2)
    slope: Reals  # (n + 2): 1 / gain
    limit: Reals  # (2): of the output
    inside: Reals  # (2): outputs up to here stay within the limit whatever rounding does
    range: Reals  # (2): of the input
    constant: Reals  # MOST, ZERO, HALF, ONE


class Start(NamedTuple):
    """`hystgen_start_t`: a start memory."""

    center: Reals  # (1 or n + 1, 2): input and output of the sum while plays 0 .. k hold what play k does
    step: int  # 0: one for all plays, 1: one for each
    risen: int  # plays up to this one are left by rising moves, the others by falling ones
    bottom: Reals  # output, and the inputs that a falling and a rising move have passed it at
    top: int  # plays from here on cannot move within the range


class Memory(NamedTuple):
    """One instance: plain arrays."""

    real: Reals
    counts: Counts
    output: Reals  # (n + 1): of each corner, as the three that follow
    passed: Reals  # (n + 1, 2): input at which a falling and a rising move have passed it, along the move
    top: Counts
    rose: Counts


def new_memory(plays: int, dtype: Any) -> Memory:
    """Memory for one instance of a model with that many plays beside play 0; `init` gives it its values."""
    return Memory(
        real=np.zeros(LEVEL + 1, dtype),
        counts=np.zeros(15, np.int64),
        output=np.zeros(plays + 1, dtype),
        passed=np.zeros((plays + 1, 2), dtype),
        top=np.zeros(plays + 1, np.int64),
        rose=np.zeros(plays + 1, np.int64),
    )


@jit
def copy_place(m: Any, to: tuple[int, int], source: tuple[int, int]) -> None:
    """Field by field, HERE or UNDO: input and output; k, depth and rising."""
    for i in range(2):
        m.real[to[0] + i] = m.real[source[0] + i]
    for i in range(3):
        m.counts[to[1] + i] = m.counts[source[1] + i]


class FixedMemory(NamedTuple):
    """One instance in fixed point: plain arrays of int64, however narrow they are in C."""

    real: Reals
    counts: Counts
    output: Reals  # (n): of each corner, as the three that follow
    input: Reals
    top: Counts
    rose: Counts


def new_fixed_memory(plays: int, dtype: Any = np.int64) -> FixedMemory:
    """Memory for one instance of a model with that many plays beside play 0; `init` gives it its values."""
    corners = max(plays, 1)
    return FixedMemory(
        real=np.zeros(LEVEL + 1, dtype),
        counts=np.zeros(15, np.int64),
        output=np.zeros(corners, dtype),
        input=np.zeros(corners, dtype),
        top=np.zeros(corners, np.int64),
        rose=np.zeros(corners, np.int64),
    )
