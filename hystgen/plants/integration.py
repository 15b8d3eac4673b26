"""Rate-independent differential models `dy/dv = rate(v, y, direction)`, integrated over the input instead of time.

`integrate` is bound to a plant's `rate` by `hystgen.compiled`, compiled or as plain Python.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

RTOL = 1e-10
"""Error that a sub-step may add, as a share of the state."""

ATOL = 1e-12
"""The same as a share of the state's scale, for states near zero."""

if TYPE_CHECKING:

    def rate(v: float, y: float, rising: bool, p: tuple[Any, ...]) -> float: ...


def integrate(v: Array, v0: float, y0: float, p: tuple[Any, ...], scale: float, out: Array) -> None:
    """State (N,) at the input samples, from the state y0 at the input v0.

    Dormand and Prince's pair of orders 5 and 4 (1980) in sub-steps of at most the distance between two samples, each of
    which adds at most `RTOL |y| + ATOL scale`. Where the rate jumps, as at a guard, sub-steps shrink to a 1e-9 part of
    the distance and are then taken as they are.
    """
    y = y0
    x = v0
    step = np.inf
    for k in range(len(v)):
        end = v[k]
        distance = abs(end - x)
        rising = end > x
        least = 1e-9 * distance
        left = distance
        while left > 0.0:
            size = min(step, left)
            h = size if rising else -size
            k1 = rate(x, y, rising, p)
            k2 = rate(x + h / 5.0, y + h * k1 / 5.0, rising, p)
            k3 = rate(x + 0.3 * h, y + h * (3.0 * k1 + 9.0 * k2) / 40.0, rising, p)
            k4 = rate(x + 0.8 * h, y + h * (44.0 / 45.0 * k1 - 56.0 / 15.0 * k2 + 32.0 / 9.0 * k3), rising, p)
            k5 = rate(
                x + 8.0 / 9.0 * h,
                y
                + h
                * (19372.0 / 6561.0 * k1 - 25360.0 / 2187.0 * k2 + 64448.0 / 6561.0 * k3 - 212.0 / 729.0 * k4),
                rising,
                p,
            )
            k6 = rate(
                x + h,
                y
                + h
                * (
                    9017.0 / 3168.0 * k1
                    - 355.0 / 33.0 * k2
                    + 46732.0 / 5247.0 * k3
                    + 49.0 / 176.0 * k4
                    - 5103.0 / 18656.0 * k5
                ),
                rising,
                p,
            )
            new = y + h * (
                35.0 / 384.0 * k1
                + 500.0 / 1113.0 * k3
                + 125.0 / 192.0 * k4
                - 2187.0 / 6784.0 * k5
                + 11.0 / 84.0 * k6
            )
            k7 = rate(x + h, new, rising, p)
            error = size * abs(
                71.0 / 57600.0 * k1
                - 71.0 / 16695.0 * k3
                + 71.0 / 1920.0 * k4
                - 17253.0 / 339200.0 * k5
                + 22.0 / 525.0 * k6
                - k7 / 40.0
            )
            share = error / (RTOL * max(abs(y), abs(new)) + ATOL * scale)
            if not share < np.inf and size <= least:  # it ran away
                for rest in range(k, len(v)):
                    out[rest] = np.nan
                return
            if share <= 1.0 or size <= least:
                y = new
                left -= size
                x = x + h if left > 0.0 else end
            # a share that is no number, after an overflow, has to shrink the step too
            factor = 0.1
            if share < 1e-5:
                factor = 5.0
            elif share < 1e5:
                factor = min(max(0.9 * share**-0.2, 0.1), 5.0)
            step = max(size * factor, least)
        out[k] = y
