"""Checks of the results of a user's own effects before anything depends on them."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.problems import EffectsError

E = TypeVar("E")

FORMS: dict[str, Callable[..., tuple[int, ...]]] = {
    "drive": lambda a, *_: a.shape,
    "plays": lambda w, _, thresholds, *__: (len(thresholds), len(w)),
    "summed": lambda _, w, *__: w.shape,
    "bent": lambda rows, *_: rows.shape,
    "bent_sum": lambda _, rows, *__: rows.shape[1:],
    "parallel": lambda w: w.shape,
    "filtered": lambda h, *_: h.shape,
    "gain": lambda run: run.t.shape,
    "offset": lambda run: run.t.shape,
    "mapped": lambda y, *_: y.shape,
    "added": lambda run: run.t.shape,
    "transients": lambda run: (-1, len(run.t)),
}
"""Shape of the array that each method returns for its arguments; -1 stands for any length."""


def guard(effect: type[Any], base: type[E], name: str) -> None:
    """Make the methods of a class, and of its bases below `base`, raise EffectsError when they fail."""
    own: dict[str, Any] = {}
    for each in reversed(effect.__mro__[: effect.__mro__.index(base)]):
        own.update(vars(each))
    for method in FORMS:
        if method in own:
            setattr(effect, method, _method(own[method], name, method))
    if "candidates" in own:
        effect.candidates = classmethod(_candidates(own["candidates"].__func__, name))


def _method(own: Callable[..., object], name: str, method: str) -> Callable[..., object]:
    @functools.wraps(own)
    def answer(self: object, *arguments: object) -> NDArray[np.float64]:
        try:
            found = np.asarray(own(self, *arguments))
        except Exception as error:
            raise _failed(name, method, error) from error
        wanted = FORMS[method](*arguments)
        fits = len(found.shape) == len(wanted) and all(a in (-1, b) for a, b in zip(wanted, found.shape, strict=True))
        if not fits or found.dtype.kind not in "fiu":
            raise EffectsError(
                f"the effect {name} answered {found.dtype} of shape {found.shape} in {method}; numbers of shape "
                f"{wanted} were expected"
            )
        return np.ascontiguousarray(found, dtype=np.float64)

    return answer


def _candidates(own: Callable[..., Sequence[Any]], name: str) -> Callable[..., list[Any]]:
    @functools.wraps(own)
    def candidates(cls: type[E], about: object) -> list[Any]:
        try:
            return [_candidate(each, cls, name) for each in own(cls, about)]
        except EffectsError:
            raise
        except Exception as error:
            raise _failed(name, "candidates", error) from error

    return candidates


def _candidate(each: Any, cls: type[E], name: str) -> Any:
    def build(x: NDArray[np.float64]) -> E:
        try:
            made = each.build(x)
        except Exception as error:
            raise _failed(name, f"build of {each.label!r}", error) from error
        if not isinstance(made, cls):
            raise EffectsError(f"the effect {name} answered {type(made).__name__} in build of {each.label!r}")
        return made

    vectors = [np.asarray(x, dtype=np.float64) for x in (each.low, each.start, each.high, *each.others)]
    low, _, high = vectors[:3]
    if low.ndim != 1 or any(x.shape != low.shape or not np.isfinite(x).all() for x in vectors) or np.any(low > high):
        raise EffectsError(
            f"the effect {name} has a candidate {each.label!r} whose low, start, high and others must be finite lists "
            "of one length, low below high"
        )
    build(vectors[1])
    return replace(each, low=low, start=vectors[1], high=high, others=tuple(vectors[3:]), build=build)


def _failed(name: str, method: str, error: Exception) -> EffectsError:
    return EffectsError(f"the effect {name} failed in {method}: {type(error).__name__}: {error}")
