"""How sure a fit is: confidence intervals by a block bootstrap.

The residuals of a hysteresis model are coloured: what it misses comes back at every reversal. So they are not redrawn
one by one but in blocks longer than they remember. A block enters the normal equations only by its score
`X_b^T e_b`; random signs of all the scores (a dependent wild bootstrap; Shao, Journal of the American Statistical
Association 105, 2010, 218-235) redraw the record, and the weights that go with each redraw are found under the
constraints of the fit. The cost does not grow with the number of samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hystgen.identification import joint, reduction, weights
from hystgen.identification.gpi import Fitted
from hystgen.identification.pi import Errors
from hystgen.identification.reduction import Course

Array = NDArray[np.float64]

REDRAWS = 1000

TAILS = (0.025, 0.975)
"""Of 95 % intervals."""

BLOCKS, MOST_BLOCKS = 40, 4000
"""At least so many blocks, whatever the residuals remember; and at most, since more teach nothing."""

MANY = 100
"""Of more weights than this, those that are zero stay so in every redraw: then one factorisation serves all."""

MEMORY = 4.0
"""Blocks are so many times as long as the residuals' correlation time."""

SEED = 1


@dataclass(frozen=True)
class Intervals:
    """95 % intervals, and what they come from.

    `weights`: low and high of each; `width`: of the widest loop; `held_out`: of the held-out rms error, None
    where nothing was held out; `redrawn`: the weights of every redraw (REDRAWS, n+1); `block`: samples in a block.
    """

    weights: tuple[tuple[float, float], ...]
    width: tuple[float, float]
    held_out: tuple[float, float] | None
    redrawn: Array = field(compare=False)
    block: int

    def loading_curve(self, thresholds: Array, x: Array) -> tuple[Array, Array]:
        """Band around the initial loading curve (22) at the places x."""
        curves = np.maximum(x[:, None] - thresholds, 0.0) @ self.redrawn.T
        low, high = np.quantile(curves, TAILS, axis=1)
        return low, high


def intervals(fitted: Fitted, courses: Sequence[Course], errors: Sequence[Errors], held: Sequence[Errors]) -> Intervals:
    """Intervals of a fit to `courses` (drive as measured) with those `errors`; `held`: those of held-out records."""
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
    lost = min(unknowns / len(scores), 0.5)  # a fit takes some of the scatter of the residuals away
    moved = signs @ scores / np.sqrt(1.0 - lost)
    target = triangle[:, : len(p)] @ p
    back, *_ = np.linalg.lstsq(triangle.T, moved.T, rcond=1e-12)
    if len(p) > MANY:
        active = np.flatnonzero(np.append(p > 0.0, np.ones(len(fitted.shape), dtype=bool)))
        found, *_ = np.linalg.lstsq(triangle[:, active], target[:, None] + back, rcond=1e-12)
        redrawn = np.zeros((REDRAWS, unknowns))
        redrawn[:, active] = found.T
        redrawn = np.maximum(redrawn[:, : len(p)], 0.0)
    else:
        redrawn = np.array([_weights(fitted, triangle, target + change) for change in back.T])
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


def _weights(fitted: Fitted, triangle: Array, target: Array) -> Array:
    """Weights that fit a redrawn system best, the shape being free to follow."""
    k = len(fitted.solution.weights)
    if not len(fitted.shape):
        return weights.non_negative(np.column_stack([triangle, target]), np.arange(k))
    system = np.column_stack([triangle, target])
    _, p = joint.solve_linear(system, fitted.solution.weights, fitted.shape, fitted.front, 0.0)
    return np.maximum(p, 0.0)


def _scores(rows: reduction.Source, item: Course, errors: Errors, block: int) -> Array:
    """`X_b^T e_b` of every block (blocks, unknowns), each record's mean taken out of its columns."""
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
    """Samples in a block: a few correlation times of the residuals, but no more than leave enough blocks."""
    samples = sum(len(e) for e in errors)
    longest, shortest = max(1, samples // BLOCKS), max(1, samples // MOST_BLOCKS)
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


def _rms_interval(errors: Sequence[Array], random: np.random.Generator) -> tuple[float, float]:
    """Interval of the rms of coloured errors, their blocks drawn with replacement."""
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
