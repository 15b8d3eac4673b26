"""Disturbances in a model's errors: spectral lines, position-dependent ripple and stick-slip.

Lines and ripples that dominate the errors are removed from the records: hum hides effects, and a ripple would be
mistaken for effects or stick-slip. Stick-slip is reported with its location and count, but never named as an effect.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.data.items import FittedLike, Item
from hystgen.diagnosis.data.preparing import Prepared
from hystgen.diagnosis.data.signals import converter_step, peaks, still
from hystgen.diagnosis.findings.kinds import Line, Ripple, StickSlip
from hystgen.diagnosis.search import acceptance

Array = NDArray[np.float64]


# Lines over time: mains hum and other steady tones -----------------------------------------------------------


MAINS = (50.0, 60.0)
"""[Hz] Mains frequencies used worldwide."""

MAINS_HARMONICS = (1, 2, 3, 5)
"""Harmonics found in power supplies: 2 comes from rectifiers, 3 and 5 from transformer cores."""


@dataclass(frozen=True)
class Removed:
    """A line or ripple, the errors without it, and its fraction of the variance of all errors."""

    finding: Line | Ripple
    errors: list[Array]
    share: float


def removed_share(before: Sequence[Array], after: Sequence[Array]) -> float:
    """Fraction by which the power of the errors falls from `before` to `after`."""
    total = _power(before)
    return 1.0 - _power(after) / total if total > 0.0 else 0.0


def _power(errors: Sequence[Array]) -> float:
    return float(sum(np.nansum(e**2) for e in errors))


def in_time(items: Sequence[Item], errors: Sequence[Array]) -> Removed | None:
    """The strongest line that enough of the long records show, or that dominates the errors of a few records."""
    found: list[tuple[float, float, int]] = []
    for k, (item, error) in enumerate(zip(items, errors, strict=True)):
        found += [(share, frequency, k) for share, frequency in peaks(item, error) if not _logged(item, frequency)]
    times = [item.run.t[np.isfinite(e)] for item, e in zip(items, errors, strict=True)]
    lengths = [float(np.ptp(t)) if len(t) > acceptance.LINE_SAMPLES else 0.0 for t in times]
    rates = [1.0 / float(np.median(np.diff(item.run.t))) for item in items]
    best: tuple[float, float, list[int], list[int]] | None = None
    for _, frequency, k in found:
        near = [p for p in found if abs(p[1] - frequency) < acceptance.SAME_BINS / min(lengths[p[2]], lengths[k])]
        seen = sorted({p[2] for p in near})
        able = [
            j for j, n in enumerate(lengths)
            if n * frequency >= acceptance.LINE_PERIODS and 2.0 * frequency <= rates[j]
        ]
        strength = sum(p[0] for p in near)
        common = len(seen) >= max(2, acceptance.SEEN_IN * len(able)) or len(able) == len(seen)
        rules = min(p[0] for p in near) > acceptance.RULING_SHARE
        if (common or rules) and (best is None or strength > best[0]):
            longest = max(near, key=lambda p: lengths[p[2]])  # the longest record gives the most accurate frequency
            best = strength, longest[1], seen, able
    if best is None:
        return None
    _, frequency, seen, able = best
    frequency = _refined(items, errors, frequency, seen, lengths)
    after, sizes, has = [], [], []
    for k, (item, error) in enumerate(zip(items, errors, strict=True)):
        if lengths[k] * frequency < 2.0:  # a line needs at least two periods
            after.append(error)
            continue
        e, size = _without(error, _phase(item, frequency))
        after.append(e)
        if k in seen or (k in able and removed_share([error], [e]) > acceptance.LINE_SHARE):
            has.append(k)
        # two samples per period do not show the amplitude
        resolved = acceptance.AMPLITUDE_SAMPLES * frequency
        if k in seen and (resolved < rates[k] or all(resolved > rates[j] for j in seen)):
            sizes.append(size)
    finding = Line(
        frequency=float(f"{frequency:.4g}"),
        amplitude=float(np.median(sizes)),
        share=removed_share([errors[k] for k in has], [after[k] for k in has]),
        records=tuple(dict.fromkeys(items[k].name for k in has)),
        mains=_mains(frequency, 0.5 / max(lengths[k] for k in seen)),
    )
    return Removed(finding, after, removed_share(errors, after))


def _logged(item: Item, frequency: float) -> bool:
    """Whether a logged column has this line too, so that the column may cause it; mains hum reaches every channel."""
    width = 1.0 / max(float(np.ptp(item.run.t)), 1e-300)
    if _mains(frequency, width) is not None:
        return False
    lines = (line for column in item.run.extra.values() for _, line in peaks(item, column))
    return any(abs(line - frequency) < acceptance.SAME_BINS * width for line in lines)


def _mains(frequency: float, width: float) -> float | str | None:
    """The mains frequency that a line matches, or the harmonic as text; `width`: uncertainty of its frequency, Hz."""
    for mains in MAINS:
        for n in MAINS_HARMONICS:
            if abs(frequency - n * mains) < max(width, acceptance.MAINS_TOLERANCE * frequency):
                return mains if n == 1 else f"{n} x {mains:g} Hz"
    return None


def mains(items: Sequence[Item], values: Sequence[Array]) -> list[float]:
    """Frequencies in Hz of the mains lines in signals of the records, at most one for each harmonic looked for."""
    found: list[float] = []
    if not all(item.timed for item in items):
        return found
    for _ in MAINS_HARMONICS:
        line = in_time(items, values)
        if line is None or not isinstance(line.finding, Line) or line.finding.mains is None:
            break
        found.append(line.finding.frequency)
        values = line.errors
    return found


def steady(items: Sequence[Item], errors: Sequence[Array]) -> Removed | None:
    """The strongest line, if in most of the records that show it, each half predicts the line in the other.

    The actuator produces no such lines itself, since lines of the drive are excluded and ringing decays.
    """
    line = in_time(items, errors) if all(item.timed for item in items) else None
    if line is None or not isinstance(line.finding, Line):
        return None
    holds = 0
    having = [k for k, item in enumerate(items) if item.name in line.finding.records]
    for k in having:
        known = np.isfinite(errors[k])
        phase, e = _phase(items[k], line.finding.frequency)[known], errors[k][known]
        table = np.column_stack([np.cos(phase), np.sin(phase), np.ones(len(e))])
        half = len(e) // 2
        removed = 0.0
        for here, other in ((slice(half), slice(half, None)), (slice(half, None), slice(half))):
            wave = table[other, :2] @ np.linalg.lstsq(table[here], e[here], rcond=None)[0][:2]
            rest = e[other] - e[other].mean()
            removed += float(np.sum(rest**2) - np.sum((rest - wave) ** 2))
        own = np.sum((e - e.mean()) ** 2) - np.nansum(_without(e, phase)[0] ** 2)
        holds += bool(removed > acceptance.STEADY_SHARE * own)
    return line if holds >= acceptance.COMMON_SHARE * len(having) else None


def _refined(
    items: Sequence[Item], errors: Sequence[Array], frequency: float, seen: Sequence[int], lengths: Sequence[float]
) -> float:
    """The frequency at which a sine removes most of the errors."""
    places = frequency + np.linspace(-1.0, 1.0, 21) / max(lengths[k] for k in seen)
    for _ in range(2):
        removed = [
            sum(
                float(np.nansum(errors[k] ** 2) - np.nansum(_without(errors[k], _phase(items[k], f))[0] ** 2))
                for k in seen
            )
            for f in places
        ]
        best, step = float(places[int(np.argmax(removed))]), float(places[1] - places[0])
        places = best + np.linspace(-1.0, 1.0, 21) * step
    return best


def _phase(item: Item, frequency: float) -> Array:
    return np.asarray(2.0 * np.pi * frequency * (item.run.t - item.run.t[0]))


def _without(error: Array, phase: Array) -> tuple[Array, float]:
    """The error minus the best-fitting sinusoid of this phase, and the sinusoid's amplitude."""
    known = np.isfinite(error)
    table = np.column_stack([np.cos(phase[known]), np.sin(phase[known]), np.ones(int(np.count_nonzero(known)))])
    solution = np.linalg.lstsq(table, error[known], rcond=None)[0]
    residual = error.copy()
    residual[known] -= table[:, :2] @ solution[:2]
    return residual, float(np.hypot(solution[0], solution[1]))


