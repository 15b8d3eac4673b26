"""What the plants ask of their parameters and of their input."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def signal(v: ArrayLike) -> Array:
    """Input samples (N,) as an array. Raises ValueError unless they are finite and in one dimension."""
    samples = np.ascontiguousarray(v, dtype=np.float64)
    if samples.ndim != 1:
        raise ValueError(f"a signal has one dimension, this one has {samples.ndim}")
    if not np.all(np.isfinite(samples)):
        raise ValueError("an input has to be finite numbers")
    return samples


def finite(**values: float) -> None:
    """Raise ValueError for a parameter that is no finite number."""
    for name, value in values.items():
        if not math.isfinite(value):
            raise ValueError(f"{name} has to be a finite number, not {value}")


def positive(**values: float) -> None:
    """Raise ValueError for a parameter that is no finite number above 0."""
    finite(**values)
    for name, value in values.items():
        if not value > 0.0:
            raise ValueError(f"{name} has to be positive, not {value}")


def numbers(values: Sequence[float], name: str) -> tuple[float, ...]:
    """At least one finite number, as plain floats. Raises ValueError."""
    found = tuple(float(x) for x in values)
    if not found or not all(map(math.isfinite, found)):
        raise ValueError(f"{name} has to be finite numbers, at least one")
    return found
