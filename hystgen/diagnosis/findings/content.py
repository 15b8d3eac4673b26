"""The result of a search: the effects found and their certainty, the remaining error, and where it is large."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.data import disturbances, preparing
from hystgen.diagnosis.data.items import Item, compared, rms
from hystgen.diagnosis.data.preparing import Prepared
from hystgen.diagnosis.data.signals import NoiseFloor, repetition, reversals, still
from hystgen.diagnosis.findings.kinds import Fault, Finding, Line, Ripple, Structured, times_noise
from hystgen.diagnosis.findings.result import (
    Contender,
    FitErrors,
    Gap,
    Inverse,
    NamedEffect,
    Result,
    Stretch,
    Withdrawn,
)
from hystgen.diagnosis.search import acceptance, fits, shared
from hystgen.diagnosis.search.acceptance import is_noise
from hystgen.diagnosis.search.fits import Fitted
from hystgen.diagnosis.search.selection import Found, Outcome, Ranked, Refusal
from hystgen.effects import TOLD_APART
from hystgen.plays import operators

Array = NDArray[np.float64]

ONE_LOOP = (
    "all records follow one loop, which shows little more than one effect: add smaller loops inside it, other speeds "
    "and holds"
)
"""Advice for records that contain only one loop."""


def result_of(
    unit: str | None,
    ready: Prepared,
    noise: NoiseFloor,
    found: Outcome,
    as_given: FitErrors,
    odd: Sequence[Finding],
    one_loop: bool,
    inverse: Inverse,
) -> Result:
    """The whole result.

    `as_given`: errors of the nominal model before it was refitted; `odd`: findings about whole records; `one_loop`:
    whether all records follow the same loop.
    """
    before = [found.refitted.errors(group) for group in (ready.to_fit, ready.held)]
    after = [found.fitted.errors(group) for group in (ready.to_fit, ready.held)]
    gap = Gap(as_given, *(FitErrors(*map(rms, each)) for each in (before, after)))
    remaining = _unexplained(ready, after, noise.rms, max(gap.after.fit, noise.rms), odd)
    everything = [*ready.to_fit, *ready.held]
    rivals = found.not_separable
    structured = any(isinstance(each, Structured) for each in remaining)
    result = Result(
        verdict=(
            "effects_found" if any(each.refused is None for each in found.found)
            else "unexplained" if remaining else "nothing_missing"
        ),
        noise_floor=noise.rms,
        output_range=max(float(np.ptp(item.y[item.known])) for item in everything if item.known.any()),
        unit=unit,
        gap=gap,
        effects=_effects(found, ready.to_fit, gap.refitted.holdout, noise.rms, unit),
        unexplained=(*remaining, *(each for each in odd if each not in remaining), *ready.repaired),
        where=worst(everything, [*before[0], *before[1]], noise.rms),
        not_separable=rivals,
        advice=(
            *(TOLD_APART.get(frozenset(pair), _advice(*pair)) for pair in rivals),
            *([ONE_LOOP] if (rivals or structured) and one_loop else []),
            *_of_columns(found),
            *(more for each in remaining for more in each.advice()),
        ),
        ranking=tuple(tuple(_contender(each, unit) for each in ranked) for ranked in found.rankings),
        inverse=inverse,
        noise_from=noise.ruled,
        compared=compared(everything),
        withdrawn=_withdrawn(found, unit),
        written=found.written,
    )
    return cast("Result", _in_digits(result))


def _of_columns(found: Outcome) -> list[str]:
    """What to record if an error may follow a column that these records do not separate from time, mains or drive."""
    columns = [
        shared.column_of(each.tried.fitted) for ranked in found.rankings for each in ranked
        if each.refused is not None and each.refused.why == "shared"
    ]
    return [
        f"these records do not show whether the error follows column {column} or only changes along with it: repeat a "
        f"loop while {column} alone is changed, up and back, at times of your own choice"
        for column in dict.fromkeys(columns)
    ]


def _contender(ranked: Ranked, unit: str | None) -> Contender:
    tried, refused = ranked.tried, ranked.refused
    why = None if refused is None else reason(refused, unit)
    return Contender(tried.name, tried.option.label, tried.fitted.rms, tried.held_out, why)


def reason(refused: Refusal, unit: str | None) -> str:
    """The reason an effect is not named, as text."""
    return REFUSALS[refused.why].format(value=refused.value, limit=refused.limit, unit=f" {unit}" if unit else "")


def _withdrawn(found: Outcome, unit: str | None) -> Withdrawn | None:
    """The residual error with the withdrawn effects."""
    them = found.withdrawn
    if them is None:
        return None
    held, to_fit = them.held, them.to_fit
    left = tuple(each.left if math.isfinite(each.left) else None for each in (held, to_fit))
    return Withdrawn(
        them.names,
        FitErrors(to_fit.before, held.before),
        FitErrors(to_fit.after, held.after),
        (left[0], left[1]),
        tuple((each.name, each.found) for each in them.ends),
        reason(them.refused, unit),
    )


REFUSALS = {
    "one_loop": "{value:.0%} of the gap above the noise remains; records of one loop allow at most {limit:.0%}",
    "little": "it removes too little: {value:.3g}{unit} rms of the error, but a name needs {limit:.3g}{unit}",
    "chance": "its gain on held-out records may be due to chance (p = {value:.1g}, must be at most {limit:g})",
    "unsure": "neither held-out nor fitted records confirm it (p = {value:.1g}, must be at most {limit:g})",
    "small": "it removes {value:.0%} of the gap, but a name needs {limit:.0%}",
    "most": "with the effects, {value:.3g}{unit} rms remains, most of the former {limit:.3g}{unit}",
    "above": "with the effects, {value:.3g}{unit} rms remains; records of one loop allow at most {limit:.3g}{unit}",
    "given": "with the effects, {value:.3g}{unit} rms remains, but only {limit:.3g}{unit} with the model as given",
    "identified": "with the effects, {value:.3g}{unit} rms remains, but only {limit:.3g}{unit} with that of `identify`",
    "few": "only {value:.0%} of the samples were compared, but a name needs {limit:.0%}",
    "end": "it acts on {value:.1%} of the drive range at an end, but a limit needs {limit:.1%}",
    "grows": "with a time constant of {value:.3g} s it only grows during {limit:.3g} s of records, as disturbances can",
    "shared": "only {value:.0%} of what it removes belongs to the column alone, and the rest to what the column shares "
    "with time, mains or the drive; a name needs {limit:.0%}",
    "range": "{value:.0%} of the gap above the noise remains; with a parameter at an end of its range, "
    "at most {limit:.0%} may",
    "forgets": "hysteresis other than a play sum explains the error at least as well: {value:.3g}{unit} rms remains",
    "wild": "its inverse changes the plain model's output by {value:.3g}{unit} rms, more than {limit:.3g}{unit}",
    "other": "another shape does better, or as well with fewer parameters",
}
"""Reasons why an effect that was tried is not named, as text."""


def _in_digits(value: object) -> object:
    """The value with all numbers rounded to eight digits, so that the same input gives the same text."""
    if is_dataclass(value) and not isinstance(value, type):
        return type(value)(**{each.name: _in_digits(getattr(value, each.name)) for each in fields(value)})
    if isinstance(value, Mapping):
        return {key: _in_digits(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return tuple(map(_in_digits, value))
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and math.isfinite(value):
        return float(f"{value:.8g}")
    return value


def _unexplained(
    ready: Prepared, after: Sequence[list[Array]], noise: float, usual: float, odd: Sequence[Finding]
) -> list[Finding]:
    """The remaining error beyond noise and recording faults; `usual`: error on fitted records."""
    everything, errors = [*ready.to_fit, *ready.held], [*after[0], *after[1]]
    lines, errors = disturbances.lines(everything, errors)
    known = [each for each in odd if isinstance(each, Line | Ripple)]
    new = [line for line in lines if not disturbances.is_known(line, known)]
    # if the position is not predicted well enough to remove a ripple, the ripple hides jumps as noise does
    jumping = max([noise, *(each.amplitude for each in (*known, *new) if isinstance(each, Ripple))])
    sticking = preparing.merged(disturbances.stick_slip(everything, errors, jumping))
    remaining = [each for each in odd if not isinstance(each, Fault)] + new + sticking
    fitted, held = errors[: len(ready.to_fit)], errors[len(ready.to_fit) :]
    share, _ = shares(ready.held, held)
    share = max(share, *together(everything, errors))
    if not acceptance.is_noise(rms(held), noise, share) or not acceptance.is_noise(rms(fitted), noise, 0.0):
        alone = tuple(
            item.name for item, e in zip(ready.held, after[1], strict=True)
            if rms([e]) > acceptance.HELD_OUT_ALONE * usual
        )
        remaining.append(described(everything, errors, noise, alone))
    return remaining


def _effects(
    found: Outcome, to_fit: Sequence[Item], refitted: float, noise: float, unit: str | None
) -> tuple[NamedEffect, ...]:
    if not found.found:
        return ()
    sure = fits.intervals(found.fitted, to_fit)
    effects = []
    for k, each in enumerate(found.found):
        later = sum(other.name == each.name for other in found.found[k + 1 :])
        parameters = _parameters_of(found.fitted, each.name, later)
        part = fits.place(found.fitted, each.name, later)
        ends = tuple(end.found for end in found.ends if end.part == part)
        effects.append(
            NamedEffect(
                each.name,
                parameters,
                sure.of(found.fitted, each.name, later),
                (each.before - each.after) / refitted if refitted else 0.0,
                each.before,
                each.after,
                each.p_value,
                _evidence(each, parameters.get("column"), refitted, noise),
                bool(ends) or _twice(parameters.get("time_constants", ())),
                ends,
                each.known,
                None if each.refused is None else reason(each.refused, unit),
            )
        )
    return tuple(effects)


def _twice(times: Sequence[float]) -> bool:
    """Whether two of the time constants are practically equal."""
    ordered = sorted(times)
    return any(b <= (1.0 + acceptance.BETTER) * a for a, b in itertools.pairwise(ordered))


def _advice(one: str, other: str) -> str:
    return f"these records do not separate {one} and {other}; hystgen diagnose --plan writes drives that do"


def _evidence(each: Found, column: str | None, refitted: float, noise: float) -> str:
    follows = f"the residual follows column {column}: " if column else ""
    gain = 100.0 * (1.0 - each.after / each.before) if each.before else 0.0
    change = f"{gain:.0f} % less" if gain >= 0.0 else f"{-gain:.0f} % more"
    said = f"{follows}{each.label}: held-out rms {each.before:.4g} to {each.after:.4g} ({change})"
    if is_noise(each.after, noise) or not refitted:
        return said
    return f"{said}; {times_noise(each.after / noise)} and {100.0 * each.after / refitted:.0f} % of the gap remain"


def _parameters_of(fitted: Fitted, name: str, later: int) -> dict[str, Any]:
    """An effect's keys without the name, or the front's stage; `later`: number of effects with that name after it."""
    k = fits.place(fitted, name, later)
    if k is None:
        return fits.stage(fitted, fitted.shape)
    return fits.entry(fitted.structure.effects(fitted.shape)[k])


# The remaining error: the variables on which it depends ------------------------------------------------------


DESCRIBED_PLAYS = np.array([0.02, 0.05, 0.1, 0.2, 0.35, 0.6])
"""Thresholds of the plays that represent memory, as fractions of the drive range."""

MEMORIES = (3.0, 10.0, 30.0, 100.0, 300.0, 1000.0)
"""Time constants, in samples, of the averages of the drive that represent rates and creep."""

LENGTHS = (0.02, 0.05, 0.15, 0.5, 1.5, 5.0)
"""[fraction of the drive range] Lengths of travel over which the drive is averaged: six, like the times above, each
about three times the previous one, from the smallest play up to five ranges. Six lengths explain 0.55 of a play model's
residual variance on a Bouc-Wen plant; four explain 0.34, eleven 0.59; for creep, none of these explains more than 0.09.
Set by: benchmarks/chosen_numbers.py lengths."""


@dataclass(frozen=True)
class Variable:
    """A variable on which an error may depend, with its name and its values over a record."""

    name: str
    of: Callable[[Item], Array]


def rate(item: Item) -> Array:
    """Slope of the drive, input/s."""
    return np.asarray(np.gradient(item.run.v, item.run.t))


def displacement(item: Item) -> Array:
    """The measured output, interpolated over samples that are not compared."""
    if not item.known.any():
        return np.zeros(len(item.y))
    return np.interp(item.run.t, item.run.t[item.known], item.y[item.known])


def travel(item: Item) -> Array:
    """Distance that the drive has travelled since the session began, to the extent that it was recorded."""
    whole = item.session or item.run
    return np.concatenate([[0.0], np.cumsum(np.abs(np.diff(whole.v)))])[item.part]


def loop_centre(v: Array) -> Array:
    """Midpoint of the last two reversals of the drive, at every sample."""
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


def described(
    items: Sequence[Item], errors: Sequence[Array], noise: float, held_out_alone: Sequence[str]
) -> Structured:
    """What the remaining errors depend on; `noise`: rms of the noise; `held_out_alone`: as in `Structured`."""
    share, by_variable = shares(items, errors)
    total = np.concatenate([e[np.isfinite(e)] for e in errors])
    rms = float(np.sqrt(np.mean(total**2))) if len(total) else 0.0
    free, with_rates = together(items, errors)
    main = max(by_variable, key=lambda name: by_variable[name], default=None)
    if free > acceptance.MEMORY_WINS * max(share, acceptance.VARIABLE_SHARE):
        by_variable["memory"], main = round(free, 4), "memory"
    repeats = repeatable(items, errors)
    even = even_share(items, errors)
    return Structured(
        rms=rms,
        above_floor=rms / noise if noise else None,
        main_variable=main,
        share_by_variable=dict(sorted(by_variable.items(), key=lambda pair: -pair[1])),
        rate_free=_rate_free(free, with_rates),
        repeatable=None if repeats is None else bool(repeats > acceptance.REPEATABLE_SHARE),
        repeatable_share=None if repeats is None else round(repeats, 4),
        even_share=None if even is None else round(even, 4),
        held_out_alone=tuple(held_out_alone),
    )


def _rate_free(free: float, with_rates: float) -> bool | None:
    """Whether drive and memory explain the error without rates; None if nothing explains much of the error, or if rates
    add little to a small explained fraction."""
    if with_rates < acceptance.VARIABLE_SHARE and free < acceptance.VARIABLE_SHARE:
        return None
    if free > acceptance.RATE_FREE_SHARE * with_rates:
        return True
    return False if with_rates - free > acceptance.VARIABLE_SHARE else None


def shares(items: Sequence[Item], errors: Sequence[Array]) -> tuple[float, dict[str, float]]:
    """Fractions of the error variance that a smooth function of one variable explains on samples it was not fitted to.

    Returns the largest fraction, and the fractions of the variables that matter.
    """
    found = {each.name: _share([each.of(item) for item in items], errors) for each in VARIABLES}
    mattering = {name: round(share, 4) for name, share in found.items() if share > acceptance.VARIABLE_SHARE}
    return max(found.values(), default=0.0), mattering


def _share(values: Sequence[Array], errors: Sequence[Array]) -> float:
    """Cross-validated fraction explained by one variable through its means over bins with equal numbers of samples."""
    x = np.concatenate([v[np.isfinite(e)] for v, e in zip(values, errors, strict=True)])
    e = np.concatenate([e[np.isfinite(e)] for e in errors])
    if len(e) < acceptance.DESCRIBED_SAMPLES or np.ptp(x) == 0.0:
        return 0.0
    edges = np.unique(np.quantile(x, np.linspace(0.0, 1.0, acceptance.VARIABLE_BINS + 1)))
    place = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, max(len(edges) - 2, 0))
    fold = _folds(len(e))
    unexplained = 0.0
    for k in (0, 1):
        train, test = fold != k, fold == k
        count = np.bincount(place[train], minlength=len(edges))
        mean = np.bincount(place[train], e[train], minlength=len(edges)) / np.maximum(count, 1)
        unexplained += float(np.sum((e[test] - mean[place[test]]) ** 2))
    return max(0.0, 1.0 - unexplained / max(float(np.sum(e**2)), 1e-300))


def _folds(n: int) -> NDArray[np.intp]:
    """0 or 1 for each of n samples: blocks that alternate between fit and test."""
    return np.asarray((np.arange(n) * acceptance.FOLD_BLOCKS // n) % 2)


def together(items: Sequence[Item], errors: Sequence[Array]) -> tuple[float, float]:
    """Cross-validated fractions explained by rate-free variables (drive, plays, averages of the drive over its travel),
    and by these together with averages over several times, which represent rates and creep.

    Hysteresis that plays cannot follow causes an error that depends on both kinds of averages; only the gain from the
    second kind is due to rates.
    """
    widest = max(float(np.ptp(item.run.v)) for item in items)
    low = min(float(item.run.v.min()) for item in items)
    every = max(1, sum(int(np.isfinite(e).sum()) for e in errors) // acceptance.SEARCHED)
    tables, values = [], []
    for item, error in zip(items, errors, strict=True):
        at = np.flatnonzero(np.isfinite(error))[::every]
        if not len(at):
            continue
        v = (item.run.v - low) / max(widest, 1e-300)
        plays = operators.plays(v, DESCRIBED_PLAYS, np.full(len(DESCRIBED_PLAYS), v[0])) - v
        powers = [v, v**2, v**3]
        free = [*powers, *plays, *(plays * v), *(v - _averaged_over_travel(v, length) for length in LENGTHS)]
        rates = [v - _averaged(v, np.exp(-1.0 / n)) for n in MEMORIES]
        tables.append(np.stack([*free, *rates])[:, at])
        values.append(error[at])
    if not values:
        return 0.0, 0.0
    x, e = np.concatenate(tables, axis=1), np.concatenate(values)
    if len(e) < acceptance.DESCRIBED_SAMPLES:
        return 0.0, 0.0
    x = (x - x.mean(axis=1, keepdims=True)) / np.maximum(x.std(axis=1, keepdims=True), 1e-12)
    rate_free, with_rates = _regressed(x[: -len(MEMORIES)], e), _regressed(x, e)
    return rate_free, max(rate_free, with_rates)


def _averaged(v: Array, decay: float) -> Array:
    from scipy.signal import lfilter

    found, _ = lfilter([1.0 - decay], [1.0, -decay], v, zi=[decay * v[0]])
    return np.asarray(found)


def _averaged_over_travel(v: Array, length: float) -> Array:
    """Averages over the drive's travel: independent of the rate, and constant while the drive rests."""
    travelled = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(v)))])
    if travelled[-1] == 0.0:
        return v
    places = np.linspace(0.0, travelled[-1], 2 * len(v))
    moving = np.concatenate([[True], np.diff(travelled) > 0.0])
    even = np.interp(places, travelled[moving], v[moving])
    averaged = _averaged(even, float(np.exp(-(places[1] - places[0]) / length)))
    return np.asarray(np.interp(travelled, places, averaged))


