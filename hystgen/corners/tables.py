"""The constants of the corner engine in floating point, from a model; computed in fractions, each rounded once."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from hystgen.bounds import CornerRoundings
from hystgen.corners.memory import Curve, Start
from hystgen.models import Cascade

RISING, FALLING, BOTTOM = 1, 0, 2  # `rose` of a corner


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


def sums(cascade: Cascade) -> Sums:
    """The model's, exactly."""
    pi = cascade.pi
    return Sums([Fraction(r) for r in pi.thresholds], [Fraction(p) for p in pi.weights])


def forward_curve(cascade: Cascade, dtype: Any) -> Curve:
    """Input: the input w of the plays; output: their sum. Nothing is limited."""
    s = sums(cascade)
    rows = [(2 * r, 2 * z, c, 1 / c if c else c) for r, z, c in zip(s.r, s.z, s.c, strict=True)]
    return _curve(rows, dtype)


def inverse_curve(cascade: Cascade, dtype: Any, limits: Sequence[Any] | None) -> Curve:
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


def start(cascade: Cascade, curve: Curve, states: Sequence[float], inverse: bool) -> Start:
    """The memory in which play k holds `states[k]`; `curve` is the operator's.

    Plays that hold the same are left to the engine, which puts each of them into a block of its own; so are plays that
    cannot move within the limits, which are part of the bottom.
    """
    s, dtype = sums(cascade), curve.way.dtype.type
    held = [Fraction(state) for state in states]
    n = len(held) - 1
    rest = all(state == held[0] for state in held)

    def fits(state: Fraction, k: int) -> tuple[bool, bool]:
        """Whether play k can begin to follow a rising, a falling move; as the engine would compute it at rest."""
        if not inverse:
            return True, True
        if rest:
            w, reach = dtype(float(state)), curve.reach[k] * dtype(0.5)
            return bool(w + reach <= curve.limit[1]), bool(reach - w <= curve.limit[0])
        return dtype(float(state + s.r[k])) <= curve.limit[1], dtype(float(s.r[k] - state)) <= curve.limit[0]

    top = next((k for k in range(1, n + 1) if not any(fits(held[k], k))), n + 1)
    corners = [_bottom(s, held, top, inverse, dtype)]
    if not rest:
        for k in range(top - 1, 0, -1):
            rising, falling = fits(held[k], k)
            assert rising or falling
            corners.append(_corner(s, held, k, rising, curve, inverse))
    w, y = held[0], sum((p * state for p, state in zip(s.p, held, strict=True)), Fraction(0))
    place = (y, w) if inverse else (w, y)
    return Start(
        output=np.array([corner[0] for corner in corners], dtype),
        passed=np.array([corner[1] for corner in corners], dtype),
        top=np.array([corner[2] for corner in corners], np.int64),
        rose=np.array([corner[3] for corner in corners], np.int64),
        place=np.array([float(x) for x in place], dtype),
    )


def _bottom(s: Sums, held: Sequence[Fraction], top: int, inverse: bool, dtype: Any) -> tuple[Any, Any, int, int]:
    """Where plays 0 .. top-1 all follow, a rising move gives `C w - Q` and a falling one `C w + Q`, what the others hold
    aside. Both lines are those behind a turning point with the same output; this gives that and the two inputs."""
    c, q = s.c[top - 1], s.q[top - 1]
    w = held[min(top, len(held) - 1)]
    y = c * w + sum((p * state for p, state in zip(s.p[top:], held[top:], strict=True)), Fraction(0))
    if inverse:
        output, rising, falling = w, y + q, y - q
    else:
        apart = q / c if c else Fraction(0)
        output, rising, falling = y, w - apart, w + apart
    return dtype(float(output)), (dtype(float(-rising)), dtype(float(falling))), top, BOTTOM


def _corner(s: Sums, held: Sequence[Fraction], k: int, rising: bool, curve: Curve, inverse: bool) -> tuple[Any, Any, int, int]:
    """The block of play k alone: a move that ended where the play begins to follow has left it."""
    sign = 1 if rising else -1
    dtype = curve.way.dtype.type
    w = held[k] + sign * s.r[k]
    y = s.c[k] * w - sign * s.q[k] + sum((p * x for p, x in zip(s.p[k + 1 :], held[k + 1 :], strict=True)), Fraction(0))
    to, output = (y, w) if inverse else (w, y)
    own = dtype(float(sign * to))
    room = curve.limit[1 - rising] + dtype(float(sign * output))
    far = np.finfo(dtype).max if curve.reach[k] > room else curve.way[k] - own
    passed = (far, own) if rising else (own, far)
    return dtype(float(output)), passed, k, RISING if rising else FALLING
