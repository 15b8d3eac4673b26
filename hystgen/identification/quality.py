"""Quality of a fit: the fit table, confidence intervals and warnings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.problems import counted
from hystgen.identification import joint, pi, reduction
from hystgen.identification.faults import white_noise
from hystgen.identification.gpi import FittedModel
from hystgen.identification.pi import FreeRunErrors, Weights
from hystgen.identification.reduction import Course
from hystgen.identification.start import STARTS, UNLIKE
from hystgen.parameters.schema import Residual
from hystgen.records import Record

Array = NDArray[np.float64]


# The fit table -----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class ErrorRow:
    """One line of the fit table.

    `part`: 'fit', 'held out' or 'all'; `model`: 'written' or 'trial'; `samples`: number compared; `ignored`: number not
    compared; `rms`, `max`: errors in output units with a free offset per record; `output_range`: the largest
    peak-to-peak output compared in any of the row's records, the 100 % of `rms_percent` and `max_percent`; both rows of
    a trial have the same range.
    """

    part: str
    model: str
    records: tuple[str, ...]
    samples: int
    ignored: int
    rms: float
    max: float
    output_range: float

    @classmethod
    def of(cls, part: str, model: str, errors: Sequence[FreeRunErrors]) -> ErrorRow:
        """The row that summarises the errors of some courses."""
        joined = np.concatenate([e.error for e in errors])
        joined = joined[np.isfinite(joined)]
        return cls(
            part,
            model,
            tuple(e.course.name for e in errors),
            len(joined),
            sum(e.course.first - e.course.begin for e in errors),
            float(np.sqrt(np.mean(joined**2))),
            float(np.max(np.abs(joined))),
            max(e.course.output_range for e in errors),
        )

    @property
    def rms_percent(self) -> float:
        """rms error in % of the output range."""
        return 100.0 * self.rms / self.output_range if self.output_range else 0.0

    @property
    def max_percent(self) -> float:
        """Largest error in % of the output range."""
        return 100.0 * self.max / self.output_range if self.output_range else 0.0

    def sentence(self) -> str:
        """The row as a sentence, for a comment."""
        return (
            f"{self.part}, {self.model} model ({', '.join(self.records)}; {self.samples} samples, "
            f"{self.ignored} ignored): rms {self.rms:.4g} ({self.rms_percent:.3g} %), "
            f"max {self.max:.4g} ({self.max_percent:.3g} %)"
        )


WORD_COLUMNS = (0, 1, 8)
"""Indices of the table's text columns."""


def cells(rows: Sequence[ErrorRow], unit: str) -> list[tuple[str, ...]]:
    """The table's header and rows."""
    suffix = f" [{unit}]" if unit else ""
    head = ("part", "model", "samples", "ignored", f"rms{suffix}", "rms %", f"max{suffix}", "max %", "records")
    body = [
        (
            row.part,
            row.model,
            str(row.samples),
            str(row.ignored),
            f"{row.rms:.4g}",
            f"{row.rms_percent:.3f}",
            f"{row.max:.4g}",
            f"{row.max_percent:.3f}",
            ", ".join(row.records),
        )
        for row in rows
    ]
    return [head, *body]


def table(rows: Sequence[ErrorRow], unit: str, remarks: Sequence[str]) -> str:
    """The rows in aligned columns, with the remarks below."""
    content = cells(rows, unit)
    widths = [max(len(line[k]) for line in content) for k in range(len(content[0]))]
    lines = [
        "  ".join(line[k].ljust(width) if k in WORD_COLUMNS else line[k].rjust(width) for k, width in enumerate(widths))
        for line in content
    ]
    return "\n".join([*(line.rstrip() for line in lines), *remarks]) + "\n"


def noise_of(courses: Sequence[Course]) -> float:
    """rms noise of the compared outputs, as far as it is white."""
    outputs = [item.y[item.compared] for item in courses]
    squares = sum(white_noise(y) ** 2 * len(y) for y in outputs if len(y) > 3)
    return float(np.sqrt(squares / max(sum(map(len, outputs)), 1)))


# Confidence intervals ----------------------------------------------------------------------------------------


REDRAWS = 1000
"""Number of fits with random signs of the residuals' blocks: the ends of a 95 % interval then scatter by 0.08 standard
deviations, which is sqrt(0.025 * 0.975/1000) divided by the normal density there."""

TAILS = (0.025, 0.975)
"""Quantiles of 95 % intervals."""

FEWEST_BLOCKS, MOST_BLOCKS = 40, 4000
"""Minimum number of blocks, however long the residuals' correlation, and maximum: more do not improve the intervals."""