def _regressed(x: Array, e: Array) -> float:
    """Cross-validated fraction of e (N,) explained by a linear regression on rows x (k, N) with a small ridge."""
    fold = _folds(len(e))
    unexplained = 0.0
    for k in (0, 1):
        train, test = fold != k, fold == k
        matrix = x[:, train] @ x[:, train].T + 1e-3 * np.count_nonzero(train) * np.eye(len(x))
        solution = np.linalg.solve(matrix, x[:, train] @ e[train])
        unexplained += float(np.sum((e[test] - solution @ x[:, test]) ** 2))
    return max(0.0, 1.0 - unexplained / max(float(np.sum(e**2)), 1e-300))


def repeatable(items: Sequence[Item], errors: Sequence[Array]) -> float | None:
    """Fraction of the error's variance that recurs when the drive repeats itself; None if the drive does not repeat."""
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
    return max(0.0, products / powers) if count >= acceptance.DESCRIBED_SAMPLES and powers > 0.0 else None


def even_share(items: Sequence[Item], errors: Sequence[Array]) -> float | None:
    """Even fraction of the mean error over drive and direction: the part that is unchanged when both are reversed.

    None if that mean is small compared with the error.
    """
    v = np.concatenate([item.run.v[np.isfinite(e)] for item, e in zip(items, errors, strict=True)])
    up = np.concatenate([rate(item)[np.isfinite(e)] > 0.0 for item, e in zip(items, errors, strict=True)])
    e = np.concatenate([e[np.isfinite(e)] for e in errors])
    if len(e) < acceptance.DESCRIBED_SAMPLES or np.ptp(v) == 0.0:
        return None
    bins = acceptance.PARITY_BINS
    place = np.minimum(((v - v.min()) / np.ptp(v) * bins).astype(int), bins - 1)
    means = []
    for flag in (True, False):
        count = np.bincount(place[up == flag], minlength=bins)
        summed = np.bincount(place[up == flag], e[up == flag], minlength=bins)
        means.append(np.where(count > acceptance.PARITY_SAMPLES, summed / np.maximum(count, 1), np.nan))
    rising, turned = means[0], means[1][::-1]
    both = np.isfinite(rising) & np.isfinite(turned)
    if np.count_nonzero(both) < bins // 2:
        return None
    even, odd = 0.5 * (rising + turned)[both], 0.5 * (rising - turned)[both]
    power = float(even @ even + odd @ odd)
    if power / np.count_nonzero(both) < acceptance.PARITY_SHARE * float(np.mean(e**2)):
        return None
    return float(even @ even) / power


