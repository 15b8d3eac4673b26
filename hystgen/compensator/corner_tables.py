"""The constants of the corner engine in floating point, from a model; computed in fractions, each rounded once."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from hystgen.chain.static import StaticModel
from hystgen.compensator.bounds import CornerRoundings
from hystgen.plays.corners.corners_float import Curve, Start


@dataclass(frozen=True)
class Sums:
    """The plays' numbers as fractions: thresholds r, weights p, C_k = p_0 + .. + p_k, Q_k = p_0 r_0 + .. + p_k r_k and
    z_k = C_k r_k - Q_k, the thresholds of the inverse (36)."""

    r: list[Fraction]
    p: list[Fraction]

    @property
    def c(self) -> list[Fraction]:
        """C_0 .. C_n."""
        return list(itertools.accumulate(self.p))

    @property
    def q(self) -> list[Fraction]:
        """Q_0 .. Q_n."""
        return list(itertools.accumulate(p * r for p, r in zip(self.p, self.r, strict=True)))

    @property
    def z(self) -> list[Fraction]:
        """z_0 .. z_n."""
        return [c * r - q for c, r, q in zip(self.c, self.r, self.q, strict=True)]


def sums(cascade: StaticModel) -> Sums:
    """The model's, exactly."""
    pi = cascade.pi
    return Sums([Fraction(r) for r in pi.thresholds], [Fraction(p) for p in pi.weights])


def forward_curve(cascade: StaticModel, dtype: Any) -> Curve:
    """Input: the input w of the plays; output: their sum. Nothing is limited."""
    s = sums(cascade)
    rows = [(2 * r, 2 * z, c, 1 / c if c else c) for r, z, c in zip(s.r, s.z, s.c, strict=True)]
    return _curve(rows, dtype)


def inverse_curve(cascade: StaticModel, dtype: Any, limits: Sequence[Any] | None) -> Curve:
    """Input: the sum of the plays; output: their input w. `limits`: of the drive, then of the sum; None for no limits.

    Each play follows a little early, by what rounding could otherwise carry an answer beyond that place.
    """
    s = sums(cascade)
    roundings = CornerRoundings.of(cascade, np.dtype(dtype).name)
    early = Fraction(roundings.early)
    rows = []
    for r, z, c in zip(s.r, s.z, s.c, strict=True):
        way = Fraction(float(dtype(float(max(2 * z - early, Fraction(0))))))
        rows.append((way, 2 * r - (2 * z - way) / c, 1 / c, c))
    curve = _curve(rows, dtype)
    if limits is None:
        return curve
    low, high, least, most = limits
    inside = [dtype(float(end) - roundings.margin) for end in (-low, high)]
    inside = [np.nextafter(a, dtype(-np.inf)) for a in inside]
    return curve._replace(
        limit=np.array([-low, high], dtype), inside=np.array(inside, dtype), range=np.array([-least, most], dtype)
    )


def _curve(rows: Sequence[Sequence[Fraction]], dtype: Any) -> Curve:
    largest = np.finfo(dtype).max
    columns = [np.array([float(x) for x in column], dtype=dtype) for column in zip(*rows, strict=True)]
    ends = (largest / 2, largest / 2, 0, 0)  # a play that never follows
    way, reach, gain, slope = (np.append(column, dtype(end)) for column, end in zip(columns, ends, strict=True))
    two = np.array([largest, largest], dtype)
    return Curve(way, reach, gain, slope, two, two.copy(), two.copy(), np.array([largest, 0, 0.5, 1], dtype))


def start(
    cascade: StaticModel, curve: Curve, states: Sequence[float], inverse: bool, seen: tuple[float, float]
) -> Start:
    """The memory in which play k holds `states[k]`; `curve` is the operator's, `seen` the range of the plays' input.

    A play is left at that side of its state at which it can begin to follow within the range: far beyond it, lines
    would lose digits. Those that can at neither side are part of the bottom, and so are all with larger thresholds.
    """
    s, dtype = sums(cascade), curve.way.dtype.type
    held = [Fraction(state) for state in states]
    # input and output while plays 0 .. k hold what play k does
    centers = [(w, c * w + aside) for w, c, aside in zip(held, s.c, _aside(s, held), strict=True)]
    if inverse:
        centers = [(y, w) for w, y in centers]
    rest = all(state == held[0] for state in held)
    points = np.array([[float(x) for x in point] for point in centers[: 1 if rest else None]], dtype)
    ways, axis = (curve.reach, 1) if inverse else (curve.way, 0)

    def risen_to(k: int, sign: int) -> float:
        """Where play k begins to follow a rising (falling) move, as the engine computes it."""
        return float(points[0 if rest else k, axis] + dtype(sign) * (ways[k] * dtype(0.5)))

    plays = range(1, len(held))
    risen = next((k - 1 for k in plays if risen_to(k, 1) > seen[1]), len(held) - 1)
    top = next((k for k in plays if k > risen and risen_to(k, -1) < seen[0]), len(held))
    # Where plays 0 .. top-1 all follow, a rising move gives y = C w - Q and a falling one C w + Q, what the others hold
    # aside: the lines behind two turning points of the same output, with inputs to either side of the center's. If no
    # play is held for good, any center does: one for every start memory, so that a start is forgotten to the last bit
    k = top - 1
    w = held[top] if top < len(held) else Fraction(min(max(0.0, seen[0]), seen[1]))
    y = s.c[k] * w + _aside(s, held)[k]
    to, output = (y, w) if inverse else (w, y)
    apart = s.q[k] if inverse else (-s.q[k] / s.c[k] if s.c[k] else Fraction(0))
    bottom = np.array([float(output), float(-(to + apart)), float(to - apart)], dtype)
    return Start(points, int(not rest), risen, bottom, top)


def _aside(s: Sums, held: Sequence[Fraction]) -> list[Fraction]:
    """What the plays above each play add to the sum."""
    above = [p * w for p, w in zip(s.p, held, strict=True)]
    return [*itertools.accumulate(above[:0:-1], initial=Fraction(0))][::-1]
