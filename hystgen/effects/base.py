"""The base of all effects: parameters with units, a place in the chain, a forward model and shapes to try in a fit.

Signals are linear between samples, so the filters are exact for a piecewise linear drive at any time steps. Before its
first sample, a record has been at rest at that sample's drive.
"""

from __future__ import annotations

import enum
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict

from hystgen.basics.jit import jit
from hystgen.basics.problems import counted
from hystgen.effects import guarded
from hystgen.effects.kinds import OwnBlock
from hystgen.plays import operators

Array = NDArray[np.float64]


class Place(enum.Enum):
    """Where an effect sits, in the order of the chain; within a place, `order` decides."""

    DRIVE = "drive"
    PLAYS = "plays"
    LINEAR = "linear"
    GAIN = "gain"
    OUTPUT = "output"
    ADDED = "added"


USER = "user:"
"""Prefix of the names of a user's own effects."""

MOST_BYTES = 2**25
"""[bytes] Maximum memory for the factors that a record caches."""


@dataclass(frozen=True)
class Run:
    """One record as an effect sees it, N samples.

    `t`: session time in s, rising; `v`: the drive as recorded; `extra`: further columns by name; `rest`: length in s of
    the pause before the first sample, at the previous drive (`chain.join` turns it into samples).
    """

    t: Array
    v: Array
    extra: Mapping[str, Array] = field(default_factory=dict)
    rest: float = 0.0
    within: tuple[Run, NDArray[np.intp]] | None = field(default=None, repr=False, compare=False)
    """the longer run from which these samples are taken, including its first and last samples"""

    def picked(self, places: NDArray[np.intp]) -> Run:
        """The run at some of its samples; sums from sample to sample still include every sample."""
        extra = {name: column[places] for name, column in self.extra.items()}
        return Run(self.t[places], self.v[places], extra, self.rest, (self, places))

    @cached_property
    def steps(self) -> Array:
        """Seconds from each sample to the next (N - 1,)."""
        return np.diff(self.t)

    @cached_property
    def drive_range(self) -> float:
        """Largest minus smallest drive."""
        return float(np.ptp(self.v))

    @cached_property
    def travelled(self) -> Array:
        """Distance `sum |dv|` that the drive has travelled up to each sample, input units."""
        if self.within is not None:
            whole, places = self.within
            return whole.travelled[places]
        return np.concatenate([[0.0], np.cumsum(np.abs(np.diff(self.v)))])

    @cached_property
    def heat(self) -> Array:
        """Mean of `|v v'|/2` from each sample to the next (N - 1,)."""
        if self.within is not None:
            whole, places = self.within
            return np.add.reduceat(whole.heat * whole.steps, places[:-1]) / self.steps
        return 0.5 * np.abs(np.diff(0.5 * self.v * np.abs(self.v))) / self.steps

    def factors(self, time_constant: float) -> Array:
        """`decays` over the steps for a time constant, (3, N - 1)."""
        return self.remembered(time_constant, lambda: self.of_steps(lambda s: np.stack(decays(s, time_constant))))

    def spectrum(self, time_constants: tuple[float, ...]) -> Array:
        """`decays` over the `different` steps for several time constants, (3, steps, time constants)."""

        def make() -> Array:
            steps, _ = self.different
            return np.ascontiguousarray(np.stack([decays(steps, each) for each in time_constants], axis=2))

        return self.remembered(time_constants, make)

    def of_steps(self, make: Callable[[Array], Array]) -> Array:
        """Values for each step, (k, N - 1), computed once per step length."""
        steps, place = self.different
        return make(steps).take(place, axis=1) if len(steps) < len(place) // 2 else make(self.steps)

    @cached_property
    def different(self) -> tuple[Array, NDArray[np.intp]]:
        """The distinct step lengths, and for each step the index of its length."""
        return np.unique(self.steps, return_inverse=True)

    def remembered(self, by: Hashable, make: Callable[[], Array]) -> Array:
        """Cached values computed from the steps and some parameters; a search reuses most of them."""
        found = self._made.pop(by, None)
        if found is None:
            found = make()
        if found.nbytes * (len(self._made) + 1) > MOST_BYTES and self._made:
            del self._made[next(iter(self._made))]
        self._made[by] = found  # the most recent comes last
        return found

    @cached_property
    def _made(self) -> dict[Hashable, Array]:
        return {}