# Where model and measurement disagree, and how the drive moves there -----------------------------------------


STRETCH_WINDOWS = 24
"""Number of windows into which each record is cut; adjacent windows of one kind become one stretch."""

LISTED_STRETCHES = 12
"""Maximum number of stretches listed: as many as a reader will look at."""


def worst(items: Sequence[Item], errors: Sequence[Array], noise: float) -> tuple[Stretch, ...]:
    """The worst stretches of all records, the largest rms first."""
    found = [each for item, error in zip(items, errors, strict=True) for each in _stretches(item, error, noise)]
    return tuple(sorted(found, key=lambda each: -each.rms)[:LISTED_STRETCHES])


def _stretches(item: Item, error: Array, noise: float) -> list[Stretch]:
    """The windows of a record with errors above the noise; adjacent ones of the same kind are joined."""
    kind_of = _Kinds(item)
    merged: list[tuple[int, int, float, str]] = []
    edges = np.linspace(0, len(error), STRETCH_WINDOWS + 1).astype(int)
    for a, b in itertools.pairwise(edges.tolist()):
        part = error[a:b]
        known = np.isfinite(part)
        rms = float(np.sqrt(np.mean(part[known] ** 2))) if known.any() else 0.0
        if rms <= acceptance.STRETCH_ABOVE_NOISE * noise or rms == 0.0:
            continue
        kind = kind_of(a, b)
        if merged and merged[-1][1] == a and merged[-1][3] == kind:
            first, _, before, _ = merged.pop()
            width, own = a - first, b - a
            a, rms = first, float(np.sqrt((before**2 * width + rms**2 * own) / (width + own)))
        merged.append((a, b, rms, kind))
    t = item.run.t
    return [Stretch(item.name, kind, (float(t[a]), float(t[b - 1])), rms) for a, b, rms, kind in merged]


class _Kinds:
    """The kind of motion of a record's drive in samples [a, b): `after_step`, `range_end`, `fast` or `moving`."""

    def __init__(self, item: Item) -> None:
        self._v = item.run.v
        self._holds = still(item.run.v, max(16, len(item.y) // 100))
        self._rate = np.abs(np.gradient(item.run.v, item.run.t))
        self._fast = float(np.quantile(self._rate, acceptance.FAST_QUANTILE))
        low, high = float(item.run.v.min()), float(item.run.v.max())
        self._low = low + acceptance.RANGE_END * (high - low)
        self._high = high - acceptance.RANGE_END * (high - low)

    def __call__(self, a: int, b: int) -> str:
        held = sum(max(0, min(b, last) - max(a, first)) for first, last in self._holds)
        if held > 0.5 * (b - a):
            return "after_step"
        v = self._v[a:b]
        if np.mean((v > self._high) | (v < self._low)) > acceptance.RANGE_END_SHARE:
            return "range_end"
        return "fast" if self._fast > 0.0 and float(np.mean(self._rate[a:b])) > self._fast else "moving"
