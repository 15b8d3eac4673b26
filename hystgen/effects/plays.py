"""Plays that an effect moves or bends in its own way: what a compensator needs to know of it, and its constants.

The state of play i is the position at which it would come to rest, and its contribution there. A plain play is at rest.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import DTypeLike, NDArray

from hystgen.basics.structures import (
    AnyFactor,
    FiveInt32,
    FourInt32,
    Int32,
    Int64,
    Literal,
    Narrow,
    Play,
    Real,
    SevenReals,
    Struct,
    UInt8,
    UInt32,
    note,
)
from hystgen.effects.base import Array
from hystgen.effects.bend import Bends
from hystgen.effects.part import Function
from hystgen.plays.slots import Counts, Reals

T = TypeVar("T")
F = TypeVar("F")

PLAIN, DILATED, RELAXING, DASHPOT = range(4)
STRAIGHT, POLYNOMIAL, CENTRE = range(3)
"""How plays move, and how they are bent."""

NEWTON_TRIES = 8
"""Tries of a search in floating point by Newton's method, before it starts to halve the remaining interval: 1 or 2 are
enough on smooth references, and 6 after jumps, where 4 are too few and cost 20 tries (benchmarks/chosen_numbers.py
tries)."""

SECANTS = 10
"""Tries of a search in fixed point by secants, before it starts to halve the remaining interval. Set by:
benchmarks/chosen_numbers.py secants. 2 to 4 are enough on smooth references, 9 after jumps; with 8, some take 25."""

FASTEST = 2**31 - 1
"""[steps of the input per 2^rate_bits of the sum] Largest rate: the largest whose product with a word fits 63 bits."""


class SearchState(Struct):
    """What a search for the input of the plays starts from."""

    slope: Real = note("change in their sum per unit change in their input, in steady motion")


class FixedSearchState(Struct):
    """A search between two inputs of the plays, `low` and one above `top`, which are not tried again, for the one at
    which their sum is `total`. It lies in the memory of an operator, not on its stack."""

    total: Int64
    short_of: Int64 = note("shortfall of the sum at `low`, or 0 if `low` is below all inputs,")
    over: Int64 = note("and its excess above `top`, or -1")
    found: Int64 = note("sum at the input tried last,")
    last: Int64 = note("and at the one before")
    rate: UInt32 = note("change in the input per unit change in the sum; kept for the next search")
    input: Int32 = note("the one tried last,")
    prior: Int32 = note("and the one before")
    low: Int32
    top: Int32
    tries: UInt8 = note("by secants")


class FixedYield(Struct):
    """A piece of the yield of a nonlinear dashpot: its start, the left shift that scales its length to 2^31, and the
    coefficients of its cubic, without their lowest `lift` bits."""

    begin: UInt32
    c: FourInt32
    scale: UInt8
    lift: UInt8


class MovingNumbers(Struct):
    """Numbers of moved or bent plays in floating point, in C macros."""

    scale: Real = note("largest threshold")
    inverse_scale: Real
    centre: Real = note("of the loops with another weight")
    inverse_width: Real
    bump: Real = note("how much, times the width")
    amplitude: Real = note("share of more weight at the centre")
    steepest: Real = note("change of a contribution there")
    tanh_centre: Real = note("so that a play at 0 contributes nothing")
    least_input: Real = note("of the plays, for a search")
    largest_input: Real
    half: Literal
    one: Literal
    rate: Real = note("reciprocal of the sum's mean slope")
    close: Real = note("distance of the sum at which a search ends")
    smooth: Real = note("the same if no play starts or stops to follow on the way")
    standing_share: Real = note("share of a step after which the input is taken as standing still")


class ElementState(Struct):
    """An element in parallel with the plays, at the last turn of its input."""

    s: Real = note("z/width in the direction of the input, with a tilted drive plus `lean`,")
    low: Real = note("and its rounding remainder")
    place: Real = note("on the curve,")
    level: Real = note("the curve's value there,")
    until: Real = note("the distance to the end of its piece,")
    c: SevenReals = note("its coefficients from there on,")
    lean: Real = note("and the change of the drive over a width from there on")


class FixedElementState(Struct):
    """An element in parallel with the plays, at the last turn of its input."""

    s: Int64 = note("z/width in the direction of the input, with a tilted drive plus `lean`,")
    low: Literal = note("0")
    place: Int64 = note("on the curve,")
    level: Int64 = note("the curve's value there,")
    until: Int64 = note("the distance to the end of its piece,")
    c: FiveInt32 = note("the coefficients of its mean slope from there on,")
    scale: UInt8 = note("the right shift to the share of the piece's length,")
    lean: Int32 = note("and the change of the drive over a width from there on")


class CurvePiece(Struct):
    """A piece of the curve of elements in parallel with the plays: its begin and the curve's value there, coefficients
    from there on, and those of the inverse."""

    begin: Real
    level: Real
    up: SevenReals
    back: SevenReals


class Tilt(Struct):
    """The tilted drive `1 + t w` of an element, over its largest value: change over a width, and where that is."""

    lean: Narrow
    top: Play
    rest: Literal = note("z/width at rest, plus `lean`")


class FixedPiece(Struct):
    """A piece of the curve of elements in parallel with the plays: its begin and the curve's value there, both with 44
    bits, coefficients of the mean slope from there on, and of the inverse over the share of the piece's rise."""

    begin: Int64
    level: Int64
    share: AnyFactor
    up: FiveInt32
    back: FiveInt32
    scale: UInt8 = note("right shift from a distance to the share of the length in units of 2^-31")
    lift: UInt8 = note("bits of a value that the product with `share` needs in addition")


