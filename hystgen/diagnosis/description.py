"""What a model leaves, in the field's words: with which variable it goes, whether it depends on the rate, comes back,
and is even or odd. Nothing is named."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.drives import reversals
from hystgen.diagnosis.periodic import repetition
from hystgen.diagnosis.structure import Item
from hystgen.plays import operators

Array = NDArray[np.float64]

WORTH = 0.1
"""Least share of the variance for a variable that is told to go with it."""

BLOCKS = 16
"""The samples are taken in so many blocks, alternately to learn from and to judge by."""

FEWEST = 200

THINNED = 12_000
"""Samples that are used where several variables are taken together."""

PLAYS = np.array([0.02, 0.05, 0.1, 0.2, 0.35, 0.6])
"""Thresholds that tell of the memory, as shares of the drive range."""

MEMORIES = (3.0, 10.0, 30.0, 100.0, 300.0, 1000.0)
"""Samples over which the drive is averaged to tell of rates."""

MORE = 1.25
"""Memory is told in place of a single variable where its share is so many times as large."""


@dataclass(frozen=True)
class Variable:
    """What an error may go with: its name, and its values over a record."""

    name: str
    of: Callable[[Item], Array]


def rate(item: Item) -> Array:
    """Slope of the drive, input/s."""
    return np.asarray(np.gradient(item.run.v, item.run.t))


def displacement(item: Item) -> Array:
    """The measured output, with straight lines where it is not compared."""
    if not item.known.any():
        return np.zeros(len(item.y))
    return np.interp(item.run.t, item.run.t[item.known], item.y[item.known])


def travel(item: Item) -> Array:
    """Distance that the drive has gone since the session began, as far as the records tell."""
    whole = item.session or item.run
    return np.concatenate([[0.0], np.cumsum(np.abs(np.diff(whole.v)))])[item.part]


def loop_centre(v: Array) -> Array:
    """Middle between the last two reversals of the drive, at every sample."""
    at = reversals(v)
    ends = v[at] if len(at) else v[:1]
    middles = np.concatenate([[ends[0]], (ends[:-1] + ends[1:]) / 2.0]) if len(ends) > 1 else ends
    place = np.searchsorted(at, np.arange(len(v)), side="right") - 1
    return np.asarray(middles[np.clip(place, 0, len(middles) - 1)])


def since_reversal(item: Item) -> Array:
    """Distance of the drive from its last reversal."""
    v = item.run.v
    at = np.concatenate([[0], reversals(v)])
    return np.asarray(np.abs(v - v[at[np.searchsorted(at, np.arange(len(v)), side="right") - 1]]))


VARIABLES = (
    Variable("drive", lambda item: item.run.v),
    Variable("rate", rate),
    Variable("displacement", displacement),
    Variable("memory", since_reversal),
    Variable("loop centre", lambda item: loop_centre(item.run.v)),
    Variable("session time", lambda item: item.run.t),
    Variable("time in the record", lambda item: item.run.t - item.run.t[0]),
    Variable("travel", travel),
)


def described(items: Sequence[Item], errors: Sequence[Array], noise: float) -> dict[str, Any]:
    """An entry of `unexplained` on what is left.

    `share_by_variable`: of the variance, by smooth functions of one variable in samples that they have not seen, and
    `main_variable` the one with most, None where none tells; `rate_free`, `repeatable`: None where the records cannot
    tell; `even_share`: of what goes with drive and direction, the part that is even about the middle of the range.
    """
    share, shares = structure(items, errors)
    total = np.concatenate([e[np.isfinite(e)] for e in errors])
    rms = float(np.sqrt(np.mean(total**2))) if len(total) else 0.0
    free, all_of_it = together(items, errors)
    main = max(shares, key=lambda name: shares[name], default=None)
    if free > MORE * max(share, WORTH):
        shares["memory"], main = round(free, 4), "memory"
    repeats = repeatable(items, errors)
    even = even_share(items, errors)
    return {
        "kind": "structure",
        "rms": rms,
        "above_floor": rms / noise if noise else None,
        "main_variable": main,
        "share_by_variable": dict(sorted(shares.items(), key=lambda pair: -pair[1])),
        "rate_free": _rate_free(free, all_of_it),
        "repeatable": None if repeats is None else bool(repeats > 0.5),
        "repeatable_share": None if repeats is None else round(repeats, 4),
        "even_share": None if even is None else round(even, 4),
    }


def _rate_free(free: float, all_of_it: float) -> bool | None:
    """Whether drive and memory tell as much as they do together with rates; None where nothing tells much."""
    if all_of_it < WORTH and free < WORTH:
        return None
    return bool(free > 0.75 * all_of_it)


def structure(items: Sequence[Item], errors: Sequence[Array]) -> tuple[float, dict[str, float]]:
    """Share of the residual's variance that smooth functions of one variable take away in samples that they have not
    seen: the largest such share, and that of each variable that is worth telling."""
    shares = {each.name: _share([each.of(item) for item in items], errors) for each in VARIABLES}
    return max(shares.values(), default=0.0), {k: round(s, 4) for k, s in shares.items() if s > WORTH}


def _share(values: Sequence[Array], errors: Sequence[Array]) -> float:
    """Cross-validated share of a function of one variable: means in 24 bins with as many samples each."""
    x = np.concatenate([v[np.isfinite(e)] for v, e in zip(values, errors, strict=True)])
    e = np.concatenate([e[np.isfinite(e)] for e in errors])
    if len(e) < FEWEST or np.ptp(x) == 0.0:
        return 0.0
    edges = np.unique(np.quantile(x, np.linspace(0.0, 1.0, 25)))
    place = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, max(len(edges) - 2, 0))
    fold = _folds(len(e))
    left = 0.0
    for k in (0, 1):
        train, test = fold != k, fold == k
        count = np.bincount(place[train], minlength=len(edges))
        mean = np.bincount(place[train], e[train], minlength=len(edges)) / np.maximum(count, 1)
        left += float(np.sum((e[test] - mean[place[test]]) ** 2))
    return max(0.0, 1.0 - left / max(float(np.sum(e**2)), 1e-300))


def _folds(n: int) -> NDArray[np.intp]:
    return np.asarray((np.arange(n) * BLOCKS // n) % 2)


def together(items: Sequence[Item], errors: Sequence[Array]) -> tuple[float, float]:
    """Cross-validated shares of what is rate-free (drive and plays), and of that together with averages of the drive
    over several times, which tell of rates and of creep."""
    widest = max(float(np.ptp(item.run.v)) for item in items)
    low = min(float(item.run.v.min()) for item in items)
    every = max(1, sum(int(np.isfinite(e).sum()) for e in errors) // THINNED)
    tables, values = [], []
    for item, error in zip(items, errors, strict=True):
        at = np.flatnonzero(np.isfinite(error))[::every]
        if not len(at):
            continue
        v = (item.run.v - low) / max(widest, 1e-300)
        plays = operators.plays(v, PLAYS, np.full(len(PLAYS), v[0])) - v
        powers = [v, v**2, v**3]
        rates = []
        for n in MEMORIES:
            decay = np.exp(-1.0 / n)
            rates.append(v - _averaged(v, decay))
        tables.append(np.stack([*powers, *plays, *(plays * v), *rates])[:, at])
        values.append(error[at])
    if not values:
        return 0.0, 0.0
    x, e = np.concatenate(tables, axis=1), np.concatenate(values)
    if len(e) < FEWEST:
        return 0.0, 0.0
    x = (x - x.mean(axis=1, keepdims=True)) / np.maximum(x.std(axis=1, keepdims=True), 1e-12)
    fixed = 3 + 2 * len(PLAYS)
    free, all_of_it = _regressed(x[:fixed], e), _regressed(x, e)
    return free, max(free, all_of_it)


def _averaged(v: Array, decay: float) -> Array:
    from scipy.signal import lfilter

    found, _ = lfilter([1.0 - decay], [1.0, -decay], v, zi=[decay * v[0]])
    return np.asarray(found)


def _regressed(x: Array, e: Array) -> float:
    fold = _folds(len(e))
    left = 0.0
    for k in (0, 1):
        train, test = fold != k, fold == k
        matrix = x[:, train] @ x[:, train].T + 1e-3 * np.count_nonzero(train) * np.eye(len(x))
        told = np.linalg.solve(matrix, x[:, train] @ e[train])
        left += float(np.sum((e[test] - told @ x[:, test]) ** 2))
    return max(0.0, 1.0 - left / max(float(np.sum(e**2)), 1e-300))


def repeatable(items: Sequence[Item], errors: Sequence[Array]) -> float | None:
    """Share of the error's variance that comes back where the drive repeats itself; None where it never does."""
    products = powers = 0.0
    count = 0
    for item, error in zip(items, errors, strict=True):
        period = repetition(item.run.v)
        if period is None:
            continue
        one, other = error[:-period], error[period:]
        both = np.isfinite(one) & np.isfinite(other)
        if np.count_nonzero(both) < period:
            continue
        one, other = one[both] - one[both].mean(), other[both] - other[both].mean()
        products += float(one @ other)
        powers += 0.5 * float(one @ one + other @ other)
        count += len(one)
    return max(0.0, products / powers) if count >= FEWEST and powers > 0.0 else None