# A ripple with a fixed pitch over the position: interpolation errors and converter steps ---------------------


MOST_SAMPLES = 20_000
"""Approximate number of samples used to refine a pitch, enough that only noise limits the accuracy."""

FINER = 4
"""Zero-padding factor for the spectrum over position: pitches between integer fractions of the range get bins too."""


@dataclass(frozen=True)
class _Motion:
    """The motion of a record at the compared samples, selected by `at`.

    `places`: predicted positions; `errors`: the errors at these positions; `moves`: change in the prediction since the
    previous sample, NaN during holds, which only repeat a position that the model was fitted to. Positions are
    predicted because a ripple that is large relative to its pitch is not sinusoidal over the measured position.
    """

    at: NDArray[np.bool_]
    places: Array
    errors: Array
    moves: Array

    @classmethod
    def of(cls, item: Item, error: Array) -> _Motion:
        """The motion of a record."""
        at = np.isfinite(error) & np.isfinite(item.y)
        predicted = item.y - error
        moves = np.diff(predicted, prepend=np.nan)
        for first, last in still(item.run.v, acceptance.HOLD_SAMPLES):
            moves[first + 1 : last] = np.nan
        return cls(at, predicted[at], error[at], moves[at])

    def resolves(self, pitch: float) -> NDArray[np.bool_]:
        """The samples that resolve a ripple of this pitch."""
        return np.asarray(np.abs(self.moves) < acceptance.RIPPLE_RESOLVED * pitch)