class FixedElement(Struct):
    """An element: factors from a move of the input, at most `far`, to a distance on the curve, from there to the sum,
    and from a slope of the curve to that of the sum, with left shifts of the argument of the first and of the products
    of the others."""

    distance: AnyFactor
    amplitude: AnyFactor
    weight: AnyFactor
    far: Int64
    distance_lift: UInt8
    amplitude_lift: UInt8
    weight_lift: UInt8


class ElementNumbers(Struct):
    """Numbers of an element in floating point, in C arrays."""

    weight: Real = note("of z")
    amplitude: Real = note("of z/width")
    inverse_width: Real


E = TypeVar("E", ElementState, FixedElementState)


class ElementsState(NamedTuple, Generic[E]):
    """Memory of elements (k,): the input at their last turn and whether it has risen since (1,); each element.

    In floating point, `found` and `asked` are the input to which a search has led and the sum of the plays there. In
    fixed point, they are the input for which the sum of the elements was last computed and that sum, with its `slope`;
    `departs`: whether the elements have turned there; `steep`: the slope of the whole sum that the rate of a search
    has, or -1 after a turn."""

    turned: Reals
    upward: Counts
    found: Reals
    asked: Reals
    slope: Reals
    steep: Reals
    departs: Counts
    element: E

    @classmethod
    def of(cls, elements: E, dtype: DTypeLike) -> ElementsState[E]:
        """Memory of the given elements."""
        turned, found, asked, slope, steep = np.zeros((5, 1), dtype)
        upward, departs = np.ones((2, 1), np.int64)
        return cls(turned, upward, found, asked, slope, steep, departs, elements)


class ElementTables(NamedTuple):
    """Constants of elements (k,) in parallel with the plays, which follow one curve in pieces (K + 1,); `tilt` (k,) or
    (0,): of tilted drives, for which `base` (1,) is subtracted from the sum."""

    piece: CurvePiece
    element: ElementNumbers
    tilt: Tilt
    base: Reals

    @classmethod
    def none(cls, dtype: Any) -> ElementTables:
        """The tables of a model without elements."""
        element, tilt = ElementNumbers.zeros(0, dtype), Tilt.zeros(0, dtype)
        return cls(CurvePiece.zeros(1, dtype), element, tilt, np.zeros(1, dtype))

    def memory(self) -> ElementsState[ElementState]:
        """Memory for these elements; `Elements.unload` sets it."""
        return ElementsState.of(ElementState.zeros(len(self.element), self.base.dtype), self.base.dtype)


class FixedElementTables(NamedTuple):
    """The same in fixed point; `straight`: distance from an input, in steps, within which the sum is computed along its
    slope there."""

    piece: FixedPiece
    element: FixedElement
    tilt: Tilt
    base: Reals
    straight: int

    @classmethod
    def none(cls) -> FixedElementTables:
        """The tables of a model without elements."""
        return cls(FixedPiece.zeros(1), FixedElement.zeros(0), Tilt.zeros(0), np.zeros(1, np.int64), 0)

    def memory(self) -> ElementsState[FixedElementState]:
        """Memory for these elements; `Elements.unload` sets it."""
        return ElementsState.of(FixedElementState.zeros(len(self.element)), np.int64)