@dataclass(frozen=True)
class About:
    """Properties of the records for which shapes are listed."""

    drive: tuple[float, float]
    output_range: float
    sample_time: float
    """of the most finely sampled record, s"""
    duration: float
    """of the longest record, s"""
    session: float
    """from the first to the last sample of all records, s"""
    fastest: float
    """largest |dv/dt|, input/s"""
    travel: float
    """sum of |dv| over all records, input"""
    thresholds: tuple[float, ...]
    columns: frozenset[str] = frozenset()
    """further columns that every record has"""
    ends: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """smallest and largest value of each of them"""
    ringing: tuple[float, ...] = ()
    """frequencies in Hz at which the error so far has narrow peaks, strongest first"""
    timed: bool = True
    """whether the records' times are known"""
    output: tuple[float, float] = (0.0, 0.0)
    """smallest and largest measured output of all records"""
    speeds: bool = True
    """whether the drive covers equal distances in different times, so that travel is not time"""


@dataclass(frozen=True)
class Candidate:
    """One shape of an effect to try in a fit: free parameters within bounds, and the effect that they make.

    `low`, `high`, `start`: in the fit's own coordinates, of order one; `none`: parameters at which the effect does
    nothing; `others`: further starts, in case the error has several minima; `beyond`: label of a simpler shape that
    this shape contains, which is not tried unless the simpler one helps; `grown`: makes a start from the simpler
    shape's parameters; `amounts`: indices of parameters that scale the effect, which a search finds first from every
    start, since at a wrong amount the other parameters mean little; `levels_off`: index of the logarithm of a time
    constant, and its largest value at which the records show the effect level off. Above that the effect only grows
    within the records, as a disturbance may, so it is not named.
    """

    label: str
    low: Array
    high: Array
    start: Array
    build: Callable[[Array], Effect]
    none: Array | None = None
    others: tuple[Array, ...] = ()
    beyond: str = ""
    grown: Callable[[Array], Array] | None = None
    amounts: tuple[int, ...] = ()
    levels_off: tuple[int, float] | None = None

    def at(self, numbers: Array) -> Candidate:
        """The same shape with all parameters except the amounts fixed at the given values."""
        free = np.isin(np.arange(len(numbers)), self.amounts)
        return replace(self, low=np.where(free, self.low, numbers), high=np.where(free, self.high, numbers))


Problem = tuple[tuple[str | int, ...], str]
"""An inconsistency in an effect: the keys concerned, and a message."""


def without_plays(thresholds: tuple[float, ...] | None) -> Iterator[Problem]:
    """A problem unless the model has plays with a threshold, which an effect needs."""
    if thresholds is not None and len(thresholds) < 2:
        yield ("name",), "acts on plays with a threshold, and the model has none; remove the entry"


def not_one_a_play(
    key: str, values: Sequence[object], thresholds: tuple[float, ...] | None, what: str = "value"
) -> Iterator[Problem]:
    """A problem unless a key has one of `what` for each play with a threshold."""
    if thresholds is not None and len(thresholds) > 1 and len(values) != len(thresholds) - 1:
        counts = f"{counted(len(values), what)} for {counted(len(thresholds) - 1, 'play')}"
        yield (key,), f"has {counts}; give one for each threshold but r_0"


def not_as_many(key: str, values: Sequence[object], other: str, others: Sequence[object]) -> Iterator[Problem]:
    """A problem unless a key has as many values as another key."""
    if len(values) != len(others):
        yield (key,), f"has {counted(len(values), 'value')} for {len(others)} in {other}; give as many as {other}"


