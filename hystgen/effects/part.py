"""A part of a compensator's chain: one kind of block, described once in the folder of its effect."""

from __future__ import annotations

import functools
import importlib
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hystgen.effects.base import Array, Place
from hystgen.effects.kinds import Constants, Kind

Function = Callable[..., Any]


class Led(NamedTuple):
    """How the only block in front of the plays is led where what follows depends on the way there: where it is, the
    input that leads to an output, the one that is kept, what follows from an input, and what is missed of a way in its
    first sample; and the input from which it does not overshoot behind a slew limit, found by so many `halves`."""

    state: Function
    solve: Function
    kept: Function
    absorb: Function
    missed: Function
    braked: Function
    halves: int = 0


@dataclass(frozen=True)
class Verbs:
    """What blocks of one kind do in one arithmetic: functions of the tables and the memory of all of them, the index of
    a block, and numbers. The chain calls those that a kind has.

    `memory`: made for tables and a dtype; `rest`, `absorb`, `resting`, `solve`: of a block that signals pass; without
    `rest` it settles as it absorbs, without `resting` it rests as it solves.

    `reset`: as in the parameter file; `move`: the drive has moved from one value to another in one sample; `set_*`: by
    a number from the caller, and whether that had to be limited; `travelled`: of the memory alone, the way so far.
    `added`: to the displacement, now; `lead`: a reference has come, whether or not it is the first one; `ahead`: added
    to the displacement by the time of the newest reference, by whether there are any and whether the drive has moved.
    `led`: of a block in front of the plays that may be led.
    """

    memory: Function
    rest: Function | None = None
    absorb: Function | None = None
    resting: Function | None = None
    solve: Function | None = None
    reset: Function | None = None
    move: Function | None = None
    set_temperature: Function | None = None
    set_gain: Function | None = None
    set_travel: Function | None = None
    travelled: Function | None = None
    added: Function | None = None
    lead: Function | None = None
    ahead: Function | None = None
    led: Led | None = None

    def verb(self, name: str) -> Function | None:
        """The function that does this."""
        found: Function | None = getattr(self, name)
        instead = {"rest": self.absorb, "resting": self.solve}
        return found or instead.get(name)


class Margin(NamedTuple):
    """How far sizes of signals reach beyond those without rounding: a factor, and the `span` of the output, beyond
    which no block adds anything; `turning`: what follows a block in front of the plays depends on the way there."""

    slack: float
    span: float = 0.0
    turning: bool = False


class Responses(NamedTuple):
    """What blocks of an inverse make of frequencies (N,): the lead, the share of what is wanted that arrives in front
    of the plays, the response behind them, what of that comes at once, and the gain at rest."""

    led: NDArray[np.complex128]
    arriving: NDArray[np.complex128]
    passed: NDArray[np.complex128]
    direct: float
    rest: float


class Speed(NamedTuple):
    """How fast a drive within `ends` moves: by at most `step` in each of steps of `seconds`."""

    ends: tuple[float, float]
    step: float
    seconds: float


class Gained(NamedTuple):
    """A gain behind the plays: roundings of its own, its ends, and what it adds to errors of its output (`there`) and
    of the output asked for (`back`)."""

    roundings: float
    least: float
    largest: float
    there: float
    back: float


class One:
    """One block at a step length, in double precision."""

    @property
    def growth(self) -> float:
        """Largest output for inputs within 1."""
        return 1.0

    @property
    def misses(self) -> bool:
        """Whether what arrives differs from what it was solved for."""
        return False

    @property
    def remembers(self) -> bool:
        """Whether it has states that see what it gets."""
        return False

    def rounding(self, size: float, u: float) -> tuple[float, float]:
        """Roundings of the output for inputs within `size`, and of the input that it is solved for."""
        return 0.0, 0.0

    def solved(self, error: float, size: float, u: float, same: bool) -> float:
        """Error of the input that it is solved for, by one of the output; `same`: its states have seen the same."""
        return error

    def seen(self) -> float:
        """Factor by which states that see its input multiply an error of that."""
        return 1.0

    def gained(self, speed: Speed, output: float, u: float, emitted: bool) -> Gained:
        """It as a gain, for outputs within a size; `emitted`: with the approximations of the C."""
        return Gained(0.0, 1.0, 1.0, 0.0, 0.0)

    def at_rest(self, x: float) -> float:
        """The settled output for an input."""
        return x

    @property
    def lead(self) -> float:
        """Largest gain of its inverse."""
        return 1.0

    @property
    def room(self) -> float:
        """The same, for results on the way."""
        return self.lead

    @property
    def fineness(self) -> float:
        """Bits that its lead takes from a signal in front of the plays, 0 for none."""
        return 0.0

    def farthest(self, ends: tuple[float, float], span: float, seconds: float) -> float:
        """Largest move of a drive within `ends` that may be repeated in every step, where the output spans `span`."""
        return math.inf

    @property
    def ringing(self) -> Array:
        """Frequencies (k,) in rad a sample at which its inverse may ring."""
        return np.empty(0)

    def respond(self, z: NDArray[np.complex128], found: Responses) -> Responses:
        """What it makes of frequencies, `z` (N,) the factor of a delay by a sample, behind other blocks."""
        return found

    def grown(self, size: float, margin: Margin) -> float:
        """Largest output for inputs within a size."""
        return size

    def asked(self, given: float, asked: float, margin: Margin) -> float:
        """Largest input that it is solved for, by outputs within a size and after inputs `given`."""
        return asked