class MovingTables(NamedTuple):
    """Constants of moved or bent plays. `first`, `second` (n + 1,): for dilated plays the growth of a threshold per
    unit of a step, for viscous ones b1 and 1 - E/M; `curve` (n + 1, K): coefficients of the polynomials; `halves`:
    halvings that finish a search after Newton's method; `turns`: Newton steps for the reciprocal of a slope."""

    moves: int
    bends: int
    first: Reals
    second: Reals
    curve: Reals
    number: MovingNumbers
    halves: int
    turns: int
    scanned: int  # 1 for viscous plays with one time constant and no bend
    share: Reals  # p_i b1 (n + 1,), if scanned
    inverse: Reals  # 1 / (p_0 + b1 (p_1 + ... + p_i))
    yields: Reals  # (K, 5): yields of a nonlinear dashpot, by pieces
    elements: ElementTables

    @property
    def used(self) -> bool:
        """Whether an effect moves, bends or joins the plays; if not, the loop engine solves for them."""
        return self.moves != PLAIN or self.bends != STRAIGHT or len(self.elements.element) > 0


class FixedMovingTables(NamedTuple):
    """The same in fixed point. `first`, `second`: factors (n + 1, 2); `farthest`: the largest input that a search
    tries; `near`: smallest change of the sum for half a step of the input; `rate_bits`: a rate is 2^rate_bits steps of
    the input per change of the sum, `FASTEST` at the smallest slope; `relaxed`: tables of plays with the slopes that
    viscous plays with one time constant have in a step; `bump`: curves of bent plays minus the plays themselves, with
    `bump_bits` bits below a step of their input; `bump_of` (n + 1,): the curve of each play; `yields` (K,): yields of a
    nonlinear dashpot with `yield_bits` bits below a step, for stretches up to `stretch`; `seen`: a factor."""

    moves: int
    bends: int
    scanned: int
    first: Reals
    second: Reals
    farthest: int
    near: int
    rate_bits: int
    relaxed: Any  # `hystgen.compensator.layout.FixedTables`
    bump: Bends
    bump_of: Counts
    bump_bits: int
    yields: FixedYield
    yield_bits: int
    stretch: int
    seen: Reals
    elements: FixedElementTables

    @property
    def used(self) -> bool:
        """Whether an effect moves, bends or joins the plays; if not, the loop engine solves for them."""
        return self.moves != PLAIN or self.bends != STRAIGHT or len(self.elements.element) > 0


class Moved(NamedTuple):
    """How plays move at one step length: their kind; `first`, `second` (n,) of plays with a threshold, `yields` and
    `seen` as in `MovingTables`; `varies`: for a play with a nonlinear dashpot, how its change per change of the input
    varies: the sum of all jumps, and the most per change of the input."""

    moves: int
    first: Array
    second: Array
    yields: Array
    seen: float
    varies: tuple[float, float] = 0.0, 0.0


Response = tuple[float, NDArray[np.complex128], float]


class Mover(Protocol):
    """How an effect moves the plays (n + 1) of a model, at steps of any length in double precision.

    `after`: the plays after a step in which their input goes straight from `x` to `w`; `numbers`: their constants for
    drive steps up to `largest_step` and stretches up to `span`; `moves`: their kind; `in_order`: whether no play yields
    faster than one with a smaller threshold; `stood_in_for`: whether other plays stand in for them, as allowed in the
    inverse only; `falling`: smallest change in one step, at most 0, of the sum of the plays with a threshold per change
    of their input, if contributions rise by up to `steep` times their play; `responses`: for each number of plays that
    follow, slope at rest, response (N,) at the factors `z` of a delay by one sample, and the part of it that comes at
    once; `whole_yields`: the yields in fixed point, for stretches up to `end` steps, with knots at `begins` among
    others; `stretch_error`: largest difference between stretches by the yields and by their law, for moves of the input
    within `ways` in a step and overall, and rounding errors `held` (K,); `disorder`: by how much the yields take plays
    out of the order of their thresholds, for stretches up to `top`.
    """

    def after(self, plays: Array, x: float, w: float, seconds: float) -> Array: ...
    def numbers(self, seconds: float, largest_step: float, span: float) -> Moved: ...
    def moves(self, seconds: float) -> int: ...
    @property
    def in_order(self) -> bool: ...
    def stood_in_for(self, seconds: float) -> bool: ...
    def falling(self, seconds: float, steep: float) -> float: ...
    def responses(self, z: NDArray[np.complex128], seconds: float) -> Iterator[Response]: ...
    def whole_yields(
        self, seconds: float, begins: Sequence[int], end: int, step: float, bits: int
    ) -> list[tuple[object, ...]]: ...
    def stretch_error(self, seconds: float, rows: Array, ways: tuple[float, float], held: Array) -> float: ...
    def disorder(self, rows: Array, top: float) -> float: ...


