"""A part of a compensator's chain: one kind of block, described once in the folder of its effect."""

from __future__ import annotations

import functools
import importlib
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystgen.basics.jit import Action, Answer, Check, Scalar
from hystgen.effects.base import Array, Block, Effect, Place
from hystgen.effects.kinds import BlockKind, Constants

Function = Callable[..., Any]


class Led(NamedTuple):
    """How to lead the only block in front of the plays if the blocks behind it depend on its path. `state`: its state;
    `solve`: the input for an output; `kept`: an input that does not turn it back; `absorb`: notes its move; `missed`:
    how far it falls short of a move in the first sample; `braked`: the input that does not overshoot behind a slew
    limit, found by `halves` halvings in floating point, and in fixed point among numbers up to `coarse`."""

    state: Answer
    solve: Callable[..., tuple[Scalar, Scalar]]
    kept: Answer
    absorb: Action
    missed: Answer
    braked: Callable[..., Any]
    halves: int = 0
    coarse: int = 0


@runtime_checkable
class Leading(Protocol):
    """The block that `Led` leads, in double precision. `rises`: the direction of arrival, in front of two branches;
    with `always_led` it is led however long a step is; `exact`: whether it is inverted exactly in this step;
    `patience`: the fraction of the distance to the other branch by which it falls short in the first sample of a turn;
    `braked`: the drive at which it does not overshoot, from the nearest reachable drive, `short` of the answer."""

    rises: Callable[[], bool] | None
    always_led: bool
    exact: bool

    @property
    def patience(self) -> float: ...
    def braked(self, near: float, short: float, falling: float, rising: float) -> float: ...


class Following(Protocol):
    """A gain behind the plays that depends on the drive, in double precision at steps of any length. `solve`: the input
    that gives output y if the drive goes from `before` (NaN at the first sample) to `drive`; `move`: it has done so."""

    def solve(self, y: float, before: float, drive: float, seconds: float) -> float: ...
    def move(self, before: float, drive: float, seconds: float) -> None: ...


@dataclass(frozen=True)
class Verbs:
    """The functions of one kind of block in one arithmetic; arguments: tables and memory of all blocks, the index of a
    block, and numbers. The chain calls those functions that a kind has.

    `memory`: for given tables and dtype; `rest`, `absorb`, `resting`, `solve`: for a block that passes signals;
    without `rest`, absorb also settles it, without `resting`, solve also serves at rest.

    `reset`: to the parameter file's state; `move`: the drive has moved from one value to another in one sample;
    `tick`: a sample has passed; `set_column`: as `set_*`, for the column of this index, -1 for the temperature;
    `set_*`: set a number from the caller, and return whether it had to be limited; `travelled`: the travel, from the
    memory alone. `added`: addition to the displacement now; `lead`: a reference has arrived, with a flag for any but
    the first; `ahead`: addition to the displacement at the newest reference's time, with flags for whether there is a
    reference and whether the drive has moved. `led`: for a block in front of the plays that may be led.
    """

    memory: Callable[..., object]
    rest: Answer | None = None
    absorb: Answer | None = None
    resting: Answer | None = None
    solve: Answer | None = None
    reset: Action | None = None
    move: Action | None = None
    set_column: Check | None = None
    tick: Action | None = None
    set_gain: Check | None = None
    set_travel: Check | None = None
    travelled: Answer | None = None
    added: Answer | None = None
    lead: Action | None = None
    ahead: Answer | None = None
    led: Led | None = None

    def verb(self, name: str) -> Answer | None:
        """The function for a verb."""
        found: Answer | None = getattr(self, name)
        instead = {"rest": self.absorb, "resting": self.solve}
        return found or instead.get(name)


class Margin(NamedTuple):
    """How far signals can exceed the sizes they have without rounding: by the factor `slack`; `span`: of the output,
    the most that a block adds; `turning`: blocks behind the led block depend on its direction."""

    slack: float
    span: float = 0.0
    turning: bool = False


class Responses(NamedTuple):
    """Frequency responses (N,) of the blocks of an inverse: the lead, the fraction of the target that arrives in front
    of the plays, the response behind them, its immediate part, and the gain at rest."""

    led: NDArray[np.complex128]
    arriving: NDArray[np.complex128]
    passed: NDArray[np.complex128]
    direct: float
    rest: float


class Speed(NamedTuple):
    """How fast a drive within `ends` moves: by at most `step` in each step of `seconds`."""

    ends: tuple[float, float]
    step: float
    seconds: float


