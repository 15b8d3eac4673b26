"""Creep: slow motion of the play sum as a whole after a move."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from hystgen.basics.jit import jit
from hystgen.basics.problems import counted
from hystgen.basics.quantities import NotNegative, Positive
from hystgen.effects.base import About, Array, Candidate, Compensated, Effect, Place, Problem, Run, not_as_many, span

FASTEST = 0.01
"""[s] Motion that settles faster than this after a move is due to a lag or domain-wall friction, not creep."""

MOST_A_DECADE, MOST_OF_A_STATE = 0.06, 0.2
"""[fractions of the play sum, per decade and per state] Largest values tried: stages creep by 1 to 2 % per decade, some
by up to three times that; with few states, each represents up to three decades. Set by: 16 blind plants with creep
(`make blind FIRST=97000`): with half the first, the creep of one plant is not named and two are 3 and 7 % worse; with
half the second, one is 5 % worse; doubling either changes none by 2 %."""

SHORTER = 1.0
"""[decades] A search for the ends of a logarithmic spectrum begins this far inside the range of the recorded times. Set
by: the same plants; half of it improves one plant by 2 %, twice changes none."""

SHORTEST = 0.3
"""[decades] Minimum width of such a spectrum: a factor of two, less than each of its states represents. Recorded times
(`span`) are never narrower."""

LOGARITHMIC = "creep, logarithmic"

PER_DECADE = 2
"""States per decade of a logarithmic spectrum; their ripple about a straight line in log t is 0.1 % of its slope."""


@jit
def creep(
    u: Array, step: NDArray[np.intp], decay: Array, early: Array, late: Array, weights: Array, states: Array,
    total: Array,
) -> None:
    """Add the first-order filters of every column of `u` (N, R), each times its weight, to `total`.

    `step` (N - 1): the row of `decay`, `early` and `late` (., T) that applies; `states` (T, R): initial states of the
    filters. Several columns, or all filters of one, run in parallel, since a single recursion would stall on its
    previous sample.
    """
    taus, rows = states.shape
    for j in range(taus):
        for i in range(rows):
            total[0, i] += weights[j] * states[j, i]
    if rows == 1:
        for k in range(len(u) - 1):
            s = step[k]
            for j in range(taus):
                states[j, 0] = decay[s, j] * states[j, 0] + early[s, j] * u[k, 0] + late[s, j] * u[k + 1, 0]
            for j in range(taus):
                total[k + 1, 0] += weights[j] * states[j, 0]
        return
    for j in range(taus):
        x, weight = states[j], weights[j]
        for k in range(len(u) - 1):
            s = step[k]
            d, a, b = decay[s, j], early[s, j], late[s, j]
            for i in range(rows):
                x[i] = d * x[i] + a * u[k, i] + b * u[k + 1, i]
                total[k + 1, i] += weight * x[i]


def _states(h: Array, run: Run, time_constants: Array, weights: Array) -> Array:
    """`sum c_i x_i` with `tau_i x_i' = h - x_i`, for each row of `h` separately, settled at its first sample."""
    rows = np.ascontiguousarray(np.atleast_2d(h).T)
    total, states = np.zeros_like(rows), np.repeat(rows[:1], len(weights), axis=0)
    decay, early, late = run.spectrum(tuple(time_constants.tolist()))
    creep(rows, run.different[1], decay, early, late, weights, states, total)
    return total.T.reshape(np.shape(h))


def _fading(run: Run, time_constants: Array) -> Array:
    since = run.t - run.t[0]
    return np.asarray(np.exp(-since[None, :] / np.asarray(time_constants)[:, None]))


class _Creep(Effect):
    name: Literal["creep"] = Field(description="name of the effect")

    place: ClassVar[Place] = Place.LINEAR
    creeps: ClassVar[bool] = True
    shown_by: ClassVar[Mapping[str, int]] = {"holds": 1, "slow_reversals": 1, "settling": 1, "reversals": 1}
    rank: ClassVar[float] = 0
    compensated: ClassVar[Compensated] = "exact"
    compensation: ClassVar[str] = "exact and causal: solved for the plays, with the states known"


class ExponentialCreep(_Creep):
    """Creep added to the play sum: `y = h + sum c_i x_i`, `tau_i x_i' = h - x_i`.

    Springs and dampers in series behind the play sum `h` (Croft, Shed, Devasia: Creep, hysteresis, and vibration
    compensation for piezoactuators, J. Dyn. Sys., Meas., Control 123, 2001). A record starts settled: `x_i = h`.
    """

    shape: Literal["exponential"] = Field(default="exponential", description="a few independent states")
    time_constants: Annotated[tuple[Positive, ...], Field(min_length=1, max_length=64)] = Field(
        description="tau_i, s", examples=[[0.1, 1.0]]
    )
    weights: Annotated[tuple[NotNegative, ...], Field(min_length=1, max_length=64)] = Field(
        description="c_i, as many as time_constants, fractions of the play sum", examples=[[0.02, 0.01]]
    )

    def problems(self, thresholds: tuple[float, ...] | None) -> Iterator[Problem]:
        """A problem unless there is one weight for each time constant."""
        yield from not_as_many("weights", self.weights, "time_constants", self.time_constants)

    def time_scale(self, drive_range: float) -> float:
        """The longest time constant."""
        return max(self.time_constants)

    def filtered(self, h: Array, run: Run) -> Array:
        """The play sum with its creep."""
        return h + _states(h, run, np.array(self.time_constants), np.array(self.weights))

    def transients(self, run: Run) -> Array:
        """`exp(-t/tau_i)`."""
        return _fading(run, np.array(self.time_constants))

    def largest(self, run: Run) -> Array:
        """The weights: a state lags behind the play sum by at most the sum's span."""
        return np.array(self.weights)

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """One state, then two, and three if two help; time constants from a few samples to beyond the session."""
        low, high = span(max(4.0 * about.sample_time, FASTEST), 3.0 * about.session)

        def build(x: Array) -> ExponentialCreep:
            half = len(x) // 2
            return cls(
                name="creep",
                time_constants=tuple((10.0 ** x[:half]).tolist()),
                weights=tuple((0.1 * x[half:]).tolist()),
            )

        found: list[Candidate] = []
        for n in (1, 2, 3):
            places = low + (high - low) * (np.arange(n) + 0.5) / n
            found.append(
                Candidate(
                    f"creep, exponential, {counted(n, 'state')}",
                    np.concatenate([np.full(n, low), np.zeros(n)]),
                    np.concatenate([np.full(n, high), np.full(n, MOST_OF_A_STATE / 0.1)]),
                    np.concatenate([places, np.full(n, 0.1)]),
                    build,
                    np.concatenate([places, np.zeros(n)]),
                    beyond=found[1].label if n == 3 else "",
                    amounts=tuple(range(n, 2 * n)),
                )
            )
        return found


