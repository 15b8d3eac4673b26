"""Rate-independent differential models `dy/dv = slope(v, y)`, one slope a direction, integrated over the input."""

from __future__ import annotations

import functools
import itertools
import warnings
from collections.abc import Callable

import numpy as np

from hystgen.checks import Array

Slope = Callable[[float, float], float]

RTOL = 1e-11
"""Error that a step may add, as a share of the state."""

ATOL = 1e-13
"""The same as a share of the state's scale, for states near zero."""

MOST_STEPS = 100_000
"""Steps between two samples, beyond which the state has run away."""


def integrate(v: Array, start: float, rising: Slope, falling: Slope, scale: float) -> Array:
    """State (N,) at the input samples, from the state `start` at the input 0; NaN once it has run away.

    By LSODA (scipy), with a call for each move between two turning points, where the slope jumps.
    """
    from scipy.integrate import ODEintWarning, odeint

    path = np.concatenate([[0.0], v])
    move = np.sign(np.diff(path))
    turns = np.flatnonzero(np.diff(move[move != 0.0]))
    ends = np.flatnonzero(move)[turns] + 1
    y = np.full(len(path), np.nan)
    y[0] = start
    for first, last in itertools.pairwise([0, *ends.tolist(), len(path) - 1]):
        places = path[first : last + 1]
        slope = functools.partial(_at, rising if places[-1] > places[0] else falling)
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore", ODEintWarning)  # what it says is looked at
            found, told = odeint(
                slope, y[first], places, tfirst=True, rtol=RTOL, atol=ATOL * scale, mxstep=MOST_STEPS, full_output=True
            )
        if told["message"] != "Integration successful." or not np.all(np.isfinite(found)):
            break
        y[first : last + 1] = found[:, 0]
    return y[1:]


def _at(slope: Slope, v: float, y: Array) -> float:
    return slope(v, float(y[0]))