class Gained(NamedTuple):
    """A gain behind the plays: its number of roundings, its smallest and largest values, and its contributions to the
    errors of its output (`there`) and of the requested output (`back`)."""

    roundings: float
    least: float
    largest: float
    there: float
    back: float


class Arithmetical(Protocol):
    """A model's tables, which know their kind of arithmetic."""

    @property
    def fixed(self) -> bool: ...


class One:
    """One block at a step length, in double precision."""

    @property
    def growth(self) -> float:
        """Largest output for inputs of magnitude at most 1."""
        return 1.0

    @property
    def misses(self) -> bool:
        """Whether the output differs from the one solved for."""
        return False

    @property
    def remembers(self) -> bool:
        """Whether it has states that follow its input."""
        return False

    def rounding(self, size: float, u: float) -> tuple[float, float]:
        """Rounding errors of the output for inputs up to `size`, and of the inverse."""
        return 0.0, 0.0

    def solved(self, error: float, size: float, u: float, same: bool) -> float:
        """Error of the inverse for an error of the output; `same`: the states have seen the same inputs."""
        return error

    def seen(self) -> float:
        """Factor by which states that follow the input amplify an error of the input."""
        return 1.0

    def gained(self, speed: Speed, output: float, u: float, emitted: bool) -> Gained:
        """The block's properties as a gain, for outputs up to `output`; `emitted`: with the approximations of the C."""
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
        """Largest gain up to its intermediate results."""
        return self.lead

    @property
    def fineness(self) -> float:
        """Bits of accuracy that its lead costs a signal in front of the plays, 0 for none."""
        return 0.0

    def farthest(self, ends: tuple[float, float], span: float, seconds: float) -> float:
        """Largest move of a drive within `ends` that may be repeated in every step; `span`: of the output."""
        return math.inf

    @property
    def ringing(self) -> Array:
        """Frequencies (k,) in rad per sample at which its inverse may ring."""
        return np.empty(0)

    def respond(self, z: NDArray[np.complex128], found: Responses) -> Responses:
        """The responses with this block added behind the others, for `z` (N,), the factors of a delay by one sample."""
        return found

    def grown(self, size: float, margin: Margin) -> float:
        """Largest output for inputs of magnitude up to `size`."""
        return size

    def asked(self, given: float, asked: float, margin: Margin) -> float:
        """Largest answer of the inverse for outputs up to `asked`, after inputs up to `given`."""
        return asked


class CodedGain(NamedTuple):
    """A gain in fixed point: its smallest and largest values, its contributions to the errors of its output and of its
    inverse in output codes, without their final rounding, and the largest offset."""

    least: float
    largest: float
    there: float
    back: float
    offset: float = 0.0


class Coding(NamedTuple):
    """Units per code of the drive and of the output, and the `span` of the output in codes."""

    drive_lsb: float
    output_lsb: float
    span: float


class Sought(NamedTuple):
    """The conditions for solving a block behind the plays: sizes of its input and of the requested play sum, the unit
    of signals, how far `apart` states behind the play sum and their inputs can be; `same`: they are equal."""

    size: float
    asked: float
    signal: float
    apart: float
    seen: float
    same: bool


class Coded:
    """One block in fixed point; errors behind the plays are in output codes, errors in front of them in signals."""

    one: Any

    @property
    def arrived(self) -> float:
        """Rounding errors of the output in front of the plays."""
        return 0.0

    @property
    def follows(self) -> float:
        """Fraction of a change of the input that reaches the output in the same sample."""
        return 1.0

    def there(self, size: float, signal: float) -> float:
        """Rounding errors of the output for inputs up to `size`, with signals in units of `signal`."""
        return 0.0

    def solved(self, error: float, at: Sought) -> float:
        """Error of the inverse for an error of the output."""
        return error

    def residual(self, missed: float, same: bool) -> float:
        """Error of the output after the inverse that results from an error of the play sum."""
        return missed

    def gain(self, size: float, speed: Speed, at: Coding) -> CodedGain | None:
        """The block's properties as a gain, for inputs up to `size`; None if it is not a gain."""
        return None


@dataclass(frozen=True)
class Surroundings:
    """What the tables of a part depend on besides its blocks: the length of a step, the `ends` of the drive's range,
    the `span` of the output, the number of samples by which references are `ahead`, and whether a lead is `braked`."""

    seconds: float
    ends: tuple[float, float]
    span: float
    ahead: int
    braked: int


@dataclass(frozen=True)
class FloatSurroundings(Surroundings):
    """The same in floating point: `reals` converts named numbers to the arithmetic, which rounds by `roundoff`."""

    reals: Callable[[ArrayLike, str], NDArray[Any]]
    roundoff: float


