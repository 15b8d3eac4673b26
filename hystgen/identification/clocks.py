"""Drive and sensor on separate clocks: the delay between them grows steadily along the record.

A delay d adds `-d y'` to the output. A fit of plays, whose weights may drift, gives each section of the record its own
delay; if the clocks differ by a skew s, these delays lie on a straight line over time with the slope s. A lag of the
sensor has no slope; creep, ageing and warming move weights and offsets rather than delays, and slow down; and a delay
that depends on the speed or the amplitude of the drive varies with these, which distinguishes it from the line.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hystgen.basics import arguments, parallel
from hystgen.basics.problems import counted
from hystgen.identification import pi
from hystgen.plays import operators
from hystgen.records import Record

Array = NDArray[np.float64]

LARGEST = 3e-3
"""[s per s] A larger slope is not a clock skew: crystals are within 1e-4, software timing within about 1e-3. The
records of a steering mirror near its resonances would show 9e-3."""

EXPLAINED = 0.9
"""[fraction of the variance] Plays with delays that explain less of the output than this say nothing about delays."""

SECTIONS = 12
"""Sections of a record, each with a delay of its own."""
PLAYS = 8
"""Plays in the fit."""

ROWS = 6000
"""[samples] Number compared in a fit."""
SCREENED = 1500
"""[samples] Number compared in the first fit, which decides whether a closer look is worthwhile."""

MOST = 100_000
"""[samples] A longer record is thinned evenly to about this many."""

SUSPECT, SURE, UNLIKE_SURE = 3.0, 6.0, 12.0
"""[standard deviations] Limits above which a skew is examined closely, and reported; with 10 degrees of freedom, chance
exceeds 6 in one of 8000 records. If the drive's speed or amplitude changes along the record, an ageing actuator behind
a lag reaches 6.8, and one whose loop widens by half 11: for such records the limit is doubled."""

STRAIGHT = 0.9
"""The line explains more than this fraction of the variance of the sections' delays beyond their errors."""

UNLIKE = 0.05
"""[fraction] Sections whose drive differs by more than this in speed or amplitude may differ in delay for that
reason."""

LONG = 40.0
"""[turns of the drive] In longer records the delay may grow beyond the reach of a linear fit: their beginning is fitted
first."""

STEPS, NEAR = 8, 0.3
"""[secant steps] Maximum number, and [standard deviations] the growth that may remain."""

FEWEST = 240
"""[samples] Shorter records show no skew."""


@dataclass(frozen=True)
class Skew:
    """The growth of the delay of y after v, in seconds per second; `half`: half the width of its 95 % interval."""

    slope: float
    half: float

    def sentence(self, record: Record) -> str:
        """The finding, without the correction."""
        grows = abs(self.slope) * float(record.t[-1] - record.t[0])
        what = "falls behind v" if self.slope > 0.0 else "runs ahead of v"
        return (
            f"y {what} evenly, by {1e3 * grows:.3g} ms over the record: the clocks of drive and sensor differ by "
            f"{1e6 * self.slope:.0f} +-{1e6 * self.half:.0f} ppm (95 %)"
        )


AUTO = "auto"
"""The value that asks for the skew found in each record."""


def checked(asked: float | str | None) -> float | str | None:
    """The option `clock_skew`. Raises ValueError and TypeError."""
    if asked is None or asked == AUTO:
        return asked
    if isinstance(asked, str):
        raise ValueError(f"clock_skew must be a number of ppm or '{AUTO}', not '{asked}'")
    ppm = arguments.real("clock_skew", asked, "ppm")
    if not abs(ppm) <= 1e6 * LARGEST:
        raise ValueError(f"clock_skew must be from -{1e6 * LARGEST:.0f} to {1e6 * LARGEST:.0f} ppm, not {ppm:g}")
    return ppm


