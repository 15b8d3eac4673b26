"""A mechanical mode of the stage."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from hystgen.basics.jit import jit
from hystgen.basics.quantities import Positive
from hystgen.effects.base import About, Array, Candidate, Compensated, Effect, Place, Run
from hystgen.effects.kinds import OwnBlock
from hystgen.effects.resonance.part import BLOCK


@jit
def rung(
    y: float, rate: float, u: float, after: float, c: float, s: float, ramp: float, step: float, damping: float
) -> tuple[float, float]:
    """Output and rate of `ring` after a step in which the input goes from `u` to `after`."""
    off = y - u
    change = after - u
    return (
        u + (c + damping * s) * off + s * rate + ramp * change,
        (c - damping * s) * rate - s * off + step * change,
    )


@jit
def ring(u: Array, c: Array, s: Array, ramp: Array, step: Array, damping: float, out: Array) -> None:
    """Second-order low pass of every row of `u` (R, N), from rest, over steps with linear `u`.

    `c`, `s`: decaying cosine and sine of each step; `ramp`, `step`: increments of the output and its rate for a change
    of `u` by 1 over the step. Rates are per radian of the undamped oscillation.
    """
    # Four in parallel: a single recursion would stall on its previous sample
    rows, number = u.shape
    fours = rows // 4 * 4
    for i in range(0, fours, 4):
        u0, u1, u2, u3 = u[i], u[i + 1], u[i + 2], u[i + 3]
        y0, y1, y2, y3 = u0[0], u1[0], u2[0], u3[0]
        v0, v1, v2, v3 = 0.0, 0.0, 0.0, 0.0
        out[i, 0], out[i + 1, 0], out[i + 2, 0], out[i + 3, 0] = y0, y1, y2, y3
        for k in range(number - 1):
            y0, v0 = rung(y0, v0, u0[k], u0[k + 1], c[k], s[k], ramp[k], step[k], damping)
            y1, v1 = rung(y1, v1, u1[k], u1[k + 1], c[k], s[k], ramp[k], step[k], damping)
            y2, v2 = rung(y2, v2, u2[k], u2[k + 1], c[k], s[k], ramp[k], step[k], damping)
            y3, v3 = rung(y3, v3, u3[k], u3[k + 1], c[k], s[k], ramp[k], step[k], damping)
            out[i, k + 1], out[i + 1, k + 1], out[i + 2, k + 1], out[i + 3, k + 1] = y0, y1, y2, y3
    for i in range(fours, rows):
        y, v = u[i, 0], 0.0
        out[i, 0] = y
        for k in range(number - 1):
            y, v = rung(y, v, u[i, k], u[i, k + 1], c[k], s[k], ramp[k], step[k], damping)
            out[i, k + 1] = y


class _Mode(Effect):
    """`m'' + 2 zeta w0 m' + w0^2 m = w0^2 h`, `w0 = 2 pi frequency`, gain 1 at rest; several in series.

    For `h` linear over a step the solution is exact, for any damping: a free oscillation about `h - 2 zeta h'/w0`. A
    record starts at rest: `m = h`, `m' = 0`.
    """

    name: Literal["resonance"] = Field(description="name of the effect")
    frequency: Positive = Field(description="undamped frequency, Hz", examples=[350.0])
    damping: Annotated[Positive, Field(le=10.0)] = Field(description="zeta, above 0, 1 is critical", examples=[0.02])

    place: ClassVar[Place] = Place.LINEAR
    shown_by: ClassVar[Mapping[str, int]] = {"sweep": 1, "multisine": 3, "fast_steps": 4, "staircase": 4}
    rank: ClassVar[float] = 1
    fades: ClassVar[bool] = True
    repeatable: ClassVar[bool] = True

    def time_scale(self, drive_range: float) -> float:
        """The time in which a free oscillation decays by a factor of e."""
        zeta = self.damping
        slow = zeta if zeta < 1.0 else 1.0 / (zeta + math.sqrt(zeta * zeta - 1.0))
        return 1.0 / (2.0 * math.pi * self.frequency * slow)

    def response(self, hertz: Array) -> NDArray[np.complex128]:
        """`1/(1 - x^2 + 2 i zeta x)` with `x = f/frequency`."""
        x = hertz / self.frequency
        return np.asarray(1.0 / (1.0 - x * x + 2j * self.damping * x))

    @property
    def corner(self) -> tuple[float, str]:
        """The undamped frequency."""
        return self.frequency, "mode"

    def factors(self, times: Array) -> tuple[Array, Array, Array]:
        """Times in radians of the undamped oscillation, and the decaying cosine and sine."""
        zeta = self.damping
        angle = 2.0 * np.pi * self.frequency * times
        with np.errstate(under="ignore"):
            if zeta < 1.0:
                turn = np.sqrt(1.0 - zeta * zeta)
                decay = np.exp(-zeta * angle)
                return angle, decay * np.cos(turn * angle), decay * np.sin(turn * angle) / turn
            apart = np.sqrt(zeta * zeta - 1.0)
            slow, fast = np.exp(-angle / (zeta + apart)), np.exp(-(zeta + apart) * angle)
            sine = -slow * np.expm1(-2.0 * apart * angle) / (2.0 * apart) if apart > 0.0 else angle * slow
            return angle, 0.5 * (slow + fast), sine

    def forced(self, steps: Array) -> Array:
        """Decaying cosine and sine of each step, and the responses to a change by 1 over it: output, and its rate."""
        zeta = self.damping
        x, c, s = self.factors(steps)
        with np.errstate(divide="ignore", invalid="ignore"):
            ramp = 1.0 + (2.0 * zeta * (c - 1.0) + (2.0 * zeta * zeta - 1.0) * s) / x
            step = (1.0 - c - zeta * s) / x
        # Avoids cancellation for short steps
        curved = (4.0 * zeta * zeta - 1.0) * x * x
        short = x < 1e-3 / (1.0 + zeta)
        ramp = np.where(short, x * x * (1.0 / 6.0 - zeta * x / 12.0 + curved / 120.0), ramp)
        step = np.where(short, x * (0.5 - zeta * x / 3.0 + curved / 24.0), step)
        return np.stack([c, s, ramp, step])

    def denominator(self, step: float) -> tuple[float, float]:
        """`a1`, `a2` of the polynomial `z^2 + a1 z + a2` whose zeros are the exact poles at steps of this length."""
        zeta, angle = self.damping, 2.0 * math.pi * self.frequency * step
        if zeta < 1.0:
            decay = math.exp(-zeta * angle)
            return -2.0 * decay * math.cos(math.sqrt(1.0 - zeta * zeta) * angle), decay * decay
        apart = math.sqrt(zeta * zeta - 1.0)
        slow, fast = math.exp(-angle / (zeta + apart)), math.exp(-(zeta + apart) * angle)
        return -(slow + fast), slow * fast

    def filtered(self, h: Array, run: Run) -> Array:
        """The response of the mode to the play sum."""
        rows = np.ascontiguousarray(np.atleast_2d(h))
        out = np.empty_like(rows)
        factors = run.remembered((self.frequency, self.damping), lambda: run.of_steps(self.forced))
        a, b, early, late = factors
        ring(rows, a, b, early, late, self.damping, out)
        return out.reshape(np.shape(h))

    def transients(self, run: Run) -> Array:
        """The free oscillation from a start that is not at rest: decaying cosine and sine."""
        return np.stack(self.factors(run.t - run.t[0])[1:])


WELL_DAMPED = 0.7
"""[damping ratio] At this damping and above, a mode is inverted rather than shaped or notched. It overshoots a step by
`exp(-pi z/sqrt(1 - z^2))`, at most 4.6 %, while the half period that a shaper waits is 1.4 times the undamped half
period and grows without bound towards 1. Derived from these closed forms, not from a run."""


class Resonance(_Mode):
    """Mode `y'' + 2 zeta w0 y' + w0^2 y = w0^2 h`, `w0 = 2 pi frequency`, that carries the whole motion."""

    shape: Literal["whole"] = Field(default="whole", description="a mode that carries the whole motion")

    order: ClassVar[int] = 1
    later: ClassVar[tuple[str, ...]] = ("shape",)
    compensated: ClassVar[Compensated] = "approximate"
    compensation: ClassVar[str] = "samples of the reference on either side of the present one: no ringing, no delay"

    def rings(self, by: str) -> bool:
        """Whether it rings and `by` asks for a shaper or a notch."""
        return by in ("shaper", "notch") and self.damping < WELL_DAMPED

    def corrected(self, resonance: str) -> str:
        """The correction: its inverse, a shaper or a notch, or none."""
        if resonance == "none":
            return "none, as emit.compensation.resonance sets"
        return f"a {resonance}, see below" if self.rings(resonance) else self.compensation

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """Frequency from two periods per record to three samples per period, damping from 0.3 % to 70 %.

        Starting frequencies are evenly spaced on a logarithmic scale. A faster or more damped mode does not visibly
        ring: in the records it is a delay or a lag. A lightly damped mode rings long, and is found from the frequency
        at which the residual rings.
        """
        low, high = _frequencies(about)

        def build(x: Array) -> Resonance:
            return cls(name="resonance", frequency=float(10.0 ** x[0]), damping=float(10.0 ** x[1]))

        return [
            Candidate(
                f"resonance, {name}", np.array([low, -2.5]), np.array([high, np.log10(0.7)]), starts[0], build,
                others=tuple(starts[1:]),
            )
            for name, starts in _places(about).items() if starts
        ]


class PartMode(_Mode):
    """Mode that carries a share of the motion: `y = (1 - share) h + share m`.

    A stage has many modes; the contribution of each to the static motion is its share of the total compliance. Modes
    far above the recorded frequencies follow at once (Preumont, Vibration Control of Active Structures, 2011, chapter
    2).
    """

    shape: Literal["part"] = Field(description="a mode that carries a share of the motion")
    share: Annotated[Positive, Field(lt=1.0)] = Field(description="fraction of the motion, below 1", examples=[0.1])

    compensated: ClassVar[Compensated] = "exact"
    compensation: ClassVar[str] = "exact: solved for the input with the oscillation known"
    block: ClassVar[OwnBlock] = BLOCK

    def response(self, hertz: Array) -> NDArray[np.complex128]:
        """The share in the mode, and the rest that follows at once."""
        return np.asarray(1.0 + self.share * (super().response(hertz) - 1.0))

    def numbers(self, seconds: float) -> tuple[float, ...]:
        """The parameters of the block at steps of `seconds`."""
        zeta = self.damping
        c, s, ramp, step = (float(x[0]) for x in self.forced(np.array([seconds])))
        lead = self.share * (ramp - 1.0)
        return c - 1.0 + zeta * s, s, c - 1.0 - zeta * s, lead, self.share * step, 1.0 / (1.0 + lead), 0.0

    def filtered(self, h: Array, run: Run) -> Array:
        """The play sum, with its share passed through the mode."""
        return np.asarray(h + self.share * (super().filtered(h, run) - h))

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """As for a whole mode, but with at most 20 % damping, so that it rings, and at most half of the motion.

        With three samples per period the inverse is stable for shares up to 0.6, with more samples for larger shares; a
        mode that carries most of the motion is treated as a whole mode.
        """
        low, high = _frequencies(about)

        def build(x: Array) -> PartMode:
            frequency, damping = (float(10.0**each) for each in x[:2])
            return cls(name="resonance", shape="part", frequency=frequency, damping=damping, share=float(x[2]))

        places = _places(about)
        starts = [*places["where it rings"], *(places[name][1] for name in ("high", "middle", "low"))]
        first, *others = (np.append(place, FIRST_SHARE) for place in starts)
        return [
            Candidate(
                "resonance of a share", np.array([low, -2.5, 1e-3]), np.array([high, np.log10(0.2), 0.5]), first,
                build, others=tuple(others), amounts=(2,),
            )
        ]


FIRST_SHARE = 0.1
"""Value of `share` at which a search starts."""


def _frequencies(about: About) -> tuple[float, float]:
    """Decimal logarithms of the lowest and highest frequency to search."""
    low = np.log10(2.0 / about.duration)
    return low, max(np.log10(1.0 / about.sample_time) - np.log10(3.0), low)


def _places(about: About) -> dict[str, list[Array]]:
    """Logarithms of frequency and damping from which searches start."""
    low, high = _frequencies(about)
    fastest = np.log10(1.0 / about.sample_time)

    def start(place: float) -> Array:
        return np.array([min(fastest - max(fastest - low, 0.0) * place, high), -1.3])

    return {
        "high": [start(place) for place in (0.14, 0.2, 0.28)],
        "middle": [start(place) for place in (0.36, 0.44, 0.52)],
        "low": [start(place) for place in (0.6, 0.7, 0.8)],
        "where it rings": [np.array([np.log10(f), -1.8]) for f in about.ringing],
    }


SHAPES = (Resonance, PartMode)


def load() -> None:
    """Compile the recursions, or load them from the cache, by running them on two samples."""
    one = np.ones(1)
    ring(np.arange(2.0)[None, :], one, one, one, one, 1.0, np.empty((1, 2)))