@dataclass(frozen=True)
class FixedSurroundings(Surroundings):
    """The same in fixed point: units per code, fraction `bits` of signals behind the plays, bits of a code and the
    largest code, fraction bits of a `temperature`, the largest `drive` in codes, and the span `farthest` in signals."""

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
    """A kind of block in one arithmetic: its verbs, its constants from its tables, and the tables of its blocks; in
    fixed point the tables are made from the `formats` of each block, for its surroundings, largest input and output.

    `kinds`: of its C; `beside`: constants of an additional struct for each block.
    """

    verbs: Verbs
    constants: Callable[[Any], Iterable[Constants]]
    tables: Callable[[Sequence[Any], Any], Any]
    formats: Callable[[Any, FixedSurroundings, float, float], Any] = lambda one, *_: one
    kinds: tuple[BlockKind, ...] = ()
    beside: Callable[[Any], Iterable[Constants | None]] = lambda _: ()


class Setting(NamedTuple):
    """The data that decide whether the C can include an effect: all effects of its part in order, those up to a slew
    limit, the operator, the length of a step, the `ends` of the drive's range, and whether it is fixed point."""

    listed: Sequence[Effect]
    slewed: Sequence[Effect]
    operator: str
    seconds: float
    ends: tuple[float, float]
    whole: bool


class Unmeasured(NamedTuple):
    """An effect that nothing measures, compensated only if `emit.compensation.compensate` lists its `key`; the reasons
    why the C does not include it otherwise, and why a known reference does not help."""

    key: str
    emitted: str
    known: str


def late(effect: str, name: str = "ARITHMETIC") -> Callable[[], Any]:
    """A loader for the fixed-point version of an effect, which imports it when called."""

    return lambda: getattr(importlib.import_module("hystgen.effects." + effect + ".fixed"), name)


def called(name: str, only: Callable[[Any], bool] | None = None) -> Callable[[Any], bool]:
    """A test of whether an effect has this name and, if `only` is given, passes it."""
    return lambda effect: effect.name == name and (only is None or only(effect))


def given(place: Place) -> Callable[[Any], bool]:
    """A test of whether an effect has a block of its own in front of the plays or, for another `place`, behind them."""
    return lambda effect: effect.block is not None and (effect.place is Place.DRIVE) == (place is Place.DRIVE)


@dataclass(frozen=True)
class ChainPart:
    """One kind of block. `name`: in C; `words`: in messages; `place`: in the chain; `takes`: whether an effect has this
    kind of block; `one`: makes a block from an effect, a step length, and whether it may be `turning`; `calls`:
    interface calls that it serves, and `told` those that depend on its tables; `forward`: only the forward operator
    has it; `joined`: all its blocks are merged into one in C; `coded`: loads its fixed-point version, for models in
    fixed point.

    `longest`: the longest travel that can be set, from its tables; `unreached`: largest error of these tables, as a
    fraction of the output. `problems`: why the C cannot include an effect; `unmeasured`: set if nothing measures it;
    `code`: parts of its code in `hystgen.compensator.chain.costs`, and `counted`: how many of each its tables contain,
    by default its blocks.

    In double precision at steps of any length: `uneven` makes the block of an effect, `following` that of an effect
    behind the plays that depends on the drive; `no_inverse`: why there is no inverse.
    """

    name: str
    words: str
    place: Place
    takes: Callable[[Any], bool]
    one: Callable[[Any, float, bool], Any]
    floating: Realized
    coded: Callable[[], Realized]
    calls: tuple[str, ...] = ()
    forward: bool = False
    joined: bool = False
    longest: Callable[..., float] | None = None
    unreached: float = 0.0
    problems: Callable[..., Iterator[str]] = lambda *_: iter(())
    unmeasured: Unmeasured | None = None
    code: tuple[str, ...] = ()
    counted: Callable[..., Iterable[int]] = lambda _, blocks: (blocks,)
    uneven: Callable[..., Block | None] = lambda _: None
    following: Callable[..., Following | None] = lambda _: None
    no_inverse: Callable[..., Iterable[str]] = lambda _: ()
    told: Callable[[Any], Iterable[str]] = lambda _: ()

    @functools.cached_property
    def fixed(self) -> Realized:
        """Its fixed-point version."""
        return self.coded()

    def of(self, t: Arithmetical) -> Realized:
        """Its version in the arithmetic of a model's tables."""
        return self.fixed if t.fixed else self.floating