class ElementsInDouble(Protocol):
    """Elements in double precision: brought to rest at an input, their sum if the input moved there, and that move."""

    def rest(self, w: float) -> None: ...
    def total(self, w: float) -> float: ...
    def move(self, w: float) -> None: ...


class Bent(NamedTuple):
    """How plays are bent: their kind, coefficients (n, K), or (1, K) for all, and some of `MovingNumbers`; `bump` of
    play i > 0: a key that plays with the same bend share, and its contribution minus the play itself."""

    bends: int
    curve: Array
    numbers: Mapping[str, float]
    bump: Callable[[int], tuple[object, Callable[[float], float]]]


class Moves(NamedTuple):
    """The functions of moving plays in one arithmetic; arguments: the tables m, thresholds r, the index i of a play,
    the memory s of all plays, their rounding remainders and their input w.

    `moved`: play i after its input has gone to w; `move`: moves it there, returns whether it moves; `put`: puts it to
    rest at a position; `rest`: where it would come to rest with its input held; `tried`, in floating point: whether it
    moves when its input goes to w or, before the first drive, comes to rest there, the value it reaches, and its change
    per further change of w. `follow`: moves all plays, which share a time constant, as their input goes to w, returns
    their sum; `input`: the input at which their sum is h.
    """

    moved: Function  # of m, r, i, s, lost, w
    move: Function  # of m, r, i, s, lost, w
    put: Function  # of m, i, s, lost and a place
    rest: Function  # of m, r, i, s
    follow: Function  # of m, plays, s, w
    input: Function  # of m, plays, s, h
    tried: Any = None  # of m, r, i, s, lost, whether a drive has been applied, and w


class Bending(NamedTuple):
    """The functions of bent plays in one arithmetic: `bent`: the contribution of play i at z; `steep`, in floating
    point only: the contribution and its change per change of z."""

    bent: Function  # of m, plays, i, z
    steep: Any = None  # of the same


@dataclass(frozen=True)
class PlaysPart(Generic[T, F]):
    """An effect on plays: `of` describes it for a model's plays, from the effect, thresholds and weights; `floating`:
    its functions, `Moves` or `Bending`; `coded` loads them in fixed point."""

    of: Callable[..., T]
    floating: F
    coded: Callable[[], F]


class ParallelTerms(NamedTuple):
    """Elements (k,) in parallel with the plays: weights; largest |z| (`most`); -z at the smallest and z at the largest
    input after a move across the range from rest (`ends` (k, 2)); smallest and largest change of z per change of the
    input, the smallest if below 0 (`flattest`, `steepest`), and largest change of that (`bend`); `memory`: the elements
    in double precision; `tables`: their constants in a data type; `error`: bound on the error of their sum in a data
    type, in the C (True) or of the law in double precision; `coded`: their constants in fixed point for steps of the
    input and of the sum, and the error of the sum allowed where it is computed along its slope; `coded_error`: bound on
    its other errors."""

    weights: Array
    most: Array
    ends: Array
    flattest: Array
    steepest: Array
    bend: Array
    memory: ElementsInDouble
    tables: Callable[[Any], ElementTables]
    error: Callable[[Any, bool], float]
    coded: Callable[[float, float, float], FixedElementTables]
    coded_error: Callable[[], float]


class Elements(NamedTuple):
    """The functions of elements in one arithmetic, of tables, memory and the input: `joined`: their sum, and in
    floating point its slope; `turn`: turns them there; `unload`: brings them to rest there."""

    joined: Function
    turn: Function
    unload: Function


@dataclass(frozen=True)
class ElementsPart:
    """An effect in parallel with the plays: `of` describes it, from the effect and the ends of its input; `floating`:
    its functions; `coded` loads them in fixed point."""

    of: Callable[..., ParallelTerms]
    floating: Elements
    coded: Callable[[], Elements]
