"""Samples to rows with the same normal equations, as many as the memory has segments.

While a move takes the same plays along, each of them is the drive plus a constant and the others stand still: all
plays lie on one straight line over the drive. However many samples such a segment has, two rows hold what least
squares can learn of its plays, and one number the part of y that no play can follow.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.jit import jit

Array = NDArray[np.float64]


@jit
def _close_segment(
    thresholds: Array, states: Array, k: int, rising: bool, sums: Array, out: Array, row: int
) -> int:
    """Write the rows of a segment with plays 0 .. k-1 moving; `sums`: count, means and centred moments of v and y."""
    root = np.sqrt(sums[0])
    spread = np.sqrt(sums[3])
    out[row, 0] = root
    for i in range(len(thresholds)):
        if i < k:
            out[row, 1 + i] = root * (sums[1] - thresholds[i] if rising else sums[1] + thresholds[i])
        else:
            out[row, 1 + i] = root * states[i]
    out[row, -1] = root * sums[2]
    row += 1
    if spread > 0.0:
        out[row, 0] = 0.0
        for i in range(len(thresholds)):
            out[row, 1 + i] = spread if i < k else 0.0
        out[row, -1] = sums[4] / spread
        row += 1
        sums[6] += max(sums[5] - sums[4] * sums[4] / sums[3], 0.0)
    else:
        sums[6] += sums[5]
    return row


@jit
def _segment_rows(v: Array, y: Array, thresholds: Array, states: Array, sums: Array, out: Array) -> int:
    """Rows of the samples whose y is a number into `out`, none where it has no room, and how many they are.

    `states` of the plays run on. `sums`: room for seven numbers. The memory is admissible:
    a play that stands still keeps all larger ones still.
    """
    wanted = len(out) > 0
    sums[:] = 0.0
    row = 0
    k = 0
    rising = True
    for t in range(len(v)):
        x = v[t]
        moving = 0
        up = x > states[0]
        if up:
            while moving < len(thresholds) and states[moving] < x - thresholds[moving]:
                moving += 1
        else:
            while moving < len(thresholds) and states[moving] > x + thresholds[moving]:
                moving += 1
        if wanted and sums[0] > 0.0 and moving > 0 and (moving != k or up != rising):
            row = _close_segment(thresholds, states, k, rising, sums, out, row)
            sums[:6] = 0.0
        if moving > 0 or sums[0] == 0.0:
            k = moving
            rising = up
        for i in range(moving):
            states[i] = x - thresholds[i] if up else x + thresholds[i]
        if wanted and y[t] == y[t]:  # not NaN
            sums[0] += 1.0
            from_v = x - sums[1]
            from_y = y[t] - sums[2]
            sums[1] += from_v / sums[0]
            sums[2] += from_y / sums[0]
            sums[3] += from_v * (x - sums[1])
            sums[4] += from_v * (y[t] - sums[2])
            sums[5] += from_y * (y[t] - sums[2])
    if wanted:
        if sums[0] > 0.0:
            row = _close_segment(thresholds, states, k, rising, sums, out, row)
        out[row, :] = 0.0
        out[row, -1] = np.sqrt(sums[6])
        row += 1
    return row


def rows(v: Array, y: Array, thresholds: Array, states: Array, wanted: bool) -> Array:
    """Rows `[1, plays.., y]` for the samples, none unless `wanted`; `states` of the plays run on."""
    out = np.empty((len(v) + 1 if wanted else 0, len(thresholds) + 2))
    return out[: _segment_rows(v, y, thresholds, states, np.empty(7), out)]