Compensated = Literal[
    "exact", "approximate", "needs a sensor", "none needed", "none without preview", "none", "not known"
]


class Effect(BaseModel):
    """An effect with its parameters; a subclass defines a `place`, a method of that place and the YAML entry's keys.

    A method that is not overridden leaves its signal unchanged.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    name: str
    place: ClassVar[Place]
    order: ClassVar[int] = 0
    selector: ClassVar[str] = "shape"
    """key that distinguishes the shapes of one name"""
    repeatable: ClassVar[bool] = False
    """whether a model may have several effects of this name"""
    timed: ClassVar[bool] = True
    """whether the times of the samples matter"""
    pointwise: ClassVar[bool] = False
    """whether the result of `bent` or `mapped` depends only on the sample itself, not on the run"""
    slews: ClassVar[bool] = False
    """whether it limits the rate of the drive, to its parameters `rate` and `falling_rate`"""
    columns: ClassVar[tuple[str, ...]] = ()
    """further columns that every effect of this class needs"""
    fades: ClassVar[bool] = False
    """whether a pause before a record with a known history brings its start state to rest"""
    forgets: ClassVar[bool] = True
    """whether drives or a rest can erase what it remembers"""
    settled: ClassVar[tuple[str, ...]] = ()
    """keys that a refit leaves unchanged: conventions, and parameters that a fit cannot separate from others"""
    later: ClassVar[tuple[str, ...]] = ()
    """keys added after the first files were written: at their defaults, files and the hash leave them out"""
    hint: ClassVar[str] = ""
    """suggestion printed with an error about a wrong or missing key"""
    compensated: ClassVar[Compensated] = "not known"
    """how well a compensator can compensate the effect"""
    compensation: ClassVar[str] = ""
    """how it does so, in one clause"""
    mistaken: ClassVar[Mapping[str, tuple[str, str]]] = {}
    """warnings about the inverse if the records could not tell the effect from another, by the other's name: one in
    case the other was chosen, one in case this effect was"""
    shown_by: ClassVar[Mapping[str, int]] = {}
    """planned records that show it, and its rank among the effects that each record shows, 1 for the most visible"""
    rank: ClassVar[float] = math.inf
    """order of effects that explain records equally well: a lag or delay, as in every drive, before plays that lag"""
    creeps: ClassVar[bool] = False
    """whether it is the motion that goes on long after the drive has stopped, drawn on a logarithmic time axis"""
    from_start: ClassVar[bool] = False
    """whether it depends on the time since the first sample"""
    block: ClassVar[OwnBlock | None] = None
    """compensator of a user's own effect; those of the catalogue are in their effects' folders"""

    @classmethod
    def __pydantic_init_subclass__(cls, **_: object) -> None:
        """Guard the methods of a user's own effect, which may fail or return anything."""
        words = getattr(cls.model_fields["name"].annotation, "__args__", ())
        if words and str(words[0]).startswith(USER):
            guarded.guard(cls, Effect, str(words[0]))

    @property
    def read(self) -> tuple[str, ...]:
        """Further columns that a record needs for this effect."""
        return self.columns

    @property
    def needs_time(self) -> bool:
        """Whether the times of the samples matter to this effect."""
        return self.timed

    def problems(self, thresholds: tuple[float, ...] | None) -> Iterator[Problem]:
        """Contradictions between parameters, as (keys, message); `thresholds`: of the model, None if unknown."""
        yield from ()

    def problems_within(self, low: float, high: float) -> Iterator[str]:
        """Contradictions between parameters and the range of the input of the plays."""
        yield from ()

    def remarks(self, thresholds: tuple[float, ...]) -> list[str]:
        """Further lines of `hystgen show` about the effect in a model with these thresholds."""
        return []

    @property
    def dead_time(self) -> float:
        """DRIVE: time in s before a change of the drive has any effect."""
        return 0.0

    def corrected(self, resonance: str) -> str:
        """How a compensator compensates the effect, in one clause; `resonance`: `emit.compensation.resonance`."""
        return self.compensation

    def time_scale(self, drive_range: float) -> float:
        """Longest time constant, or duration of a move over the drive's range, in s; 0 for an effect without either,
        inf for an effect that never ends."""
        return 0.0

    def response(self, hertz: Array) -> NDArray[np.complex128] | None:
        """DRIVE, LINEAR: frequency response (N,), 1 at rest; None for an effect that has none or is slow."""
        return None

    @property
    def corner(self) -> tuple[float, str] | None:
        """The frequency in Hz that marks its response, and the word for it; None for an effect without one."""
        return None

    def drive(self, a: Array, run: Run) -> Array:
        """DRIVE: the drive (N,) behind the effect."""
        return a

    def plays(self, w: Array, run: Run, thresholds: Array, start: Array) -> Array:
        """PLAYS: the moving plays, rows (n+1, N) for their input `w` (N,); one effect per model may override it."""
        return operators.plays(w, thresholds, start)

    @classmethod
    def moves_plays(cls) -> bool:
        """Whether the effect sets how the plays move."""
        return cls.plays is not Effect.plays

    def summed(self, p: Array, w: Array, run: Run, thresholds: Array, start: Array) -> Array:
        """PLAYS: sum (N,) of the plays with weights `p`; plays of weight 0 need not be computed."""
        return operators.play_sum(w, thresholds, start, p)

    @classmethod
    def bends_plays(cls) -> bool:
        """Whether the effect bends the plays' rows."""
        return cls.bent is not Effect.bent

    def bent(self, rows: Array, thresholds: Array) -> Array:
        """PLAYS: the plays' rows (n+1, N) in the form in which the weights sum them."""
        return rows

    def bent_sum(self, p: Array, rows: Array, thresholds: Array) -> Array:
        """PLAYS: sum (N,) of the bent rows with weights `p`."""
        return np.asarray(p @ self.bent(rows, thresholds))

    @classmethod
    def joins_plays(cls) -> bool:
        """Whether the effect adds a term to the play sum."""
        return cls.parallel is not Effect.parallel

    def parallel(self, w: Array) -> Array:
        """PLAYS: the term (N,) in parallel with the plays, a function of their input `w` (N,) alone, which was at rest
        at its first sample."""
        return np.zeros(len(w))

    def filtered(self, h: Array, run: Run) -> Array:
        """LINEAR: every row of `h`, (N,) or (k, N), filtered separately, from rest at its first sample."""
        return h

    def gain(self, run: Run) -> Array:
        """GAIN: factor (N,)."""
        return np.ones(len(run.t))

    def offset(self, run: Run) -> Array:
        """GAIN: added after the factor (N,)."""
        return np.zeros(len(run.t))

    def gains(self, run: Run) -> tuple[Array, Array]:
        """GAIN: factor and offset (N,) together."""
        return self.gain(run), self.offset(run)

    def mapped(self, y: Array, run: Run) -> Array:
        """OUTPUT: the output (N,) behind the effect."""
        return y

    def added(self, run: Run) -> Array:
        """ADDED: the term added to the output (N,)."""
        return np.zeros(len(run.t))

    def transients(self, run: Run) -> Array:
        """Responses (k, N) to an unknown start state, which a fit may add to a record, each with a free factor."""
        return np.empty((0, len(run.t)))

    def largest(self, run: Run) -> Array:
        """Largest factors (k,) of the `transients` for any start state, in spans of the play sum; inf: no limit."""
        return np.full(len(self.transients(run)), np.inf)

    def numbers(self, seconds: float) -> Sequence[float]:
        """The parameters of the `block`'s table at steps of `seconds`."""
        return ()

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """Shapes to try in a fit, simplest first."""
        return []


