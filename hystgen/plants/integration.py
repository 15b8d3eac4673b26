"""Rate-independent differential models `dy/dv = slope(v, y)`, one slope per direction, integrated over the input."""

from __future__ import annotations

import functools
import itertools
import warnings
from collections.abc import Callable

import numpy as np

from hystgen.basics import extras
from hystgen.basics.arguments import Array

Slope = Callable[[float, float], float]

RTOL = 1e-11
"""Error allowed per step, as a fraction of the state."""

ATOL = 1e-13
"""Error allowed per step for states near zero, as a fraction of the state's scale."""

MOST_STEPS = 100_000
"""Maximum number of steps between two samples; if more are needed, the state has run away."""


def integrate(v: Array, start: float, rising: Slope, falling: Slope, scale: float) -> Array:
    """State (N,) at the input samples, from the state `start` at the input 0.

    By LSODA (scipy), with a call for each move between two turning points, where the slope jumps; the slope is
    evaluated only at inputs within the move. Raises ValueError if the integration fails.
    """
    extras.require_fit("this plant")
    from scipy.integrate import ODEintWarning, odeint

    path = np.concatenate([[0.0], v])
    move = np.sign(np.diff(path))
    turns = np.flatnonzero(np.diff(move[move != 0.0]))
    ends = np.flatnonzero(move)[turns] + 1
    y, reach = np.full(len(path), start), float(np.max(np.abs(path)))
    for first, last in itertools.pairwise([0, *ends.tolist(), len(path) - 1]):
        sign = 1.0 if path[last] > path[first] else -1.0
        slope = functools.partial(_at, rising if sign > 0.0 else falling, sign)
        places = sign * path[first : last + 1]
        try:
            with np.errstate(all="ignore"), warnings.catch_warnings():
                warnings.simplefilter("error", ODEintWarning)
                found, details = odeint(
                    slope, y[first], places, tfirst=True, rtol=RTOL, atol=ATOL * scale, mxstep=MOST_STEPS,
                    tcrit=places[-1:], full_output=True,
                )
            # with tcrit, LSODA does not report steps that have become too small to make progress
            done = places[-1] == places[0] or np.isclose(details["tcur"][-1], places[-1], rtol=0.0, atol=1e-12 * reach)
        except (ODEintWarning, OverflowError):
            done = False
        if not (done and np.all(np.isfinite(found))):
            raise ValueError(
                f"the integration fails between the inputs {path[first]:g} and {path[last]:g}: with this slope the "
                "output runs away, or it would need too fine a step"
            )
        y[first : last + 1] = found[:, 0]
    return y[1:]


def _at(slope: Slope, sign: float, along: float, y: Array) -> float:
    """Slope along a variable that always increases: only then does odeint respect tcrit and stay within the move."""
    return sign * slope(sign * along, float(y[0]))
