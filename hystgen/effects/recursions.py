"""The sample-by-sample recursions of the effects, compiled when first used."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen import compiled

Array = NDArray[np.float64]


def follow(u: Array, decay: Array, early: Array, late: Array, x: float, out: Array) -> None:
    """First-order filter from the state `x`: `x_(k+1) = decay_k x_k + early_k u_k + late_k u_(k+1)`."""
    out[0] = x
    for k in range(len(u) - 1):
        x = decay[k] * x + early[k] * u[k] + late[k] * u[k + 1]
        out[k + 1] = x


COMPILED: list[Callable[..., Any]] = [follow]


@functools.cache
def code() -> Any:
    """The compiled recursions."""
    return compiled.compile_together(COMPILED)
