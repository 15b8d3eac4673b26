"""The memory of the plays: admissible states, and how they map between a model and its inverse.

After any input the states satisfy `|s_i - s_(i-1)| <= r_i - r_(i-1)` with `s_0 = w`, the input of the plays. A state
list that breaks this cannot have come from any history, and the inverse is not exact with it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def project(requested: float | Sequence[float], thresholds: Sequence[float]) -> tuple[tuple[float, ...], bool]:
    """The admissible start memory nearest to the requested one, and whether it had to be changed.

    `requested`: one number for all plays, or n+1 numbers of which entry 0 (the input) is ignored. Going up from play
    1, which is kept, each play is moved into reach of the one before. The result starts with `s_0 = s_1`.
    Raises ValueError for a list of the wrong length.
    """
    n = len(thresholds) - 1
    if isinstance(requested, int | float):
        return (float(requested),) * (n + 1), False
    if len(requested) != n + 1:
        raise ValueError(f"initial_state has {len(requested)} entries, the model needs {n + 1}")
    if n == 0:
        return (float(requested[0]),), False
    states = [float(requested[1])]
    for i in range(2, n + 1):
        reach = thresholds[i] - thresholds[i - 1]
        states.append(min(max(float(requested[i]), states[-1] - reach), states[-1] + reach))
    # decimal numbers miss their sums by rounding: that is no projection
    grain = 8 * np.finfo(np.float64).eps
    moved = any(
        abs(a - float(b)) > grain * max(abs(a), abs(float(b)), r)
        for a, b, r in zip(states, requested[1:], thresholds[1:], strict=True)
    )
    return (states[0], *states), moved


def is_admissible(states: Sequence[float], thresholds: Sequence[float], tolerance: float = 0.0) -> bool:
    """Whether the states could have come from some history."""
    steps = np.abs(np.diff(np.asarray(states, dtype=np.float64)))
    return bool(np.all(steps <= np.diff(np.asarray(thresholds, dtype=np.float64)) + tolerance))


def through(states: Sequence[float], weights: Sequence[float]) -> Array:
    """States of the inverse's plays for states of the model's: `zeta_i = C_i s_i + sum over g > i of p_g s_g`.

    `C_i = p_0 + ... + p_i`. With the weights of the inverse the same rule leads back.
    """
    s = np.asarray(states, dtype=np.float64)
    p = np.asarray(weights, dtype=np.float64)
    above = np.concatenate([np.cumsum((p * s)[::-1])[::-1][1:], [0.0]])
    return np.asarray(np.cumsum(p) * s + above)
