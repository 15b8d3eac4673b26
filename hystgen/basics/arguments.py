"""Checks of arguments to public calls, models, plants and operators; messages say what to pass instead."""

from __future__ import annotations

import functools
import inspect
import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, ParamSpec, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystgen.basics.problems import nearest, printable

P = ParamSpec("P")
R = TypeVar("R")

Array = NDArray[np.float64]


def kind(value: object) -> str:
    """A value as messages name it: plain values as written, others by type, arrays with their shape."""
    name = "array" if isinstance(value, np.ndarray) else type(value).__name__
    if isinstance(value, str | int | float | None):
        return f"{printable(repr(value))}"
    shape = getattr(value, "shape", None)
    return f"{_article(name)} of shape {shape}" if isinstance(shape, tuple) else _article(name)


def _article(name: str) -> str:
    return f"{'an' if name[0].lower() in 'aeiou' else 'a'} {name}"


def known_options(call: str, function: Callable[..., object], given: Iterable[str]) -> None:
    """Raise TypeError for an option that `function`, the implementation of `call`, does not have."""
    parameters = inspect.signature(function).parameters.values()
    options = [each.name for each in parameters if each.kind is each.KEYWORD_ONLY or each.default is not each.empty]
    for name in given:
        if name not in options:
            hint = nearest(name, options) or f"its options are {', '.join(options)}"
            raise TypeError(f"{call}() has no option {printable(name)}; {hint}")


def checked(function: Callable[P, R]) -> Callable[P, R]:
    """Make a public call raise TypeError, with a suggestion, for an unknown option."""
    needed = [each.name for each in inspect.signature(function).parameters.values() if each.default is each.empty]

    @functools.wraps(function)
    def call(*given: P.args, **options: P.kwargs) -> R:
        known_options(function.__name__, function, [name for name in options if name not in needed])
        return function(*given, **options)

    return call


