"""Checks of the parameters and the input of models, plants and operators."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def samples(v: ArrayLike) -> Array:
    """Samples (N,) in double precision. Raises ValueError for another number of dimensions."""
    found = np.ascontiguousarray(v, dtype=np.float64)
    if found.ndim != 1:
        raise ValueError(f"a signal has one dimension, this one has {found.ndim}")
    return found


def signal(v: ArrayLike) -> Array:
    """Samples (N,) in double precision. Raises ValueError unless they are finite and in one dimension."""
    found = samples(v)
    if not np.all(np.isfinite(found)):
        raise ValueError("an input has to be finite numbers")
    return found


def finite(**values: float) -> None:
    """Raise ValueError for a parameter that is no finite number."""
    for name, value in values.items():
        try:
            if math.isfinite(value):
                continue
        except (TypeError, OverflowError):
            pass
        raise ValueError(f"{name} has to be a finite number, not {value!r}")


def positive(**values: float) -> None:
    """Raise ValueError for a parameter that is no finite number above 0."""
    finite(**values)
    for name, value in values.items():
        if not value > 0.0:
            raise ValueError(f"{name} has to be positive, not {value}")


def whole(least: int, **values: int) -> None:
    """Raise ValueError for a parameter that is no whole number from `least` on."""
    for name, value in values.items():
        if not isinstance(value, int | np.integer) or value < least:
            raise ValueError(f"{name} has to be a whole number from {least} on, not {value!r}")


def numbers(values: Sequence[float], name: str) -> tuple[float, ...]:
    """At least one finite number, as plain floats. Raises ValueError."""
    try:
        found = () if isinstance(values, str) else tuple(float(x) for x in values)
    except (TypeError, ValueError, OverflowError):
        found = ()
    if not found or not all(map(math.isfinite, found)):
        raise ValueError(f"give {name} as finite numbers, at least one")
    return found