def even_share(items: Sequence[Item], errors: Sequence[Array]) -> float | None:
    """Of the mean error over drive and direction, the share that is even: the same when drive and direction turn
    round; None where that mean is small against the error."""
    v = np.concatenate([item.run.v[np.isfinite(e)] for item, e in zip(items, errors, strict=True)])
    up = np.concatenate([rate(item)[np.isfinite(e)] > 0.0 for item, e in zip(items, errors, strict=True)])
    e = np.concatenate([e[np.isfinite(e)] for e in errors])
    if len(e) < FEWEST or np.ptp(v) == 0.0:
        return None
    bins = 20
    place = np.minimum(((v - v.min()) / np.ptp(v) * bins).astype(int), bins - 1)
    means = []
    for flag in (True, False):
        count = np.bincount(place[up == flag], minlength=bins)
        summed = np.bincount(place[up == flag], e[up == flag], minlength=bins)
        means.append(np.where(count > 10, summed / np.maximum(count, 1), np.nan))
    rising, turned = means[0], means[1][::-1]
    both = np.isfinite(rising) & np.isfinite(turned)
    if np.count_nonzero(both) < bins // 2:
        return None
    even, odd = 0.5 * (rising + turned)[both], 0.5 * (rising - turned)[both]
    power = float(even @ even + odd @ odd)
    if power / np.count_nonzero(both) < 0.5 * WORTH * float(np.mean(e**2)):
        return None
    return float(even @ even) / power


