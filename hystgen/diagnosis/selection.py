"""Grey-box forward selection: which effects remove the gap on records that took no part in the fit."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis import structure as fits
from hystgen.diagnosis.options import Option, about, front_name, options
from hystgen.diagnosis.structure import Fitted, Item, Structure
from hystgen.effects.base import Effect
from hystgen.identification.fronts import Straight
from hystgen.identification.uncertainty import correlation_time

Array = NDArray[np.float64]

SCREENED = 12_000
"""Samples compared while the many shapes are told apart."""

FIRST_STEPS, SCREENING_STEPS = 2, 4
"""Steps of a search from each start, and in all from the best one, while the shapes are told apart."""

KEPT, ALSO = 5, 2
"""Shapes that are followed up after the screening: the best on held-out records, and others that fit best."""

SHAPES = 2
"""Of one effect no more than so many."""

ROUNDS = 5

SHARE = 0.05
"""Least share of the refitted gap that an effect has to remove to get a name."""

ABOVE_NOISE = 0.6
"""The part that it removes has an rms of at least so many times what is left, or the noise if that is more."""

SURE = 1e-3
"""Largest p-value of the difference in held-out error."""

ALIKE = 0.05
"""Effects whose held-out rms lies within this share of the best one's cannot be told apart from it."""

SIMPLER = 0.02
"""A shape with fewer numbers is taken for one whose held-out rms is better by less than this share."""

AT_FLOOR = 1.05
"""A held-out error within this factor of the noise leaves nothing to explain."""


@dataclass(frozen=True)
class Found:
    """An effect that was accepted, and the held-out rms before and after it."""

    name: str
    label: str
    before: float
    after: float
    p_value: float
    rivals: tuple[str, ...]


@dataclass(frozen=True)
class Tried:
    """An option followed up: what it gives on held-out records."""

    option: Option
    fitted: Fitted
    name: str
    held_out: float
    errors: list[Array]

    @property
    def numbers(self) -> int:
        """How many numbers it takes."""
        return len(self.fitted.shape)


@dataclass(frozen=True)
class Outcome:
    """The believed model refitted, what was found, the model after it, and the ranking of each round."""

    refitted: Fitted
    fitted: Fitted
    found: tuple[Found, ...]
    rankings: tuple[tuple[Tried, ...], ...]