MANY_WEIGHTS = 100
"""With more weights than this, zero weights stay zero in every redraw, so that one factorisation serves all redraws."""

MEMORY = 4.0
"""[correlation times of the residuals] Length of a block."""

SEED = 1
"""Seed of the random numbers, so that the same records give the same intervals."""

UNKNOWN = 1e-9
"""Singular values below this fraction of the largest belong to directions that the records do not determine; weights
are not redrawn in these. Results then agree to seven digits between linear algebra libraries, and four are shown."""


@dataclass(frozen=True)
class Intervals:
    """95 % intervals, and the redraws that they come from.

    `weights`: lower and upper end for each weight; `width`: for the widest loop; `held_out`: for the held-out rms
    error, None if nothing was held out; `redrawn`: the weights of every redraw (REDRAWS, n+1); `block`: samples per
    block.
    """

    weights: tuple[tuple[float, float], ...]
    width: tuple[float, float]
    held_out: tuple[float, float] | None
    redrawn: Array = field(compare=False)
    block: int

    def loading_curve(self, thresholds: Array, x: Array) -> tuple[Array, Array]:
        """Band around the initial loading curve (22) at the inputs x."""
        curves = np.maximum(x[:, None] - thresholds, 0.0) @ self.redrawn.T
        low, high = np.quantile(curves, TAILS, axis=1)
        return low, high


def intervals(
    fitted: FittedModel, courses: Sequence[Course], errors: Sequence[FreeRunErrors], held: Sequence[FreeRunErrors]
) -> Intervals:
    """Intervals of a fit to `courses` (drive as measured) with residuals `errors`; `held`: errors of held-out records.

    The residuals of a hysteresis model are coloured: model errors recur at every reversal. Residuals are therefore not
    redrawn one by one but in blocks longer than their correlation. A block enters the normal equations only by its
    score `X_b^T e_b`; random signs of all scores (a dependent wild bootstrap; Shao, Journal of the American Statistical
    Association 105, 2010, 218-235) redraw the record, and the weights of each redraw are found under the constraints of
    the fit. The cost does not grow with the number of samples.
    """
    r, p = fitted.solution.thresholds, fitted.solution.weights
    block = block_length([each.error for each in errors])
    source = joint.linear_source(fitted.front, fitted.shape, p, 1)
    unknowns = len(p) + len(fitted.shape)
    if len(fitted.shape):
        system = reduction.reduce(courses, r, None, source, len(fitted.shape)).whole
    else:
        system = reduction.reduce(courses, r).whole
    triangle = system[:unknowns, :unknowns]
    scores = np.concatenate(
        [_scores(source(item, r), item, each, block) for item, each in zip(courses, errors, strict=True)]
    )
    random = np.random.default_rng(SEED)
    signs = random.integers(0, 2, (REDRAWS, len(scores))) * 2.0 - 1.0
    lost = min(unknowns / len(scores), 0.5)  # a fit removes some of the scatter of the residuals
    moved = signs @ scores / np.sqrt(1.0 - lost)
    target = triangle[:, : len(p)] @ p
    back, *_ = np.linalg.lstsq(triangle.T, moved.T, rcond=UNKNOWN)
    if len(p) > MANY_WEIGHTS:
        active = np.flatnonzero(np.append(p > 0.0, np.ones(len(fitted.shape), dtype=bool)))
        found, *_ = np.linalg.lstsq(triangle[:, active], target[:, None] + back, rcond=UNKNOWN)
        redrawn = np.zeros((REDRAWS, unknowns))
        redrawn[:, active] = found.T
        redrawn = np.maximum(redrawn[:, : len(p)], 0.0)
    else:
        redrawn = np.array([_weights(fitted, triangle, target + change) for change in back.T])
    redrawn[redrawn < pi.DUST * redrawn.sum(axis=1, keepdims=True)] = 0.0
    low, high = np.quantile(redrawn, TAILS, axis=0)
    total = redrawn.sum(axis=1)
    width = np.quantile(2.0 * (redrawn @ r)[total > 0.0] / total[total > 0.0], TAILS)
    return Intervals(
        tuple(zip(low.tolist(), high.tolist(), strict=True)),
        (float(width[0]), float(width[1])),
        _rms_interval([each.error for each in held], random) if held else None,
        redrawn,
        block,
    )


def _weights(fitted: FittedModel, triangle: Array, target: Array) -> Array:
    """Weights that fit a redrawn system best, with a free shape."""
    k = len(fitted.solution.weights)
    if not len(fitted.shape):
        return pi.non_negative(np.column_stack([triangle, target]), np.arange(k))
    system = np.column_stack([triangle, target])
    _, p = joint.solve_linear(system, fitted.solution.weights, fitted.shape, fitted.front, 0.0)
    return np.maximum(p, 0.0)