class Block(ABC):
    """One block of a compensator in double precision, one sample at a time, at steps of any length in s.

    A compensator solves backwards from the output, which moves nothing, and absorbs the applied drive forwards, so its
    memory holds only what the actuator has seen.
    """

    @abstractmethod
    def advance(self, seconds: float, later: float | None = None) -> None:
        """Advance by `seconds` to the next sample; `later`: time from there to the following sample, None: the same.
        For the first sample, at which everything is at rest, both are the time that follows it."""

    @abstractmethod
    def call(self, verb: str, x: float) -> float:
        """Apply one of the verbs below to x."""

    def resting(self, y: float) -> float:
        """The input that gives the output `y` once everything has settled."""
        return self.call("resting", y)

    def rest(self, x: float) -> float:
        """Settle at the input `x`; returns the output."""
        return self.call("rest", x)

    def solve(self, y: float) -> float:
        """The input that gives the output `y` at this sample."""
        return self.call("solve", y)

    def absorb(self, x: float) -> float:
        """Absorb the input `x` at this sample; returns the output."""
        return self.call("absorb", x)


def span(low: float, high: float) -> tuple[float, float]:
    """Decimal logarithms of the ends of a range of positive numbers; the range is never empty."""
    low = max(low, 1e-12)
    return math.log10(low), math.log10(max(high, 2.0 * low))


