"""Gain and offset that follow a temperature."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from hystgen.basics.jit import jit
from hystgen.basics.quantities import NotNegative, Number, Positive
from hystgen.effects.base import About, Array, Candidate, Compensated, Effect, Place, Run, follow, span
from hystgen.effects.columns import TEMPERATURE, Follower, Law

SELF_HEATING = "thermal, self-heating"

SHARES = (0.3, 0.15, 0.5)
"""Starts of searches, as fractions of the logarithmic distance from the longest time constant down to the shortest."""

SMALLEST, LARGEST, REACH = -2.0, 0.5, -0.8
"""[decimal logarithms of ranges of the drive] Reach of the rubbing elements: bounds and start of a search."""


@jit
def rubbed(way: float, reach: float) -> float:
    """Friction loss of plays with thresholds up to `reach` on a move along which more and more plays follow.

    A play with threshold r begins to follow after r and then loses r per unit of the move; together the plays lose
    `min(way, reach)^2/2` per unit.
    """
    rising = min(way, reach)
    return rising * rising * (rising / 6.0 + 0.5 * (way - rising))


@jit
def lost_on(
    w: float, x: float, first: float, reach: float, corner: Array, depth: int, up: bool
) -> tuple[float, int, bool]:
    """Energy lost by plays of all thresholds up to `reach`, equally dense and relaxed at `first`, on the move from `w`
    to `x`, with the number of turning points and the direction after the move.

    After a turning point a play follows once the move exceeds twice its threshold. Turning points that are passed are
    forgotten (Madelung's rules): the move then continues from an earlier one, or on the initial curve. `corner`: the
    `depth` earlier turning points, which are left unchanged; a new turning point is written after them.
    """
    energy = 0.0
    if x == w:
        return energy, depth, up
    if (x > w) != up:
        up = x > w
        if w != first or depth > 0:
            corner[depth] = w
            depth += 1
    sign = 1.0 if up else -1.0
    while x != w:
        if depth == 0:
            energy += rubbed(abs(x - first), reach) - rubbed(abs(w - first), reach)
            break
        last = corner[depth - 1]
        end = corner[depth - 2] if depth > 1 else 2.0 * first - last
        ends = sign * (x - end) >= 0.0
        to = end if ends else x
        energy += 2.0 * (rubbed(0.5 * sign * (to - last), reach) - rubbed(0.5 * sign * (w - last), reach))
        w = to
        if ends:
            depth -= min(depth, 2)
    return energy, depth, up


@jit
def lost(v: Array, reach: float, corner: Array, out: Array) -> None:
    """The energy lost in each step of `v`, as in `lost_on`, from rest at its first sample."""
    depth, up = 0, True
    for k in range(len(v) - 1):
        out[k], depth, up = lost_on(v[k], v[k + 1], v[0], reach, corner, depth, up)


class _Thermal(Effect):
    name: Literal["thermal"] = Field(description="name of the effect")

    place: ClassVar[Place] = Place.GAIN
    shown_by: ClassVar[Mapping[str, int]] = {"cycles": 2, "holds": 3, "settling": 3, "slow_again": 3}
    order: ClassVar[int] = 1
    selector: ClassVar[str] = "source"

    gain_per_degree: Number = Field(default=0.0, description="change of gain, 1/K", examples=[-0.002])
    offset_per_degree: Number = Field(default=0.0, description="change of offset, output units/K")
    reference: Number = Field(default=20.0, description="temperature at which nothing changes, degC")

    settled: ClassVar[tuple[str, ...]] = ("reference", "heating")

    @abstractmethod
    def above(self, run: Run) -> Array:
        """Temperature above the reference (N,), K."""

    def gain(self, run: Run) -> Array:
        """`1 + gain_per_degree (T - reference)`."""
        return 1.0 + self.gain_per_degree * self.above(run)

    def offset(self, run: Run) -> Array:
        """`offset_per_degree (T - reference)`."""
        return self.offset_per_degree * self.above(run)


class LoggedThermal(_Thermal, Follower):
    """Gain `1 + g (T - T_ref)` and offset `o (T - T_ref)` from a temperature in the record's column `temperature`."""

    source: Literal["logged"] = Field(default="logged", description="temperature from the column `temperature`")

    timed: ClassVar[bool] = False
    columns: ClassVar[tuple[str, ...]] = (TEMPERATURE,)
    compensation: ClassVar[str] = "exact, given the temperature along with the reference"

    @property
    def law(self) -> Law:
        """What the temperature does."""
        return Law(TEMPERATURE, self.gain_per_degree, self.offset_per_degree, self.reference)

    def above(self, run: Run) -> Array:
        """The logged temperature above the reference."""
        return self.law.above(run)

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """Gain, offset, both; no candidates unless every record has a temperature."""
        if TEMPERATURE not in about.columns:
            return []
        found = []
        for what, row in (("gain", (0, None)), ("offset", (None, 0)), ("gain and offset", (0, 1))):
            n = sum(place is not None for place in row)

            def build(x: Array, row: tuple[int | None, int | None] = row) -> LoggedThermal:
                gain, offset = _of_row(x, row, about)
                return cls(name="thermal", gain_per_degree=gain, offset_per_degree=offset)

            bounds = np.full(n, 20.0)
            found.append(Candidate(f"thermal, logged, {what}", -bounds, bounds, np.zeros(n), build, np.zeros(n)))
        return found


class OwnHeat(_Thermal):
    """Gain and offset from a temperature rise that the drive itself causes: `tau T' + T = heat`, T = 0 at the start."""

    time_constant: Positive = Field(description="tau, s", examples=[60.0])
    heating: NotNegative

    compensated: ClassVar[Compensated] = "needs a sensor"
    compensation: ClassVar[str] = (
        "the temperature is not measured; followed open loop with emit.compensation.compensate: [self_heating]"
    )

    def time_scale(self, drive_range: float) -> float:
        """The time constant."""
        return self.time_constant

    @abstractmethod
    def heat(self, run: Run) -> Array:
        """Final rise for the heat of each step (N - 1,), K."""

    def above(self, run: Run) -> Array:
        """Temperature rise, K; cached, since a search reuses it with other gains and offsets."""
        numbers = self.model_dump(exclude={"gain_per_degree", "offset_per_degree"})
        return run.remembered((type(self), *numbers.values()), lambda: self._rise(run))

    def _rise(self, run: Run) -> Array:
        decay, kept, none = run.of_steps(lambda steps: _kept(steps / self.time_constant))
        out = np.empty(len(run.t))
        follow(np.append(self.heat(run), 0.0), decay, kept, none, 0.0, out)
        return out


class SelfHeating(OwnHeat):
    """Gain and offset of self-heating: `tau T' + T = heating |v v'|/2`, T above the reference, 0 at the start.

    A drive of amplitude V about 0 and frequency f has `|v v'|/2 = f V^2` on average, the law of dielectric loss; the
    stage has one thermal resistance and one heat capacity. The heat of a step is spread evenly over the step.
    """

    source: Literal["self_heating"] = Field(description="temperature from the drive's own heat")
    heating: NotNegative = Field(description="K s/input^2: heating f V^2 is the final rise", examples=[1.0e-5])

    def heat(self, run: Run) -> Array:
        """`heating |v v'|/2`."""
        return self.heating * run.heat

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """Time constant with gain, with offset, with both; heating is scaled so that a session warms by about 1 K."""
        power = max(map(abs, about.drive)) * about.travel / (2.0 * max(about.session, about.sample_time))
        heating = 1.0 / max(power, 1e-12)
        found = []
        for what, row in (("gain", (1, None)), ("offset", (None, 1)), ("gain and offset", (1, 2))):

            def build(x: Array, row: tuple[int | None, int | None] = row) -> SelfHeating:
                gain, offset = _of_row(x, row, about)
                return cls(
                    name="thermal", source="self_heating", time_constant=float(10.0 ** x[0]), heating=heating,
                    gain_per_degree=gain, offset_per_degree=offset,
                )

            low, high, start, others = _numbers(row, about)
            found.append(
                Candidate(
                    f"{SELF_HEATING}, {what}", low, high, start, build, start, others, levels_off=_levels_off(about)
                )
            )
        return found


class HysteresisHeating(OwnHeat):
    """Gain and offset from the heat that hysteresis itself produces: `tau T' + T = heating q`, T 0 at the start.

    `q` is the power that plays of all thresholds up to `reach`, equally dense, lose to friction, input units^3/s:
    `2/3 f V^3` for amplitudes V below the reach (Rayleigh's law: Damjanovic, Rep. Prog. Phys. 61 (1998) 1267), wherever
    the loop lies, and proportional to V far above the reach.
    """

    source: Literal["hysteresis"] = Field(description="temperature from the heat of the loops")
    heating: NotNegative = Field(description="K s/input^3: heating 2/3 f V^3 is the final rise", examples=[1.0e-6])
    reach: Positive = Field(description="largest threshold of the rubbing plays, input units", examples=[30.0])

    def heat(self, run: Run) -> Array:
        """`heating q`, the loss of each step spread evenly over it."""
        return self.heating * run.remembered((type(self), self.reach), lambda: self._lost(run)) / run.steps

    def _lost(self, run: Run) -> Array:
        out = np.empty(len(run.steps))
        lost(run.v, self.reach, np.empty(len(run.v)), out)
        return out

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """Time constant with gain, with gain and offset, and the reach; tried if the drive's own heat helps."""
        low_drive, high_drive = about.drive
        wide = high_drive - low_drive
        rate = about.travel / max(about.session, about.sample_time)
        found = []
        for what, row in (("gain", (1, None)), ("gain and offset", (1, 2))):

            def build(x: Array, row: tuple[int | None, int | None] = row) -> HysteresisHeating:
                gain, offset = _of_row(x, row, about)
                reach = wide * float(10.0 ** x[-1])
                return cls(
                    name="thermal", source="hysteresis", time_constant=float(10.0 ** x[0]),
                    heating=2.0 / max(reach * reach * rate, 1e-12), reach=reach,
                    gain_per_degree=gain, offset_per_degree=offset,
                )

            def grown(x: Array) -> Array:
                return np.append(x, REACH)

            low, high, start, others = _numbers(row, about)
            found.append(
                Candidate(
                    f"thermal, heat of hysteresis, {what}", np.append(low, SMALLEST), np.append(high, LARGEST),
                    grown(start), build, grown(start), tuple(map(grown, others)), f"{SELF_HEATING}, {what}", grown,
                    levels_off=_levels_off(about),
                )
            )
        return found


def _numbers(row: tuple[int | None, int | None], about: About) -> tuple[Array, Array, Array, tuple[Array, ...]]:
    """Bounds, start and further starts of the parameters: time constant, then a gain, an offset or both.

    A temperature changes from loop to loop, not within a loop: an effect that follows the drive within a quarter of a
    full-range loop is not thermal.
    """
    n = sum(place is not None for place in row)
    low, high = span(20.0 * about.sample_time, 3.0 * about.session)
    starts = [high - share * (high - low) for share in SHARES]
    quarter = 0.5 * (about.drive[1] - about.drive[0]) * about.session / max(about.travel, 1e-300)
    low = max(low, math.log10(max(min(quarter, 0.3 * about.session), 1e-12)))
    start, *others = (np.append(max(place, low), np.zeros(n)) for place in starts)
    return np.append(low, np.full(n, -20.0)), np.append(high, np.full(n, 20.0)), start, tuple(others)


def _levels_off(about: About) -> tuple[int, float]:
    """Index of the time constant, and its limit, the session: a temperature that has not levelled off by then follows
    the work done so far, which grows with time like much else."""
    return 0, math.log10(max(about.session, 1e-12))


def _of_row(x: Array, row: tuple[int | None, int | None], about: About) -> tuple[float, float]:
    """Gain and offset per degree, taken from the parameters of a search."""
    gain, offset = (0.0 if place is None else float(x[place]) for place in row)
    return 0.01 * gain, 0.01 * about.output_range * offset


def _kept(share: Array) -> Array:
    """Coefficients of the temperature and of the heat of each step, for step lengths in time constants; the next step's
    heat does not enter."""
    return np.stack([np.exp(-share), -np.expm1(-share), np.zeros(len(share))])


SHAPES = (LoggedThermal, SelfHeating, HysteresisHeating)


def load() -> None:
    """Compile the recursions, or load them from the cache, by running them on two samples."""
    lost(np.arange(2.0), 1.0, np.empty(2), np.empty(1))