def _scores(rows: reduction.Source, item: Course, errors: FreeRunErrors, block: int) -> Array:
    """`X_b^T e_b` of every block (blocks, unknowns), with the mean over each record removed from its columns."""
    size = block * max(1, reduction.CHUNK // block)
    for start in range(0, item.first, size):
        rows(start, min(start + size, item.first), False)
    sums, ones = [], []
    total, count = np.zeros(1), 0
    for start in range(item.first, item.last, size):
        stop = min(start + size, item.last)
        known = np.isfinite(item.y[start:stop])
        found = rows(start, stop, True)[:, 1:-1]
        x = np.zeros((stop - start, found.shape[1]))
        x[known] = found
        e = np.where(known, errors.error[start - item.first : stop - item.first], 0.0)
        edges = np.arange(0, stop - start, block)
        sums.append(np.add.reduceat(x * e[:, None], edges))
        ones.append(np.add.reduceat(e, edges))
        total = total + x.sum(axis=0)
        count += len(found)
    mean = total / count
    return np.asarray(np.concatenate(sums) - np.concatenate(ones)[:, None] * mean)


def block_length(errors: Sequence[Array]) -> int:
    """Samples per block: a few correlation times of the residuals, but few enough for `FEWEST_BLOCKS` blocks."""
    samples = sum(len(e) for e in errors)
    longest, shortest = max(1, samples // FEWEST_BLOCKS), max(1, samples // MOST_BLOCKS)
    times = [correlation_time(e[np.isfinite(e)]) * len(e) for e in errors]
    return int(min(max(shortest, round(MEMORY * sum(times) / samples)), longest))


def correlation_time(e: Array) -> float:
    """`1 + 2 sum rho_k` in samples, over the initial positive sequence (Geyer, Statistical Science 7, 1992)."""
    n = len(e)
    if n < 4 or not np.any(e):
        return 1.0
    spectrum = np.abs(np.fft.rfft(e - np.mean(e), 2 * n)) ** 2
    rho = np.fft.irfft(spectrum)[:n]
    rho = rho / rho[0]
    pairs = rho[1 : n - 1 : 2] + rho[2:n:2]
    ends = np.flatnonzero(pairs <= 0.0)
    return float(max(1.0, 1.0 + 2.0 * np.sum(pairs[: ends[0] if len(ends) else len(pairs)])))


def residual(errors: Sequence[Array], step: float | None) -> Residual | None:
    """What a parameter file says about a fit's errors, NaN where not compared; `step`: sample time in s.

    None without a time or an error."""
    known = [e[np.isfinite(e)] for e in errors]
    squares, samples = float(sum(np.sum(e**2) for e in known)), sum(map(len, known))
    if step is None or not squares > 0.0:
        return None
    tau = sum(max(correlation_time(e), correlation_time(e**2)) * len(e) for e in known) / samples
    return Residual(
        rms=pi.rounded(math.sqrt(squares / samples), pi.DIGITS), correlation=pi.rounded(tau * step, pi.DIGITS),
        samples=pi.rounded(max(samples / tau, 1.0), pi.DIGITS),
    )


def _rms_interval(errors: Sequence[Array], random: np.random.Generator) -> tuple[float, float]:
    """Interval of the rms of coloured errors, from blocks drawn with replacement."""
    block = block_length(errors)
    squares, counts = [], []
    for e in errors:
        known = np.isfinite(e)
        edges = np.arange(0, len(e), block)
        squares.append(np.add.reduceat(np.where(known, e, 0.0) ** 2, edges))
        counts.append(np.add.reduceat(known.astype(np.float64), edges))
    each, samples = np.concatenate(squares), np.concatenate(counts)
    drawn = random.integers(0, len(each), (REDRAWS, len(each)))
    rms = np.sqrt(each[drawn].sum(axis=1) / np.maximum(samples[drawn].sum(axis=1), 1.0))
    low, high = np.quantile(rms, TAILS)
    return float(low), float(high)


# Warnings, one sentence each ---------------------------------------------------------------------------------


AMPLIFIES = 100.0
"""Ratio of the largest slope to p_0 above which a warning says that the inverse amplifies small movements."""

SMALL_REACH = 0.1
"""A largest threshold below this fraction of the drive range causes a warning that records show little hysteresis."""


def about_model(
    fitted: FittedModel, wanted: int | tuple[float, ...] | None, courses: Sequence[Course], own: ErrorRow
) -> list[str]:
    """Warnings about the model itself, one sentence each."""
    solution, compared = fitted.solution, [fitted.inner(item) for item in courses]
    reported = solution.sense.sentences(int(np.count_nonzero(solution.weights[1:])), fitted.parallel is not None)
    reported += about_inverse(solution.weights, solution.fitted)
    low = min(item.drive_range[0] for item in compared)
    high = max(item.drive_range[1] for item in compared)
    if solution.reach < SMALL_REACH * (high - low):
        reported.append(
            f"the records show little hysteresis: no play above {solution.reach:.3g} moves enough in them; "
            "record several full cycles, or give --history"
        )
    if isinstance(wanted, tuple):
        beyond = [r for r in wanted if r > solution.reach * (1.0 + 1e-9)]
        if beyond:
            above = f" above {solution.reach:.6g}"
            reported.append(
                f"{counted(len(beyond), f'play{above} hardly moves', f'plays{above} hardly move')} in these "
                "records; do not trust their weights for larger drives"
            )
    outputs = [y[np.isfinite(y)] for y in (item.y[item.first : item.last] for item in courses)]
    spread = sum(float(np.sum((y - np.mean(y)) ** 2)) for y in outputs) / own.samples
    share = 1.0 - own.rms**2 / spread
    if share < 0.9:
        reported.append(
            f"the model explains only {100 * max(share, 0.0):.0f} % of the measured variance; check which column is "
            "which, and the units"
        )
    return reported


def direction(fitted: FittedModel) -> Literal["", "falls", "clockwise"]:
    """How the output or its loops run against the model, as far as it cannot follow them; else empty."""
    sense = fitted.solution.sense
    if sense.falls:
        return "falls"
    return "clockwise" if sense.clockwise and fitted.parallel is None else ""


def about_inverse(p: NDArray[np.float64], made: Weights) -> list[str]:
    """Warnings about p_0, by which the inverse divides; `p` as written, `made` as fitted."""
    if made.free_p0 is not None and made.free_rms is not None:
        return [
            f"p_0 was raised from {made.free_p0:.3g} to {p[0]:.3g} so that the model has a usable inverse; the data "
            f"hardly determine p_0: rms error {made.free_rms:.4g} before, {made.rms:.4g} after. A lag in the "
            "measurement lowers p_0: record more slowly if you can"
        ]
    if p[0] == 0.0:
        return [
            "p_0 is 0: after each reversal the output does not move (series backlash). The model has no inverse and "
            "can only be used forward. If the actuator has no backlash, record more slowly or with more samples per "
            "second"
        ]
    if np.sum(p) > AMPLIFIES * p[0]:
        return [
            f"p_0 is small: the inverse amplifies small movements {np.sum(p) / p[0]:.0f} times as much as large ones"
        ]
    return []


def about_start(errors: FreeRunErrors, largest: float) -> str:
    """A warning if a record's start disagrees with the given history; else empty."""
    item = errors.course
    end = reduction.settled(item.v, largest) - item.first
    if item.history is None or end < STARTS or len(errors.error) - end < STARTS:
        return ""
    start, rest = (float(np.sqrt(np.nanmean(part**2))) for part in (errors.error[:end], errors.error[end:]))
    if start <= UNLIKE * rest:
        return ""
    return (
        f"{item.name}: the output of the first {counted(end, 'sample')}, which depends on the history, is off by "
        f"{start:.3g} rms against {rest:.3g} for the rest; the history may be wrong. Leave it out "
        "if in doubt"
    )


def repeated(to_fit: Sequence[Record], held: Sequence[Record]) -> list[str]:
    """Warnings about records that were given twice."""
    reported = []
    for k, record in enumerate([*to_fit, *held]):
        for other in to_fit[: min(k, len(to_fit))]:
            if np.array_equal(record.v, other.v) and np.array_equal(np.asarray(record.y), np.asarray(other.y)):
                if k < len(to_fit):
                    reported.append(f"{record.name}: fitted twice, also as {other.name}; leave one of them out")
                else:
                    alike = "" if record.name == other.name else f", as {other.name}"
                    reported.append(
                        f"{record.name}: held out, but also fitted{alike}, so it is no test; leave it out of "
                        "one of the two"
                    )
                break
    return reported


def outside(name: str, v: NDArray[np.float64], allowed: tuple[float, float]) -> str:
    number = int(np.count_nonzero((v < allowed[0]) | (v > allowed[1])))
    if not number:
        return ""
    return (
        f"{name}: {counted(number, 'sample has', 'samples have')} a drive outside the fitted range {allowed[0]:.6g} to "
        f"{allowed[1]:.6g}; the model is a guess there"
    )
