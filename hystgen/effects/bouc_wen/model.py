"""Elements in parallel with the plays whose minor loops stay open: Bouc-Wen, Dahl and Duhem."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from hystgen.basics.jit import jit
from hystgen.basics.quantities import Number, Positive
from hystgen.effects.base import About, Array, Candidate, Compensated, Effect, Place, Problem, Run, not_as_many
from hystgen.effects.bouc_wen.curve import Half, distance, halves, size

MOST_ELEMENTS = 3
"""Maximum number of elements: records determine one, rarely two (`candidates`)."""

LARGEST_EXPONENT = 10.0
"""Largest exponent: at 10 an element's knee is sharper than the spacing of most models' plays, which then describe it
as well. Fits in the literature lie between 1 and 3."""

LEAST_BALANCE, LARGEST_BALANCE = 0.5, 4.0
"""Smallest and largest balance. Below 1/2 an element would return more work than it took in (beta < gamma in Wen's
notation; Ikhouane, Rodellar, Systems with Hysteresis, 2007); from 1/2 on, |z| <= width, and errors of z never grow.
Fits in the literature have gamma >= -beta/2, or a balance of at most 2."""

WEIGHT = 5.0
"""[mean slopes of the records] Largest magnitude of a weight tried: friction of five times the stage's stiffness has no
inverse."""

WITHIN = 0.01, 1.0
"""[fractions of the drive range] Smallest and largest width: below, an element acts like plays with the smallest
thresholds; above, like a straight line and a memory of the start."""

BALANCES, EXPONENTS = (0.51, 3.0), (1.0, 5.0)
"""Smallest and largest values tried, inside those that a file may give: a search may step beyond them by a little."""

STARTS = 5
"""Number of widths from which a search starts, each about three times the previous one."""

MOST_TILT = 0.98
"""[1] Largest tilt tried, as a fraction of that at which z has no limit at one end of the drive range; below 1, so that
a written model has one. Not critical: over the drive of `test_elements`, a plant at 0.9 is found alike with 0.9, 0.98
and 1 - 2^-15, and plants at 0.97 and 0.99 with none of these."""

DAHL = "bouc_wen, dahl"


@jit
def reach(above: Half, below: Half, place: float) -> float:
    """s at a place of the curve, -1 to 1."""
    if place < 0.0:
        return max(-size(below, -place), -1.0)
    return min(size(above, place), 1.0)


@jit
def place_of(above: Half, below: Half, s: float) -> float:
    """The place of the curve at which it has the value s."""
    return -distance(below, -s) if s < 0.0 else distance(above, s)


def at_rest(w: float, width: float, tilt: float) -> Array:
    """Memory of an element at rest: its direction, its input w at the last turn and now, and where it began to move
    there: its place on the curve or, if tilted, s, which is `z/width + tilt width` in its direction."""
    return np.array([1.0, w, w, tilt * width])


@jit
def reached(m: Array, w: float, width: float, tilt: float, above: Half, below: Half) -> float:
    """s of an element with its input at w, without a turn on the way."""
    x = m[0] * (w - m[1]) / width
    if tilt == 0.0:
        return reach(above, below, m[3] + x)
    return float(m[3] - (1.0 + tilt * m[1] - m[3]) * math.expm1(-x) + tilt * (w - m[1]))


@jit
def moved(m: Array, w: float, width: float, tilt: float, above: Half, below: Half) -> float:
    """z/width of an element after its input has moved to w.

    Between turns the element follows its curve from the last turn on, so that no rounding errors accumulate over the
    samples.
    """
    if m[0] * (w - m[2]) < 0.0:
        s = reached(m, m[2], width, tilt, above, below)
        m[0], m[1], m[3] = -m[0], m[2], place_of(above, below, -s) if tilt == 0.0 else -s
    m[2] = w
    return float(m[0] * reached(m, w, width, tilt, above, below) - tilt * width)


@jit
def element(m: Array, w: Array, width: float, tilt: float, weight: float, above: Half, below: Half, out: Array) -> None:
    """Add `weight z` to `out`, for the input `w`, from rest at its first sample."""
    for k in range(1, len(w)):
        out[k] += weight * width * moved(m, w[k], width, tilt, above, below)


class ParallelElements(Effect):
    name: Literal["bouc_wen"] = Field(description="name of the effect")

    place: ClassVar[Place] = Place.PLAYS
    shown_by: ClassVar[Mapping[str, int]] = {"slow_minor": 1, "slow_reversals": 3, "reversals": 3, "fast_minor": 4}
    order: ClassVar[int] = 2
    timed: ClassVar[bool] = False
    compensated: ClassVar[Compensated] = "exact"
    compensation: ClassVar[str] = "exact: one equation per sample is solved"

    weights: Annotated[tuple[Number, ...], Field(min_length=1, max_length=MOST_ELEMENTS)] = Field(
        description="k_j, output per input unit of the plays, of either sign", examples=[[-0.2]]
    )
    widths: Annotated[tuple[Positive, ...], Field(min_length=1, max_length=MOST_ELEMENTS)] = Field(
        description="as many as weights, largest |z_j|, input units of the plays", examples=[[5.0]]
    )

    def problems(self, thresholds: tuple[float, ...] | None) -> Iterator[Problem]:
        """A problem unless there is one width for each weight, and a tilt, if there are any."""
        yield from not_as_many("widths", self.widths, "weights", self.weights)
        yield from not_as_many("tilts", self.leans, "weights", self.weights)

    @property
    def law(self) -> tuple[float, float]:
        """Exponent and balance."""
        return 1.0, 1.0

    @property
    def leans(self) -> tuple[float, ...]:
        """t_j, by which the drive of each element is tilted."""
        tilts: tuple[float, ...] = getattr(self, "tilts", (0.0,) * len(self.weights))
        return tilts

    def tilted(self, low: float, high: float) -> tuple[Array, Array, Array, Array, Array]:
        """Weights, widths, largest drives `1 + t_j w` in a range, their changes over a width, and the w of each."""
        weights, widths, tilts = map(np.array, (self.weights, self.widths, self.leans))
        top = np.where(tilts > 0.0, high, low)
        return weights, widths, 1.0 + tilts * top, tilts * widths, top

    def parallel(self, w: Array) -> Array:
        """`sum k_j z_j` (N,), from z_j = 0 at the first sample."""
        total = np.zeros(len(w))
        for weight, width, tilt in zip(self.weights, self.widths, self.leans, strict=True):
            m = at_rest(float(w[0]), width, tilt)
            element(m, np.ascontiguousarray(w), width, tilt, weight, *halves(*self.law), total)
        return total

    def transients(self, run: Run) -> Array:
        """`exp(-travel/width_j)`: exact for the laws of Dahl and Duhem, linear in z while the input moves one way."""
        return np.asarray(np.exp(-run.travelled / np.array(self.widths)[:, None]))


class BoucWenElements(ParallelElements):
    """Bouc-Wen elements in parallel with the plays: `y = PI[w] + sum k_j z_j`, z_j in units of the plays' input w.

        dz = dw (1 - (b sgn(z dw) + 1 - b) |z/width|^n)

    Wen's equation with `beta + gamma = 1`, `b = beta` (Y. K. Wen, Method for random vibration of hysteretic systems, J.
    Eng. Mech. Div. ASCE 102, 1976). With a positive weight the output leads its input, with a negative one it lags.
    """

    shape: Literal["bouc_wen"] = Field(default="bouc_wen", description="Wen's law")
    exponent: Annotated[float, Field(ge=1.0, le=LARGEST_EXPONENT)] = Field(
        default=1.0, description="n, sharpness of the transition from the straight line to the limit"
    )
    balance: Annotated[float, Field(ge=LEAST_BALANCE, le=LARGEST_BALANCE)] = Field(
        default=1.0, description="b, difference between loading and unloading; at 0.5, unloading is straight"
    )

    @property
    def law(self) -> tuple[float, float]:
        """Exponent and balance."""
        return self.exponent, self.balance

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """One element with any balance, then with any exponent as well; tried if Dahl's element helps; none
        at a single speed, at which effects of time explain as much."""

        def build(x: Array) -> BoucWenElements:
            weights, widths = _elements(x[None, :2], about)
            exponent = float(np.clip(x[3], 1.0, LARGEST_EXPONENT)) if len(x) > 3 else 1.0
            balance = float(np.clip(10.0 ** x[2], LEAST_BALANCE, LARGEST_BALANCE))
            return cls(name="bouc_wen", weights=weights, widths=widths, exponent=exponent, balance=balance)

        more = np.array([[*np.log10(BALANCES), 0.0], [*EXPONENTS, 1.0]])
        labels = "bouc_wen, any balance", "bouc_wen, any balance and exponent"
        return [_freed(label, build, more[:k]) for k, label in enumerate(labels, 1) if about.speeds]


class DahlElements(ParallelElements):
    """Dahl's friction elements in parallel with the plays: `y = PI[w] + sum k_j z_j`, `dz = dw (1 - sgn(dw) z/width)`.

    The Bouc-Wen element with exponent and balance 1 (P. R. Dahl, A solid friction model, Aerospace Corporation, 1968).
    """

    shape: Literal["dahl"] = Field(description="Dahl's law: exponent 1 and balance 1")

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """One element, and two if one helps; none at a single speed."""

        def build(x: Array) -> DahlElements:
            weights, widths = _elements(x.reshape(-1, 2), about)
            return cls(name="bouc_wen", shape="dahl", weights=weights, widths=widths)

        def grown(x: Array) -> Array:
            one, other = np.clip(x[1] + np.array([-0.3, 0.3]), *np.log10(WITHIN))
            return np.array([0.5 * x[0], one, 0.5 * x[0], other])

        none = np.empty((0, 3))
        found = [
            _candidate(DAHL, 1, build, none),
            replace(_candidate("bouc_wen, two dahl", 2, build, none), beyond=DAHL, grown=grown),
        ]
        return found if about.speeds else []


class DuhemElements(ParallelElements):
    """Dahl's elements with a tilted drive: `dz = dw (1 + t w) - |dw| z/width`.

    With `y = p w + k z` these are Duhem plants of Coleman and Hodgdon, `dy = |dw| (p w - y)/width + (c + d w) dw` with
    c = p + k and d = k t (A constitutive relation for rate-independent hysteresis in ferromagnetically soft materials,
    Int. J. Eng. Sci. 24, 1986).
    """

    shape: Literal["duhem"] = Field(description="Dahl's law with a tilted drive")
    tilts: Annotated[tuple[Number, ...], Field(min_length=1, max_length=MOST_ELEMENTS)] = Field(
        description="as many as weights, t_j, 1 / input unit of the plays", examples=[[-0.005]]
    )

    def problems_within(self, low: float, high: float) -> Iterator[str]:
        """A problem for each tilt with which z would somewhere turn back while the input moves on."""
        for j, (tilt, width) in enumerate(zip(self.tilts, self.widths, strict=False)):
            room, side = (width - low, "below ") if tilt > 0.0 else (width + high, "above -")
            if not abs(tilt) * room < 1.0:
                message = f"tilts[{j}] must be {side}{1.0 / room:.6g}, not {tilt:.6g}: for inputs of the plays"
                yield f"{message} w = {low:.6g} .. {high:.6g}, 1 + tilt w has to exceed |tilt| times the width"

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """One element; tried if Dahl's element helps; none at a single speed."""
        middle, half = 0.5 * sum(about.drive), 0.5 * (about.drive[1] - about.drive[0])

        def build(x: Array) -> DuhemElements:
            (weight,), (width,) = _elements(x[None, :2], about)
            lean = x[2] / max(half + width, abs(middle))  # about the middle: at 1 or -1, z has no limit at one end
            tilts = (lean / (at_0 := 1.0 - lean * middle),)
            return cls(name="bouc_wen", shape="duhem", weights=(weight * at_0,), widths=(width,), tilts=tilts)

        return [_freed("bouc_wen, duhem", build, np.array([[-MOST_TILT, MOST_TILT, 0.0]]))] if about.speeds else []