def words(told: dict[str, Any]) -> str:
    """An entry of `described` as a sentence."""
    said = []
    if told["main_variable"]:
        share = 100.0 * told["share_by_variable"][told["main_variable"]]
        said.append(f"goes mostly with {NAMES[told['main_variable']]} ({share:.0f} % of its variance)")
    else:
        said.append("goes with none of drive, rate, displacement, memory, loop centre, time and travel alone")
    said.append({True: "does not depend on the rate", False: "depends on the rate", None: ""}[told["rate_free"]])
    said.append({True: "comes back when the drive repeats itself", False: "does not come back when the drive does",
                 None: ""}[told["repeatable"]])  # fmt: skip
    if told["even_share"] is not None:
        even = told["even_share"]
        kind = "even" if even > 0.7 else "odd" if even < 0.3 else "neither even nor odd"
        said.append(f"is {kind} about the middle of the drive")
    parts = [each for each in said if each]
    return ", ".join(parts[:-1]) + " and " + parts[-1] if len(parts) > 1 else parts[0]


NAMES = {
    "drive": "the drive", "rate": "the drive rate", "displacement": "the displacement", "memory": "the memory",
    "loop centre": "the loop's centre", "session time": "the session time",
    "time in the record": "the time in the record", "travel": "the distance travelled",
}  # fmt: skip