def select(
    to_fit: Sequence[Item],
    held: Sequence[Item],
    base: Structure,
    start: Array,
    noise: float,
    user: Sequence[type[Effect]] = (),
    tick: Callable[[], None] = lambda: None,
) -> Outcome:
    """Refit the believed structure, then add effects as long as one qualifies."""
    refitted = now = fits.fit(base, to_fit, start, _first_weights(base, to_fit, start))
    every = max(1, sum(int(np.count_nonzero(item.known)) for item in to_fit) // SCREENED)
    thin = [item.thinned(every) for item in to_fit]
    thin_held = [item.thinned(every) for item in held]
    known = about(to_fit, base.thresholds)
    found: list[Found] = []
    rankings: list[tuple[Tried, ...]] = []
    gap = fits.rms(now.errors(held))
    for _ in range(ROUNDS):
        before = fits.rms(now.errors(held))
        if before <= AT_FLOOR * noise:
            break
        tried = _followed_up(now, _screened(now, thin, thin_held, options(now, known, user), tick), to_fit, held, tick)
        if not tried:
            break
        rankings.append(tuple(tried))
        best = _simplest(tried)
        # what the effect leaves free in a record must not count as its merit
        errors = now.errors(held, best.fitted)
        equal = fits.rms(errors)
        p_value = difference(errors, best.errors)
        removed = math.sqrt(max(equal**2 - best.held_out**2, 0.0))
        if p_value > SURE or removed < ABOVE_NOISE * max(noise, best.held_out) or equal - best.held_out < SHARE * gap:
            break
        margin = ALIKE * best.held_out
        rivals = [t.name for t in tried if t.name != best.name and t.held_out <= best.held_out + margin]
        found.append(
            Found(best.name, best.option.label, before, best.held_out, p_value, tuple(dict.fromkeys(rivals)))
        )
        now = best.fitted
        now, found = _without_needless(now, found, to_fit, held, noise)
    return Outcome(refitted, now, tuple(found), tuple(rankings))


def _first_weights(base: Structure, to_fit: Sequence[Item], start: Array) -> Array:
    from hystgen.identification import weights

    ones = np.ones(len(base.thresholds))
    system = fits.linear(base, to_fit, start, ones).system.whole
    return weights.non_negative(system, np.arange(len(ones)))


def _screened(
    now: Fitted,
    thin: Sequence[Item],
    held: Sequence[Item],
    found: Sequence[Option],
    tick: Callable[[], None],
) -> list[tuple[Option, Fitted]]:
    """The options after a few steps on thinned records: the best shapes on what was fitted, and on what was not."""
    tried: list[tuple[float, Option, Fitted]] = []
    for option in found:
        tick()
        begun = [fits.fit(option.structure, thin, start, now.weights, FIRST_STEPS) for start in option.starts]
        best = min(begun, key=lambda each: each.rms)
        fitted = fits.fit(option.structure, thin, best.shape, best.weights, SCREENING_STEPS - FIRST_STEPS)
        if math.isfinite(fitted.rms):
            tried.append((fits.rms(fitted.errors(held)), option, fitted))
    kept: list[tuple[Option, Fitted]] = []
    by_held_out, by_fit = sorted(tried, key=lambda one: one[0]), sorted(tried, key=lambda one: one[2].rms)
    for order, most in ((by_held_out, KEPT), (by_fit, KEPT + ALSO)):
        for _, option, fitted in order:
            if len(kept) == most:
                break
            if sum(other.name == option.name for other, _ in kept) < SHAPES and all(o is not option for o, _ in kept):
                kept.append((option, fitted))
    return kept


def _followed_up(
    now: Fitted,
    kept: Sequence[tuple[Option, Fitted]],
    to_fit: Sequence[Item],
    held: Sequence[Item],
    tick: Callable[[], None],
) -> list[Tried]:
    """The options fitted to everything and run over the held-out records, the best one first."""
    tried = []
    for option, screened in kept:
        tick()
        fitted = fits.fit(option.structure, to_fit, screened.shape, screened.weights)
        if fitted.rms >= now.rms:
            continue
        errors = fitted.errors(held)
        name = option.name
        if option.front:
            drive = about(to_fit, now.structure.thresholds).drive
            name = front_name(fitted.structure.front, fitted.structure.pieces(fitted.shape)[0], drive)
        tried.append(Tried(option, fitted, name, fits.rms(errors), errors))
    return sorted(tried, key=lambda each: each.held_out)


def _simplest(tried: Sequence[Tried]) -> Tried:
    """The best, or one of fewer numbers that is about as good."""
    near = [each for each in tried if each.held_out <= (1.0 + SIMPLER) * tried[0].held_out]
    return min(near, key=lambda each: (each.numbers, each.held_out))


def _without_needless(
    now: Fitted, found: list[Found], to_fit: Sequence[Item], held: Sequence[Item], noise: float
) -> tuple[Fitted, list[Found]]:
    """Drop effects accepted earlier that those accepted later have made needless."""
    for k in range(len(found) - 1):
        name = found[k].name
        smaller = _less(now, name)
        if smaller is None:
            continue
        structure, start = smaller
        fitted = fits.fit(structure, to_fit, start, now.weights)
        with_it, without = fits.rms(now.errors(held)), fits.rms(fitted.errors(held))
        if math.sqrt(max(without**2 - with_it**2, 0.0)) < 0.5 * ABOVE_NOISE * noise:
            rest = [each for each in found if each.name != name]
            # each step of the gap is between two models that there are
            rest = [replace(each, before=found[k].before) if each is rest[k] else each for each in rest]
            rest[-1] = replace(rest[-1], after=without)
            return _without_needless(fitted, rest, to_fit, held, noise)
    return now, found


def _less(now: Fitted, name: str) -> tuple[Structure, Array] | None:
    """The structure without one effect, and where its search starts."""
    front_shape, numbers = now.structure.pieces(now.shape)
    parts = [(part, x) for part, x in zip(now.structure.parts, numbers, strict=True) if part.name != name]
    if len(parts) < len(now.structure.parts):
        kept = tuple(part for part, _ in parts)
        return replace(now.structure, parts=kept), np.concatenate([front_shape, *(x for _, x in parts)])
    if name in ("asymmetry", "saturation") and len(front_shape):
        return replace(now.structure, front=Straight()), np.concatenate([np.empty(0), *numbers])
    return None


def difference(before: Sequence[Array], after: Sequence[Array]) -> float:
    """One-sided p-value of smaller squared errors after than before, over blocks longer than the errors remember.

    Wilcoxon's signed-rank test: what an effect explains may sit in a few events, so that the mean alone is no measure.
    """
    from scipy.stats import wilcoxon

    gains = []
    for a, b in zip(before, after, strict=True):
        known = np.isfinite(a) & np.isfinite(b)
        gain = a[known] ** 2 - b[known] ** 2
        if len(gain) < 4:
            continue
        size = int(min(max(1, round(2.0 * correlation_time(gain))), max(1, len(gain) // 20)))
        edges = np.arange(0, len(gain) - size + 1, size)
        gains.append(np.add.reduceat(gain[: edges[-1] + size], edges) / size)
    blocks = np.concatenate(gains) if gains else np.empty(0)
    if len(blocks) < 6 or not np.any(blocks):
        return 1.0
    return float(wilcoxon(blocks, alternative="greater").pvalue)