class CodedGain(NamedTuple):
    """A gain in fixed point: its ends, and in output codes what it adds to errors of its output and of its input that
    is solved for, beside the rounding of either, and the largest offset."""

    least: float
    largest: float
    there: float
    back: float
    offset: float = 0.0


class Coding(NamedTuple):
    """Units per code of drive and output, and the `span` of the output in codes."""

    drive_lsb: float
    output_lsb: float
    span: float


class Sought(NamedTuple):
    """What a block behind the plays is solved for: sizes of its input and of the sum asked of the plays, the unit of
    signals, how far states that see the sum of the plays, and their inputs, may be `apart`; `same`: they are not."""

    size: float
    asked: float
    signal: float
    apart: float
    seen: float
    same: bool


class Coded:
    """One block in fixed point; errors of those behind the plays are in output codes, of those in front in signals."""

    one: Any

    @property
    def arrived(self) -> float:
        """Roundings of the output in front of the plays."""
        return 0.0

    @property
    def follows(self) -> float:
        """What a change of its input in one sample is of the output."""
        return 1.0

    def there(self, size: float, signal: float) -> float:
        """Roundings of the output for inputs within a size, with signals of this unit."""
        return 0.0

    def solved(self, error: float, at: Sought) -> float:
        """Error of the input that it is solved for, by one of the output."""
        return error

    def residual(self, missed: float, same: bool) -> float:
        """The error of an output that the inverse makes of one of the sum of the plays."""
        return missed

    def gain(self, size: float, speed: Speed, at: Coding) -> CodedGain | None:
        """It as a gain, for inputs within a size."""
        return None


@dataclass(frozen=True)
class Surroundings:
    """What the tables of a part depend on beside its blocks: the length of a step, the `ends` of the drive's range, the
    `span` of the output, by how many samples references come `ahead`, and whether a lead is `braked`."""

    seconds: float
    ends: tuple[float, float]
    span: float
    ahead: int
    braked: int


@dataclass(frozen=True)
class FloatSurroundings(Surroundings):
    """The same in floating point: `reals` makes numbers, with a name, those of the arithmetic, which rounds by
    `roundoff`."""

    reals: Callable[[Any, str], Any]
    roundoff: float


@dataclass(frozen=True)
class FixedSurroundings(Surroundings):
    """The same in fixed point: units per code, `bits` of signals behind the plays below a code, those of a code and the
    largest one, fraction bits of a `temperature`, the largest `drive` in codes, and the span in signals, `farthest`."""

    drive_lsb: Fraction
    output_lsb: Fraction
    bits: int
    code_bits: int
    code_max: int
    temperature: int
    drive: int
    farthest: int
    margin: Margin

    @property
    def level(self) -> float:
        """Signals per unit of the output."""
        return 2.0**self.bits / float(self.output_lsb)


@dataclass(frozen=True)
class Realized:
    """A kind of block in one arithmetic: its verbs, its constants from its tables, and tables of blocks; in fixed point
    of their `formats`, each of a block, surroundings, and the largest sizes of its input and of the output asked for.
    `beside`: constants of what stands beside each block.
    """

    verbs: Verbs
    constants: Callable[[Any], Iterable[Constants]]
    tables: Callable[[Sequence[Any], Any], Any]
    formats: Callable[[Any, FixedSurroundings, float, float], Any] = lambda one, *_: one
    beside: Callable[[Any], Iterable[Constants | None]] = lambda _: ()


def late(effect: str, name: str = "ARITHMETIC") -> Callable[[], Realized]:
    """What the fixed point of an effect realizes, which is imported where it is asked for."""

    def realized() -> Realized:
        found: Realized = getattr(importlib.import_module("hystgen.effects." + effect + ".fixed"), name)
        return found

    return realized


def called(name: str, only: Callable[[Any], bool] | None = None) -> Callable[[Any], bool]:
    """Whether an effect has a name, and if so is `only` one of these."""
    return lambda effect: effect.name == name and (only is None or only(effect))


def given(place: Place) -> Callable[[Any], bool]:
    """Whether an effect brings a block of its own, in front of the plays or else behind them."""
    return lambda effect: effect.block is not None and (effect.place is Place.DRIVE) == (place is Place.DRIVE)


@dataclass(frozen=True)
class ChainPart:
    """One kind of block. `name`: as in C; `words`: in messages; `takes`: whether an effect is one; `one`: a block of
    an effect at a step length, where it may be `turning`; `calls`: of the interface that it answers; `forward`: only
    the forward operator has it; `joined`: all of them are one block; `kinds`: of its C, in floating point; `coded`:
    it in fixed point, which is imported where a model is in fixed point."""

    name: str
    words: str
    takes: Callable[[Any], bool]
    one: Callable[[Any, float, bool], Any]
    floating: Realized
    coded: Callable[[], Realized]
    calls: tuple[str, ...] = ()
    forward: bool = False
    joined: bool = False
    kinds: tuple[Kind, ...] = ()

    @functools.cached_property
    def fixed(self) -> Realized:
        """It in fixed point."""
        return self.coded()

    def arithmetic(self, fixed: bool) -> Realized:
        """It in fixed point, or else in floating point."""
        return self.fixed if fixed else self.floating