def taking(options_of: Callable[..., object], name: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Like `checked`, for a call that passes its `**options` on to `options_of`; its signature then lists them. `name`:
    the call's name in messages."""
    handed = [
        each.replace(kind=inspect.Parameter.KEYWORD_ONLY)
        for each in inspect.signature(options_of).parameters.values()
        if each.default is not each.empty
    ]

    def make(function: Callable[P, R]) -> Callable[P, R]:
        signature = inspect.signature(function)
        own = [each for each in signature.parameters.values() if each.kind is not each.VAR_KEYWORD]

        @functools.wraps(function)
        def call(*given: P.args, **options: P.kwargs) -> R:
            named = {each.name for each in own}
            known_options(name, options_of, [option for option in options if option not in named])
            return function(*given, **options)

        call.__signature__ = signature.replace(parameters=[*own, *handed])  # type: ignore[attr-defined]
        return call

    return make


def path(name: str, value: object) -> str:
    """The value as a path in text form. Raises TypeError."""
    if isinstance(value, str | os.PathLike):
        found = os.fspath(value)
        if isinstance(found, str):
            return found
    raise TypeError(f"{name} has to be a path, as text or pathlib.Path, not {kind(value)}")


def choice(name: str, value: object, known: Sequence[str]) -> None:
    """Raise ValueError for a value that is not among the known words."""
    if not (isinstance(value, str) and value in known):
        hint = nearest(value, known) if isinstance(value, str) else ""
        raise ValueError(f"{name} {printable(repr(value))} is not one of {', '.join(known)}{hint and f'; {hint}'}")


def words(name: str, value: object, example: str) -> tuple[str, ...]:
    """The value as a tuple of words. Raises TypeError, even for a single word."""
    if isinstance(value, Iterable) and not isinstance(value, str | bytes | Mapping):
        found = tuple(value)
        if all(isinstance(word, str) for word in found):
            return found
    raise TypeError(f"{name} must be a list of names, not {kind(value)}; give [{example!r}]")


def real(name: str, value: object, unit: str) -> float:
    """The value as a real number, possibly infinite or NaN. Raises TypeError."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        raise TypeError(f"{name} must be a number ({unit}), not {kind(value)}")
    return float(value)


def number(name: str, value: object, unit: str, least: float = -math.inf) -> float:
    """The value as a finite number of at least `least`. Raises TypeError and ValueError."""
    found = real(name, value, unit)
    if not (math.isfinite(found) and found >= least):
        raise ValueError(f"{name} must be a finite{' nonnegative' * (least == 0)} number ({unit}), not {found:g}")
    return found


def whole(name: str, value: object, unit: str, least: int) -> int:
    """The value as an integer of at least `least`. Raises TypeError and ValueError."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        raise TypeError(f"{name} must be a whole number of {unit}, not {kind(value)}")
    if value < least:
        raise ValueError(f"{name} must be a whole number of {unit}, at least {least}, not {value}")
    return int(value)


def numbers(name: str, value: object, example: str) -> tuple[float, ...]:
    """The value as a tuple of finite numbers. Raises TypeError and ValueError."""
    hint = f"give a list of numbers such as {example}"
    if isinstance(value, str | bytes | Mapping) or not isinstance(value, Iterable):
        raise TypeError(f"{name} must be a list of finite numbers, not {kind(value)}; {hint}")
    try:
        found = tuple(float(x) for x in value)
    except (TypeError, ValueError, OverflowError):
        raise TypeError(f"{name} must be a list of finite numbers, but an entry is not a number; {hint}") from None
    if not all(map(math.isfinite, found)):
        raise ValueError(f"{name} must be a list of finite numbers, but an entry is not finite; {hint}")
    return found


def texts(name: str, value: object, keys: Sequence[str], example: str) -> dict[str, str]:
    """The value as a mapping from some of `keys` to text. Raises TypeError and ValueError."""
    if not isinstance(value, Mapping):
        raise TypeError(f"{name} must be a mapping of text to text, not {kind(value)}; give {example}")
    strange = [x for entry in value.items() for x in entry if not isinstance(x, str)]
    if strange:
        raise TypeError(f"{name} must be a mapping of text to text, but it contains {kind(strange[0])}; give {example}")
    unknown = [key for key in value if key not in keys] if keys else []
    if unknown:
        raise ValueError(f"{name} has no {printable(unknown[0])}; its keys are {', '.join(keys)}, as in {example}")
    return dict(value)


def signal(name: str, value: object) -> NDArray[Any]:
    """Real samples (N,), of any numeric type. Raises TypeError, and ValueError for any other shape."""
    try:
        found = np.atleast_1d(np.asarray(value))
    except ValueError:  # lists of different lengths
        raise ValueError(f"{name} must have one number per sample, not rows of different lengths") from None
    if found.ndim != 1:
        hint = ""
        if found.ndim == 2:
            hint = "; pass its .ravel()" if 1 in found.shape else "; pass one of its columns"
        raise ValueError(f"{name} must have one number per sample, shape (N,), not shape {found.shape}{hint}")
    if found.dtype.kind == "O":
        try:
            if any(x is None for x in found):
                raise TypeError
            found = found.astype(np.float64)
        except OverflowError:
            raise ValueError(f"{name} has a whole number beyond the range of double precision") from None
        except (TypeError, ValueError):
            raise TypeError(f"{name} must be an array of real numbers (N,), not {kind(value)}") from None
    if found.dtype.kind not in "fiub":
        raise TypeError(f"{name} must be an array of real numbers (N,), not {kind(value)} of {found.dtype}")
    return found


# Parameters and input of models, plants and operators ---------------------------------------------------------


def samples(v: ArrayLike) -> Array:
    """Samples (N,) in double precision. Raises ValueError unless they are one-dimensional."""
    found = np.ascontiguousarray(v, dtype=np.float64)
    if found.ndim != 1:
        raise ValueError(f"a signal must have one dimension, not {found.ndim}")
    return found


def finite_samples(v: ArrayLike) -> Array:
    """Samples (N,) in double precision. Raises ValueError unless they are finite and one-dimensional."""
    found = samples(v)
    if not np.all(np.isfinite(found)):
        raise ValueError("all samples of an input have to be finite")
    return found


def finite(**values: float) -> None:
    """Raise ValueError for a parameter that is not a finite number."""
    for name, value in values.items():
        try:
            if math.isfinite(value):
                continue
        except (TypeError, OverflowError):
            pass
        raise ValueError(f"{name} has to be a finite number, not {value!r}")


def positive(**values: float) -> None:
    """Raise ValueError for a parameter that is not a finite number above 0."""
    finite(**values)
    for name, value in values.items():
        if not value > 0.0:
            raise ValueError(f"{name} has to be positive, not {value}")


def whole_from(least: int, **values: int) -> None:
    """Raise ValueError for a parameter that is not an integer of at least `least`."""
    for name, value in values.items():
        if not isinstance(value, int | np.integer) or value < least:
            raise ValueError(f"{name} has to be a whole number, at least {least}, not {value!r}")


def finite_numbers(values: Sequence[float], name: str) -> tuple[float, ...]:
    """The values as plain floats: finite, and at least one. Raises ValueError."""
    try:
        found = () if isinstance(values, str) else tuple(float(x) for x in values)
    except (TypeError, ValueError, OverflowError):
        found = ()
    if not found or not all(map(math.isfinite, found)):
        raise ValueError(f"give {name} as finite numbers, at least one")
    return found


FAR_OUT = 0.1
"""[fraction of a drive range] Drives farther outside than this are outside on purpose, or in another unit."""


def outside(name: str, drives: Sequence[float], allowed: tuple[float, float], whose: str) -> list[str]:
    """A warning if some of the drives in an argument lie far outside a range; `whose`: what the range belongs to."""
    low, high = allowed
    far = [drive for drive in drives if not low - FAR_OUT * (high - low) <= drive <= high + FAR_OUT * (high - low)]
    if not far:
        return []
    return [
        f"{name} goes to {max(far, key=lambda drive: abs(drive - (low + high) / 2.0)):.6g}, outside {whose}, {low:.6g} "
        f"to {high:.6g}: the model is not known that far out; is it in the drive's unit?"
    ]