class LogarithmicCreep(_Creep):
    """Creep along log t: after a step of the play sum `y = h (1 + g log10(t/t_0))` for t between t_min and t_max.

    The law is from the piezo literature (Jung, Shim, Gweon: New open-loop actuating method of piezoelectric actuators
    for removing hysteresis and creep, Rev. Sci. Instrum. 71, 2000); it is realised by states with equal weights and
    time constants evenly spaced in log t from t_min to t_max, and a gain chosen so that a step reaches its full
    height at t_0.
    """

    shape: Literal["logarithmic"] = Field(description="a spectrum of states, evenly spaced in log t")
    per_decade: NotNegative = Field(description="g, fraction of the play sum per decade of time", examples=[0.015])
    t0: Positive = Field(default=0.1, description="s after a step at which it has its full height")
    t_min: Positive = Field(default=1e-3, description="shortest time constant, s")
    t_max: Positive = Field(default=1e3, description="longest time constant, s")

    settled: ClassVar[tuple[str, ...]] = ("t0", "t_min", "t_max")

    def problems(self, thresholds: tuple[float, ...] | None) -> Iterator[Problem]:
        """A problem unless t_min < t_max, at most 12 decades apart."""
        if not self.t_min < self.t_max:
            yield ("t_max",), f"{self.t_max!r} is not above t_min = {self.t_min!r}; give seconds, t_min < t_max"
        elif self.t_max > 1e12 * self.t_min:
            yield ("t_max",), "is more than 12 decades above t_min; narrow the two"

    def time_scale(self, drive_range: float) -> float:
        """The longest time constant."""
        return self.t_max

    def spectrum(self) -> tuple[Array, float]:
        """Time constants and the weight of each."""
        decades = math.log10(self.t_max / self.t_min)
        n = max(1, math.ceil(PER_DECADE * decades - 1e-9))
        spacing = decades / n
        places = math.log10(self.t_min) + (np.arange(n) + 0.5) * spacing
        return np.asarray(10.0**places, dtype=np.float64), self.per_decade * spacing

    @property
    def at_once(self) -> float:
        """Fraction of a step that arrives at once, chosen so that the step reaches its full height at t_0."""
        tau, weight = self.spectrum()
        return 1.0 - weight * float(np.sum(-np.expm1(-self.t0 / tau)))

    def filtered(self, h: Array, run: Run) -> Array:
        """The play sum with its creep."""
        tau, weight = self.spectrum()
        return self.at_once * h + _states(h, run, tau, np.full(len(tau), weight))

    def transients(self, run: Run) -> Array:
        """`exp(-t/tau_i)` for one time constant per decade, enough for any start state of the spectrum."""
        return _fading(run, self.spectrum()[0][::PER_DECADE])

    def largest(self, run: Run) -> Array:
        """The weight of a decade for each: its states lag behind the play sum by at most the sum's span."""
        tau, weight = self.spectrum()
        return np.full(len(tau[::PER_DECADE]), PER_DECADE * weight)

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """The fraction per decade over the whole recorded time; then, if that helps, with free ends of the spectrum."""
        low, high = span(max(0.5 * about.sample_time, FASTEST), 10.0 * about.session)
        t0 = min(max(0.1, about.sample_time), about.duration)
        # A longer spectrum only changes the gain, which the weights of the plays absorb
        whole = (10.0**low, 10.0**high)

        def even(x: Array) -> LogarithmicCreep:
            return cls(
                name="creep", shape="logarithmic", per_decade=0.1 * float(x[0]), t0=t0, t_min=whole[0], t_max=whole[1]
            )

        def ended(x: Array) -> LogarithmicCreep:
            first, decades = float(x[1]), float(x[2])
            return cls(
                name="creep", shape="logarithmic", per_decade=0.1 * float(x[0]), t0=t0,
                t_min=10.0**first, t_max=10.0 ** (first + decades),
            )

        wide = high - low
        inside = min(SHORTER, 0.5 * (wide - SHORTEST))  # a short session may span fewer decades
        return [
            Candidate(
                LOGARITHMIC, np.zeros(1), np.array([MOST_A_DECADE / 0.1]), np.array([0.1]), even, np.zeros(1),
                amounts=(0,),
            ),
            Candidate(
                "creep, logarithmic, free ends",
                np.array([0.0, low, SHORTEST]), np.array([MOST_A_DECADE / 0.1, high - SHORTEST, wide]),
                np.array([0.1, low, wide]), ended, np.array([0.0, low, wide]),
                beyond=LOGARITHMIC, amounts=(0,), grown=lambda x: np.array([x[0], low + inside, wide - 2.0 * inside]),
            ),
        ]


SHAPES = (ExponentialCreep, LogarithmicCreep)


def load() -> None:
    """Compile the recursions, or load them from the cache, by running them on two samples."""
    one, total = np.ones((1, 1)), np.empty((2, 1))
    creep(np.arange(2.0)[:, None], np.zeros(1, dtype=np.intp), one, one, one, np.ones(1), np.ones((1, 1)), total)