def from_zero(grain: float, most: float, start: float) -> tuple[Array, Array, Array, Callable[[float], float]]:
    """Bounds and start of a coordinate x >= 0 with value `grain (10^x - 1)`: logarithmic, but including 0."""

    def value(x: float) -> float:
        return grain * math.expm1(x * math.log(10.0))

    def place(size: float) -> Array:
        return np.array([math.log10(1.0 + size / grain)])

    most = max(most, 2.0 * grain)
    return np.zeros(1), place(most), place(min(start, most)), value


def decays(steps: Array, time_constant: float) -> tuple[Array, Array, Array]:
    """Factors of `x' = (u - x)/tau` over time steps with linear `u`: `x_1 = E x_0 + b_0 u_0 + b_1 u_1`.

    With `s = dt/tau`: `E = exp(-s)`, `b_0 = (1 - E)/s - E`, `b_1 = 1 - (1 - E)/s` (first-order hold, exact). A time
    constant of 0 passes `u` unchanged.
    """
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        s = steps / time_constant if time_constant > 0.0 else np.full(len(steps), np.inf)
        decay = np.exp(-s)
        mean = np.where(s > 0.0, -np.expm1(-s) / s, 1.0)
        # 1 - (1 - E)/s loses its digits for short steps
        late = np.where(s < 1e-3, s * (0.5 - s * (1.0 / 6.0 - s / 24.0)), 1.0 - mean)
    return decay, 1.0 - late - decay, late


# Recursions of several effects, compiled when first used ------------------------------------------------------


@jit
def follow(u: Array, decay: Array, early: Array, late: Array, x: float, out: Array) -> None:
    """First-order filter from the state `x`: `x_(k+1) = decay_k x_k + early_k u_k + late_k u_(k+1)`."""
    out[0] = x
    for k in range(len(u) - 1):
        x = decay[k] * x + early[k] * u[k] + late[k] * u[k + 1]
        out[k + 1] = x


@jit
def curve(u: Array, scale: float, coefficients: Array, weight: float, total: Array) -> None:
    """Add `weight` times `scale xi^2 (c_2 + c_3 xi + ..)`, `xi = u/scale`, to `total`."""
    for k in range(len(u)):
        xi = u[k] / scale
        value = 0.0
        for c in coefficients[::-1]:
            value = c + value * xi
        total[k] += weight * (scale * xi * xi * value)


def load() -> None:
    """Compile these functions, or load them from the cache, by running them on two samples."""
    u, step, out = np.arange(2.0), np.ones(1), np.empty(2)
    follow(u, step, step, step, 0.0, out)
    curve(u, 1.0, step, 1.0, out)