def told(record: Record, asked: float | str | None) -> Record:
    """The record with a note about its skew, which is removed if `asked`: a number of ppm, or `auto` for its own."""
    if asked is None or asked == AUTO:
        found = skew(record)
        if found is None:
            return record
        said = found.sentence(record)
        if asked is None:
            advice = "sample both with one clock, or remove it with --clock-skew auto"
            return replace(record, notes=(*record.notes, f"{said}; {advice}"))
        slope = found.slope
    else:
        slope, said = 1e-6 * float(asked), f"a clock skew of {asked:g} ppm, as given"
    if record.y is None or slope == 0.0:
        return record
    y = without(record.t, np.asarray(record.y, dtype=np.float64), slope)
    last = len(y) - int(np.argmax(np.isfinite(y[::-1])))
    lost = f", with the last {counted(len(y) - last, 'sample')}" if last < len(y) else ""
    return replace(replace(record, y=y).section(0, last), notes=(*record.notes, f"{said}; taken out{lost}"))


def skew(record: Record) -> Skew | None:
    """The skew of a record's clocks, None if no significant skew is found."""
    if record.y is None or not record.timed or len(record) < FEWEST or len(record.v) != len(record):
        return None
    t, v, y = (np.asarray(x, dtype=np.float64) for x in (record.t, record.v, record.y))
    if not (np.isfinite(v).all() and np.isfinite(y).all()) or np.ptp(v) == 0.0 or np.ptp(y) == 0.0:
        return None
    every = max(1, len(t) // MOST)
    # in fractions of their ranges: squares in an odd unit could overflow, and a delay depends on neither unit
    t, v, y = t[::every] - t[0], v[::every] / np.ptp(v), y[::every] / np.ptp(y)
    with parallel.one_thread():
        turns = len(pi.corners(v))
        if turns < 4:
            return None
        found = _growth(t, v, y, SCREENED)
        if turns <= LONG and (found is None or abs(found.slope) < SUSPECT * found.deviation):
            return None
        halvings = int(np.ceil(np.log2(max(turns / LONG, 1.0))))
        slope = 0.0
        for part in (0.5**k for k in range(halvings, 0, -1)):
            some = slice(0, max(int(part * len(t)), FEWEST))
            found = _growth(t[some], v[some], without(t[some], y[some], slope), SCREENED)
            slope += found.slope if found is not None else 0.0
        whole = _settled(t, v, y, slope)
    if whole is None:
        return None
    slope, found = whole
    line = abs(slope) * float(np.std(found.times))
    sure = UNLIKE_SURE if found.unlike else SURE
    if found.explained < EXPLAINED or abs(slope) < sure * found.deviation:
        return None
    if found.excess**2 > (1.0 - STRAIGHT) * line**2:
        return None
    return Skew(slope, 1.96 * found.deviation)


def _settled(t: Array, v: Array, y: Array, slope: float) -> tuple[float, _Growth] | None:
    """The slope whose correction leaves no growth, by secants, and the remaining growth; None if not found."""
    before: tuple[float, float] | None = None
    for _ in range(STEPS):
        if not abs(slope) <= LARGEST:
            return None
        found = _growth(t, v, without(t, y, slope), ROWS)
        if found is None:
            return None
        if abs(found.slope) < NEAR * found.deviation:
            return slope + found.slope, found
        rate = 1.0
        if before is not None and before[1] != found.slope:
            rate = min(max((slope - before[0]) / (before[1] - found.slope), 0.3), 5.0)
        before = slope, found.slope
        slope += rate * found.slope
    return None


def without(t: Array, y: Array, slope: float) -> Array:
    """The output (N,) without a delay that grows by `slope` from the first sample on; NaN where it was not measured."""
    if slope == 0.0:
        return y
    from scipy.interpolate import Akima1DInterpolator

    return np.asarray(Akima1DInterpolator(t, y)(t + slope * (t - t[0])))


@dataclass(frozen=True)
class _Growth:
    """The `slope` of the sections' delays over their mid `times` and its standard deviation, and the part of their
    scatter about the line that exceeds their own errors, s; `unlike`: the drive changes along the record; `explained`:
    fraction of the output's variance that the fit explains."""

    slope: float
    deviation: float
    excess: float
    times: Array
    unlike: bool
    explained: float


def _growth(t: Array, v: Array, y: Array, most: int) -> _Growth | None:
    """The growth of the delay; None if the records cannot tell. `most`: samples compared."""
    last = len(y) - int(np.argmax(np.isfinite(y[::-1])))
    t, v, y = t[:last], v[:last], y[:last]
    r = np.linspace(0.0, pi.loop_reach(float(np.ptp(v))), PLAYS + 1)
    plays = operators.plays(v, r, np.full(len(r), v[0]))
    swept = np.maximum.accumulate(v) - np.minimum.accumulate(v) >= 2.0 * r[-1]
    first = int(np.argmax(swept)) if swept[-1] else 0
    first = first if first < len(v) // 3 else 0
    some = np.unique(np.linspace(first, len(v) - 1, most).astype(np.intp))
    if len(some) < FEWEST:
        return None
    about = (t[some] - t[some[0]]) / (t[some[-1]] - t[some[0]]) * 2.0 - 1.0
    plain = np.column_stack([plays[:, some].T, np.ones(len(some)), about])
    weights, *_ = np.linalg.lstsq(plain, y[some], rcond=pi.SENSED_RANK)
    speed = np.gradient(weights[: len(r)] @ plays, t)[some]
    drifting = np.column_stack([plain, about[:, None] ** 2, plays[:, some].T * about[:, None]])
    section = np.minimum(((about + 1.0) * 0.5 * SECTIONS).astype(int), SECTIONS - 1)
    if np.ptp(y[some]) == 0.0:
        return None
    delayed = -speed[:, None] * (section[:, None] == np.arange(SECTIONS))
    # fit the sections' delays beside everything else: project the rest out of both sides
    basis, *_ = np.linalg.svd(drifting / np.maximum(np.linalg.norm(drifting, axis=0), 1e-300), full_matrices=False)
    inner = delayed - basis @ (basis.T @ delayed)
    target = y[some] - basis @ (basis.T @ y[some])
    normal = inner.T @ inner
    if np.min(np.diag(normal)) <= 0.0 or np.linalg.cond(normal) > 1e12:
        return None
    covariance = np.linalg.inv(normal)
    delays = covariance @ (inner.T @ target)
    left = target - inner @ delays
    covariance *= float(left @ left) / max(len(left) - drifting.shape[1] - SECTIONS, 1)
    times = np.array([np.mean(t[some][section == k]) for k in range(SECTIONS)])
    table = np.column_stack([times - np.mean(times), np.ones(SECTIONS), *_unlike(t[some], v[some], section)])
    root = np.linalg.inv(np.linalg.cholesky(covariance))
    scaled, wanted = root @ table, root @ delays
    line, *_ = np.linalg.lstsq(scaled, wanted, rcond=None)
    over = wanted - scaled @ line
    free = SECTIONS - table.shape[1]
    spread = float(over @ over) / free
    deviation = float(np.sqrt(np.linalg.inv(scaled.T @ scaled)[0, 0] * max(spread, 1.0)))
    usual = float(np.mean(np.diag(covariance)))
    excess = float(np.sqrt(max(spread - 1.0, 0.0) * usual))
    explained = 1.0 - float(np.var(left) / np.var(y[some]))
    return _Growth(float(line[0]), deviation, excess, times, table.shape[1] > 2, explained)


def _unlike(t: Array, v: Array, section: NDArray[np.intp]) -> list[Array]:
    """Logarithms of the drive's speed and amplitude in each section, (SECTIONS,) about their means, where they vary."""
    found = []
    rate = np.gradient(v, t)
    for x in (rate, v):
        size = np.array([np.std(x[section == k]) for k in range(SECTIONS)])
        size = np.log(np.maximum(size, 1e-3 * np.max(size)))
        if np.ptp(size) > UNLIKE:
            found.append(size - np.mean(size))
    return found