def _elements(x: Array, about: About) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Weights and widths from a fit's coordinates (k, 2): mean slopes, and decimal logarithms of drive ranges."""
    wide = about.drive[1] - about.drive[0]
    return tuple((about.output_range / wide * x[:, 0]).tolist()), tuple((wide * 10.0 ** x[:, 1]).tolist())


def _candidate(label: str, count: int, build: Callable[[Array], Effect], more: Array) -> Candidate:
    """A shape with `count` elements, and parameters with the bounds and starts `more` (k, 3)."""
    low, high = np.log10(WITHIN)

    def start(place: float) -> Array:
        # several elements start apart, as equal ones would stay equal
        places = np.clip(place + 0.5 * (np.arange(count) - 0.5 * (count - 1)), low, high)
        return np.concatenate([np.stack([np.zeros(count), places], axis=1).ravel(), more[:, 2]])

    starts = [start(place) for place in np.linspace(low, high, STARTS)]
    return Candidate(
        label,
        np.concatenate([np.tile([-WEIGHT, low], count), more[:, 0]]),
        np.concatenate([np.tile([WEIGHT, high], count), more[:, 1]]),
        starts[0], build, starts[0], tuple(starts[1:]), amounts=tuple(range(0, 2 * count, 2)),
    )


def _freed(label: str, build: Callable[[Array], Effect], more: Array) -> Candidate:
    """One element with further parameters than Dahl's, which begin where it is Dahl's."""
    return replace(_candidate(label, 1, build, more), beyond=DAHL, grown=lambda x: np.append(x, more[:, 2]))


SHAPES: Sequence[type[ParallelElements]] = (BoucWenElements, DahlElements, DuhemElements)


def load() -> None:
    """Compile the elements, or load them from the cache, by running them on two samples."""
    element(at_rest(0.0, 1.0, 0.0), np.array([0.0, 1.0]), 1.0, 0.0, 1.0, *halves(1.0, 1.0), np.zeros(2))
