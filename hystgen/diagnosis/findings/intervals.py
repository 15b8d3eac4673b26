"""95 % intervals for the numbers of the effects, from the linear system about the fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.data.items import Item
from hystgen.diagnosis.search import fits
from hystgen.diagnosis.search.fits import Fitted
from hystgen.effects.base import Effect
from hystgen.identification import stage_content
from hystgen.identification.uncertainty import correlation_time

Array = NDArray[np.float64]

DRAWS = 400

TAILS = (0.025, 0.975)

SEED = 1

HALVINGS = 20
"""Bisections on the way to an inadmissible shape: down to a millionth of an interval's width."""

WEAKEST = 1e-9
"""Singular values below this share of the largest are raised to it: such directions are not determined."""

Numbers = Mapping[str, Any]


@dataclass(frozen=True)
class Sure:
    """Low and high of every number under the keys of the entries: of the front's stage, and of each part."""

    front: dict[str, Any]
    parts: tuple[dict[str, Any], ...]

    def of(self, fitted: Fitted, name: str, later: int) -> dict[str, Any]:
        """The intervals of an effect; `later`: how many of its name were found after it."""
        k = place(fitted, name, later)
        return self.front if k is None else self.parts[k]


def place(fitted: Fitted, name: str, later: int) -> int | None:
    """The part that an effect is, None for a front; `later`: how many of its name were found after it."""
    parts = [k for k, part in enumerate(fitted.structure.parts) if part.name == name]
    return parts[-1 - later] if later < len(parts) else None


def intervals(fitted: Fitted, items: Sequence[Item]) -> Sure:
    """95 % intervals of the numbers of the effects and of the front.

    The covariance is `s^2 tau (J^T J)^-1` (Seber and Wild, Nonlinear Regression, 1989, section 2.1), J being that of
    weights and numbers together on the free-run error, with the weights that are zero held there; `tau`, the
    correlation time of the residuals in samples, makes of their number the effective one. Numbers of the entries are
    those of shapes drawn from it and kept within the bounds.
    """
    shape, p = fitted.shape, fitted.weights
    front = len(fitted.structure.front.straight)
    if not len(shape):
        return Sure({}, tuple({} for _ in fitted.structure.parts))
    system = fits.linear(fitted.structure, items, shape, p).system.whole
    n1 = len(p)
    active = np.flatnonzero(np.append(p > 0.0, np.ones(len(shape), dtype=bool)))
    _, singular, right = np.linalg.svd(system[:, active], full_matrices=False)
    inverse = 1.0 / np.maximum(singular, WEAKEST * singular[0])
    # Only the numbers' part of the covariance is needed. Its triangular root with a positive diagonal is unique, unlike
    # singular vectors, whose signs and order depend on the library and would draw other numbers
    root = np.asarray(np.linalg.qr((right.T * inverse)[np.count_nonzero(active < n1) :].T, mode="r"))
    root = root * np.where(np.diag(root) < 0.0, -1.0, 1.0)[:, None]
    errors = fitted.errors(items)
    inside = [e[np.isfinite(e)] for e in errors]
    inside = [e for e in inside if len(e)]
    samples = sum(map(len, inside))
    tau = sum(correlation_time(e) * len(e) for e in inside) / max(samples, 1)
    sigma = fitted.rms * float(np.sqrt(tau * samples / max(samples - len(active), 1)))
    drawn = np.random.default_rng(SEED).standard_normal((DRAWS, len(root))) @ root
    low, high = fitted.structure.bounds
    shapes = [_admissible(fitted, one) for one in np.clip(shape + sigma * drawn, low, high)]
    of_front: dict[str, Any] = {}
    if front:
        made = [stage(fitted, one) for one in shapes]
        of_front = _spread(made, stage(fitted, shape))
    found: list[dict[str, Any]] = []
    for k, part in enumerate(fitted.structure.parts):
        if not len(part.candidate.start):
            found.append({})
            continue
        numbers = [fitted.structure.pieces(one)[1][k] for one in shapes]
        made = [entry(part.candidate.build(each)) for each in numbers]
        found.append(_spread(made, entry(part.candidate.build(fitted.structure.pieces(shape)[1][k]))))
    return Sure(of_front, tuple(found))


def _admissible(fitted: Fitted, drawn: Array) -> Array:
    """The last admissible shape on the way from the fitted one to a drawn one."""
    limits, found = fitted.structure, fitted.shape
    least = np.minimum(limits.slack(found), 0.0)
    if np.all(limits.slack(drawn) >= least):
        return drawn
    inside, outside = 0.0, 1.0
    for _ in range(HALVINGS):
        share = 0.5 * (inside + outside)
        if np.all(limits.slack(found + share * (drawn - found)) >= least):
            inside = share
        else:
            outside = share
    return np.asarray(found + inside * (drawn - found))


def stage(fitted: Fitted, shape: Array) -> dict[str, Any]:
    """The last stage of the front as a parameter file has it; empty without a front."""
    stages = fitted.structure.front.stages(fitted.structure.pieces(shape)[0])
    return dict(stage_content(stages[-1])) if stages else {}


def entry(effect: Effect) -> dict[str, Any]:
    """The keys of an effect as a parameter file has them, without the name."""
    return {key: value for key, value in effect.model_dump(exclude_defaults=True).items() if key != "name"}


def _spread(made: Sequence[Numbers], at: Numbers) -> dict[str, Any]:
    """`[low, high]` of each key that varies; for a list or a mapping that of its entries."""
    found = {key: _interval([each.get(key) for each in made], value) for key, value in at.items()}
    return {key: sure for key, sure in found.items() if sure}


def _interval(values: Sequence[Any], at: Any) -> Any:
    if isinstance(at, bool | str) or any(value is None for value in values):
        return None
    if isinstance(at, Mapping):
        return _spread(values, at)
    if isinstance(at, list | tuple):
        if any(len(value) != len(at) for value in values):
            return None
        found = [_interval([value[k] for value in values], one) for k, one in enumerate(at)]
        return [sure or [one, one] for sure, one in zip(found, at, strict=True)] if any(found) else None
    low, high = np.quantile(np.array(values, dtype=np.float64), TAILS)
    return [float(low), float(high)] if low < high else None