def in_position(items: Sequence[Item], errors: Sequence[Array]) -> Removed | None:
    """A ripple that follows the predicted position with the same phase in all records."""
    motions = [_Motion.of(item, error) for item, error in zip(items, errors, strict=True)]
    if sum(len(motion.places) for motion in motions) < acceptance.SPECTRUM_SAMPLES:
        return None
    low = min(float(motion.places.min()) for motion in motions if len(motion.places))
    span = max(float(motion.places.max()) for motion in motions if len(motion.places)) - low
    if span == 0.0:
        return None
    bins, periods = acceptance.POSITION_BINS, acceptance.LINE_PERIODS
    summed = np.zeros(bins)
    for motion in motions:
        now = motion.resolves(span / periods)
        if now.any():
            place = np.minimum(((motion.places[now] - low) / span * bins).astype(int), bins - 1)
            summed += np.bincount(place, motion.errors[now] - motion.errors[now].mean(), bins)
    power = np.abs(np.fft.rfft(summed, FINER * bins)) ** 2
    power[: FINER * periods] = 0.0
    power[2 * bins // FINER :] = 0.0
    reach, away = FINER * acceptance.SURROUNDINGS, FINER * 3
    for k in _highest(power, acceptance.PITCHES):
        around = np.concatenate(
            [power[max(k - reach, FINER * periods) : k - away], power[k + away + 1 : k + reach]]
        )
        if not len(around) or power[k] <= acceptance.LINE_HEIGHT * float(np.median(around)):
            continue
        found = _ripple(items, errors, motions, _pitch(motions, FINER * span / k))
        if found is not None:
            return found
    return None


def _highest(power: Array, most: int) -> list[int]:
    found: list[int] = []
    for k in np.argsort(power)[::-1].tolist():
        if len(found) == most or power[k] == 0.0:
            break
        if all(abs(k - other) > 2 * FINER for other in found):
            found.append(k)
    return found


def _pitch(motions: Sequence[_Motion], pitch: float) -> float:
    """The pitch whose ripple removes most of the errors."""
    parts = [(motion, now) for motion, now in ((motion, motion.resolves(pitch)) for motion in motions) if now.any()]
    if not parts:
        return pitch
    every = max(1, sum(int(np.count_nonzero(now)) for _, now in parts) // MOST_SAMPLES)
    y = np.concatenate([motion.places[now][::every] for motion, now in parts])
    e = np.concatenate([motion.errors[now][::every] - motion.errors[now].mean() for motion, now in parts])

    def removed(waves: float) -> float:
        table = np.column_stack([np.cos(2.0 * np.pi * waves * y), np.sin(2.0 * np.pi * waves * y)])
        right = table.T @ e
        return float(right @ np.linalg.lstsq(table.T @ table, right, rcond=None)[0])

    best, step = 1.0 / pitch, 0.05 / max(float(np.ptp(y)), pitch)
    for _ in range(2):
        places = best + step * np.arange(-10, 11)
        best, step = float(max(places, key=removed)), 0.1 * step
    return 1.0 / best


def _ripple(
    items: Sequence[Item], errors: Sequence[Array], motions: Sequence[_Motion], pitch: float
) -> Removed | None:
    """The ripple, if most passes (up or down over several pitches) show the ripple that all the others predict.

    An error due to a lag or a hysteresis loop, by contrast, differs between upward and downward passes.
    """
    tables = [
        np.column_stack([np.cos(2.0 * np.pi * motion.places / pitch), np.sin(2.0 * np.pi * motion.places / pitch)])
        for motion in motions
    ]
    pieces, parts = [], []
    for k, (motion, table) in enumerate(zip(motions, tables, strict=True)):
        for way in (1.0, -1.0):
            now = motion.resolves(pitch) & (way * motion.moves > 0.0)
            passed = np.sum(np.abs(motion.moves[now])) / pitch
            if np.count_nonzero(now) > acceptance.PASS_SAMPLES and passed > acceptance.PASS_PITCHES:
                pieces.append((table[now], motion.errors[now] - motion.errors[now].mean()))
                parts.append(k)
    if len(pieces) < 2:
        return None
    squares = [(x.T @ x, x.T @ e) for x, e in pieces]
    matrix, right = sum(s[0] for s in squares), sum(s[1] for s in squares)
    holds = 0
    for (x, e), (own, own_right) in zip(pieces, squares, strict=True):
        others = np.linalg.lstsq(matrix - own, right - own_right, rcond=None)[0]
        holds += bool(np.sum((e - x @ others) ** 2) < (1.0 - acceptance.LINE_SHARE) * np.sum(e**2))
    solution = np.linalg.lstsq(matrix, right, rcond=None)[0]
    if holds < acceptance.COMMON_SHARE * len(pieces) or all(_quantised(items[k].y, pitch) for k in parts):
        return None
    share = removed_share([e for _, e in pieces], [e - x @ solution for x, e in pieces])
    if share < acceptance.LINE_SHARE:
        return None
    after = []
    for error, motion, table in zip(errors, motions, tables, strict=True):
        e = error.copy()
        e[motion.at] -= table @ solution
        after.append(e)
    finding = Ripple(
        pitch=float(f"{pitch:.4g}"),
        amplitude=float(np.hypot(solution[0], solution[1])),
        share=share,
        records=tuple(dict.fromkeys(items[k].name for k in parts)),
    )
    return Removed(finding, after, share)


def _quantised(y: Array, pitch: float) -> bool:
    """Whether a pitch is the converter's step or a whole fraction of it, which is resolution, not ripple."""
    parts = converter_step(y) / pitch
    return bool(np.isfinite(parts) and parts > 0.5 and abs(parts / round(parts) - 1.0) < acceptance.CONVERTER_STEP)


# The strongest line or ripple first --------------------------------------------------------------------------


Way = Callable[[Sequence[Item], Sequence[Array]], Removed | None]


def lines(items: Sequence[Item], errors: Sequence[Array]) -> tuple[list[Line | Ripple], list[Array]]:
    """Lines in the errors of several records, the strongest first, and the errors without them."""
    return _strongest_first(items, errors, (in_time, in_position), 0.0)


def ruling(items: Sequence[Item], errors: Sequence[Array]) -> tuple[list[Line | Ripple], list[Array]]:
    """Like `lines`, but only for steady lines and ripples that dominate the errors, not caused by the actuator."""
    return _strongest_first(items, errors, (steady, in_position), acceptance.RULING_SHARE)


def _strongest_first(
    items: Sequence[Item], errors: Sequence[Array], ways: Sequence[Way], least: float
) -> tuple[list[Line | Ripple], list[Array]]:
    remaining, found = list(errors), []
    for _ in range(acceptance.MOST_LINES):
        seen = [line for line in (way(items, remaining) for way in ways) if line is not None and line.share >= least]
        if not seen:
            break
        best = max(seen, key=lambda line: line.share)
        found.append(best.finding)
        remaining = best.errors
    return found, remaining


# Records without the lines and ripples that dominate their errors --------------------------------------------


Fitted = TypeVar("Fitted", bound=FittedLike)

ROUNDS = 3
"""Maximum number of removal rounds; more than one is needed because a model fitted with a ripple predicts wrong
positions until the ripple is removed."""


@dataclass(frozen=True)
class Cleaned:
    """Records as measured, the same records without their lines, and the lines themselves."""

    measured: Prepared
    clean: Prepared
    lines: tuple[Line | Ripple, ...] = ()

    def seen_by(self, fitted: FittedLike) -> Cleaned:
        """The measured records without the lines in a model's errors; its predictions locate the ripples."""
        measured, clean = _items(self.measured), _items(self.clean)
        errors = [
            error + (item.y - without.y)
            for item, without, error in zip(measured, clean, fitted.errors(clean), strict=True)
        ]
        found, remaining = ruling(measured, errors)
        items = [
            replace(item, y=item.y - (error - rest))
            for item, error, rest in zip(measured, errors, remaining, strict=True)
        ]
        number = len(self.measured.to_fit)
        lines = tuple(replace(line, repaired=True) for k, line in enumerate(found) if not is_known(line, found[:k]))
        return replace(self, clean=replace(self.measured, to_fit=items[:number], held=items[number:]), lines=lines)

    def left_by(self, fitted: FittedLike) -> bool:
        """Whether a model's errors on the cleaned records still show lines to remove."""
        clean = _items(self.clean)
        return bool(ruling(clean, fitted.errors(clean))[0])

    def notes(self, unit: str | None) -> list[str]:
        """Repairs made to the records, one sentence each."""
        return [line.sentence(unit) for line in self.lines]


def taken_out(found: Cleaned, fitted: Fitted, refit: Callable[[Prepared], Fitted]) -> Cleaned:
    """The records without the lines in a model's errors; the model is refitted to these records in every round."""
    for _ in range(ROUNDS):
        seen = found.seen_by(fitted)
        if not seen.lines:
            break
        found, fitted = seen, refit(_moving(seen.clean))
    return found


def _moving(ready: Prepared) -> Prepared:
    """The records without their holds, where a ripple is a constant offset that the fit would absorb unnoticed."""

    def without_holds(item: Item) -> Item:
        y = item.y.copy()
        for first, last in still(item.run.v, acceptance.HOLD_SAMPLES):
            y[first + 1 : last] = np.nan
        return replace(item, y=y) if np.count_nonzero(np.isfinite(y)) > acceptance.COMPARED_SAMPLES else item

    return replace(ready, to_fit=[without_holds(item) for item in ready.to_fit])


def is_known(line: Line | Ripple, others: Sequence[Line | Ripple]) -> bool:
    """Whether a line is the remainder of a known line."""
    return any(
        each.kind == line.kind and abs(line.place / each.place - 1.0) < acceptance.SAME_LINE for each in others
    )


def _items(ready: Prepared) -> list[Item]:
    return [*ready.to_fit, *ready.held]


# Stick-slip --------------------------------------------------------------------------------------------------


def stick_slip(items: Sequence[Item], errors: Sequence[Array], noise: float) -> list[StickSlip]:
    """Stick-slip: the output stands still while it should move, then catches up in a jump."""
    found = (_stick_slip(item, error, noise) for item, error in zip(items, errors, strict=True))
    return [each for each in found if each is not None]


def _stick_slip(item: Item, error: Array, noise: float) -> StickSlip | None:
    """Judge how often the output stands still or leaps where the predicted motion is well above the noise.

    The error due to a lag or ringing is smooth: it continues from one stretch to the next, whereas a leap makes up for
    the standstill before it. Also, the output hardly moves before and after a jump, whatever the model predicts.
    """
    known = np.isfinite(error) & np.isfinite(item.y)
    e, y = error[known], item.y[known]
    predicted = y - e
    move = np.abs(np.diff(predicted))
    moving = move > acceptance.SLIP_MOVING * float(np.quantile(move, 0.75)) if len(move) else move > 0.0
    if np.count_nonzero(moving) < 10 * acceptance.SLIP_JUMPS or noise <= 0.0:
        return None
    resolved = acceptance.SLIP_RESOLVED * noise
    m = max(1, int(np.ceil(resolved / float(np.median(move[moving])))))
    edges = np.arange(0, len(e), m)
    should, does = np.diff(predicted[edges]), np.diff(y[edges])
    slow, fast = acceptance.SLIP_STRETCH
    inside = (np.abs(should) > slow * resolved) & (np.abs(should) < fast * resolved)
    if np.count_nonzero(inside) < 5 * acceptance.SLIP_JUMPS:
        return None
    ratio = does[inside] / should[inside]
    off = acceptance.SLIP_OFF
    stands, leaps = float(np.mean(ratio < 1.0 - off)), float(np.mean(ratio > 1.0 + off))
    around = ratio - np.mean(ratio)
    again = float(around[1:] @ around[:-1]) / max(float(around @ around), 1e-300)
    if stands < acceptance.SLIP_STANDS or leaps < acceptance.SLIP_LEAPS or again > acceptance.SLIP_CONTINUES:
        return None
    step = np.diff(e)
    at = np.flatnonzero((np.abs(step) > resolved) & (np.sign(step) == np.sign(np.diff(predicted))))
    if np.count_nonzero(_alone(np.abs(np.diff(y)), at)) < max(acceptance.SLIP_JUMPS, 0.5 * len(at)):
        return None
    first = float(item.run.t[np.flatnonzero(known)[at[0] + 1]])
    return StickSlip(item.name, len(at), first, float(np.median(np.abs(step[at]))))


def _alone(moves: Array, at: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Whether each move far exceeds nearby ones, not counting adjacent ones, over which a filter can spread a jump."""
    beside = np.array([-5, -4, -3, -2, 2, 3, 4, 5])
    around = moves[np.clip(at[:, None] + beside, 0, len(moves) - 1)]
    return np.asarray(moves[at] > acceptance.SLIP_ALONE * np.median(around, axis=1))
