"""Creep as a block: exactly invertible, since each state immediately follows a known fraction of a move."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystgen.basics.jit import Scalar, jit, zero
from hystgen.basics.structures import Count, Real, Struct, added, firsts, memory_of, note
from hystgen.effects.base import Array, Block, Place, decays
from hystgen.effects.creep.model import ExponentialCreep, LogarithmicCreep
from hystgen.effects.kinds import BlockKind, RowedMemory, RowedTables, Rows, numbered
from hystgen.effects.part import ChainPart, Margin, One, Realized, Responses, Verbs, called, late


def problems(effect: ExponentialCreep | LogarithmicCreep) -> Iterator[str]:
    """Why there is no inverse."""
    if isinstance(effect, LogarithmicCreep) and not effect.at_once > 0.0:
        yield (
            f"creep, logarithmic: with per_decade = {effect.per_decade:g}, t0 = {effect.t0:g} s and t_min = "
            f"{effect.t_min:g} s nothing of a step arrives at once ({effect.at_once:.3g} of it); give a t0 nearer to "
            "t_min, or a smaller per_decade"
        )


class CreepStates(Struct):
    """States of creep in double precision, as in `CreepNumbers`: 1 - E, c b0, c b1 and c of each."""

    rate: Real
    early: Real
    late: Real
    weight: Real


@dataclass(frozen=True)
class CreepNumbers(One):
    """Constants of a block `y_k = d h_k + sum X_i`, `X_i <- E_i X_i + c_i (b0_i h_(k-1) + b1_i h_k)` at even steps, in
    double precision: d is the fraction of a step that arrives at once, c_i >= 0 the weights.

    The inverse, `h_k = (y_k - sum (E_i X_i + c_i b0_i h_(k-1)))/(d + sum c_i b1_i)`, is stable for d > 0 and any time
    constants, since the response is strictly positive real.
    """

    slope: float  # d + sum c_i b1_i
    rest: float  # d + sum c_i
    terms: CreepStates

    def at_rest(self, x: float) -> float:
        """The settled output for an input."""
        return x * self.rest

    @property
    def growth(self) -> float:
        """Largest output for inputs of magnitude at most 1."""
        return self.rest

    @property
    def remembers(self) -> bool:
        """Whether it has states that follow its input."""
        return True

    @property
    def backward(self) -> float:
        """Largest gain of the inverse through all states."""
        total, late = float(np.sum(self.terms.weight)), float(np.sum(self.terms.late))
        around = self.rest - 2.0 * total + 2.0 * late
        return 1.0 / around if around > 0.0 else 2.0 / self.slope - 1.0 / self.rest

    def rounding(self, size: float, u: float) -> tuple[float, float]:
        """Rounding errors of the output for inputs up to `size`, and of the inverse itself."""
        rate, weight = np.asarray(self.terms.rate), np.asarray(self.terms.weight)
        states = (16.0 + len(self.terms)) * float(np.sum(weight)) + u * float(np.sum(weight / rate))
        found = u * size * (states + 4.0 * self.rest)
        return found, found

    def solved(self, error: float, size: float, u: float, same: bool) -> float:
        """Error of the inverse for an error of the output; `same`: the states have seen the same inputs."""
        return (1.0 / self.slope if same else self.backward) * (error + self.rounding(size, u)[1])

    def seen(self) -> float:
        """Factor by which states that follow the input amplify an error of the input."""
        return self.slope * self.backward

    def respond(self, z: NDArray[np.complex128], found: Responses) -> Responses:
        """The responses with this block added behind the others."""
        rate, early, late = (np.asarray(each)[:, None] for each in (self.terms.rate, self.terms.early, self.terms.late))
        states = np.sum((early * z + late) / (1.0 - (1.0 - rate) * z), axis=0)
        passed = found.passed * (self.slope - float(np.sum(late)) + states)
        return found._replace(passed=passed, direct=found.direct * self.slope, rest=found.rest * self.rest)

    def grown(self, size: float, margin: Margin) -> float:
        """Largest output for inputs of magnitude up to `size`."""
        return size * self.rest * margin.slack + 1.0

    def asked(self, given: float, asked: float, margin: Margin) -> float:
        """Largest answer of the inverse for outputs up to `asked`, after inputs up to `given`."""
        moved = given + (asked + given * self.rest) / self.slope
        return max(moved, asked / self.rest) * margin.slack + 1.0


def numbers(effect: ExponentialCreep | LogarithmicCreep, seconds: float) -> CreepNumbers:
    """The constants of an effect without `problems` at steps of `seconds`."""
    if isinstance(effect, ExponentialCreep):
        direct, tau, weights = 1.0, np.array(effect.time_constants), np.array(effect.weights)
    else:
        tau, weight = effect.spectrum()
        direct, weights = effect.at_once, np.full(len(tau), weight)
    step = np.array([seconds])
    _, early, late = np.array([np.concatenate(decays(step, each)) for each in tau]).T
    terms = CreepStates.of(
        zip(-np.expm1(-seconds / tau), weights * early, weights * late, weights, strict=True), np.float64
    )
    return CreepNumbers(direct + float(np.sum(terms.late)), direct + float(np.sum(weights)), terms)


def shares(terms: CreepStates) -> Array:
    """Constants (m, 2) of the states in floating point: 1 - E, and `k = c (1 - b1)`.

    A state's contribution to the next output for an input of 0, `A = E X + c b0 h`, follows `A += (1 - E)(k h - A)`,
    since `b0 + b1 = 1 - E`.
    """
    return np.column_stack([terms.rate, np.asarray(terms.weight) - terms.late])


# ---------------------------------------------------------------- creep.c


class CreepTerm(Struct):
    """Creep state X, the contribution of past inputs to the next output: X += rate (share h - X)."""

    rate: Real
    share: Real


class CreepTable(Struct):
    """Creep after the plays: y = slope h + X_1 + X_2 + ..., with the X of the previous sample."""

    slope: Real = note("immediate change in y with h")
    inverse_slope: Real
    rest: Real = note("y over h at rest")
    inverse_rest: Real
    n: Count


class CreepTermState(Struct):
    """A number in two parts, since its steps may be far smaller than its last bit."""

    high: Real
    low: Real


class CreepState(Struct):
    """Creep after the plays."""

    ahead: Real = note("output of the next sample for an input of 0")


KIND = BlockKind("creep", CreepTable, CreepState, Rows("term", CreepTerm, CreepTermState))


CreepTables = RowedTables[CreepTable, CreepTerm]
CreepMemory = RowedMemory[CreepState, CreepTermState]


def tables(blocks: Sequence[CreepNumbers], reals: Callable[[ArrayLike, str], NDArray[Any]]) -> CreepTables:
    """The tables of several blocks in floating point; `reals`: converts named numbers to the arithmetic."""
    given = [(one.slope, 1.0 / one.slope, one.rest, 1.0 / one.rest) for one in blocks]
    rows = reals(given, "constants of the creep")
    terms = reals(np.concatenate([np.empty((0, 2)), *(shares(one.terms) for one in blocks)]), "creep")
    return CreepTables(
        CreepTable.of([(*row, len(one.terms)) for row, one in zip(rows, blocks, strict=True)], rows.dtype),
        firsts(len(one.terms) for one in blocks),
        CreepTerm.of(terms, terms.dtype),
    )


@jit
def creep_rest(t: CreepTables, s: CreepMemory, j: int, x: Scalar) -> Scalar:
    """Settle everything at the input x. Returns the output."""
    ahead = zero(x)
    for i in range(t.first[j], t.first[j + 1]):
        settled = t.row.share[i] * x
        s.row.high[i] = settled
        s.row.low[i] = zero(x)
        ahead = ahead + settled
    s.block.ahead[j] = ahead
    return t.block.rest[j] * x


@jit(inline=True)
def creep_resting(t: CreepTables, s: CreepMemory, j: int, y: Scalar) -> Scalar:  # noqa: ARG001  block interface
    """The input that gives the output y once everything has settled."""
    return y * t.block.inverse_rest[j]


@jit(inline=True)
def creep_solve(t: CreepTables, s: CreepMemory, j: int, y: Scalar) -> Scalar:
    """The input that gives the output y at this sample."""
    return (y - s.block.ahead[j]) * t.block.inverse_slope[j]


@jit
def creep_absorb(t: CreepTables, s: CreepMemory, j: int, x: Scalar) -> Scalar:
    """Absorb the input x at this sample. Returns the output."""
    y = s.block.ahead[j] + t.block.slope[j] * x
    ahead = zero(x)
    for i in range(t.first[j], t.first[j + 1]):
        ahead = ahead + added(s.row, i, t.row.rate[i] * (t.row.share[i] * x - s.row.high[i]))
    s.block.ahead[j] = ahead
    return y


ARITHMETIC = Realized(
    Verbs(memory_of(CreepMemory), creep_rest, creep_absorb, creep_resting, creep_solve), numbered(KIND, 1, 1, 2),
    lambda blocks, about: tables(blocks, about.reals), kinds=(KIND,),
)

# ---------------------------------------------------------------- at steps of any length


class UnevenCreep(Block):
    """Creep in double precision for steps of any length, computed by the functions above."""

    def __init__(self, effect: ExponentialCreep | LogarithmicCreep) -> None:
        self._numbers = functools.lru_cache(maxsize=64)(functools.partial(numbers, effect))
        self._tables = functools.lru_cache(maxsize=256)(self._of_steps)
        self.advance(1.0)
        self.state: CreepMemory = memory_of(CreepMemory)(self.table, np.float64)

    def _of_steps(self, seconds: float, later: float) -> CreepTables:
        """The `tables` of a step. States advance to the next output with the E and b0 of the next step, and weight an
        input by `(E b1 + b0)/(1 - E)`, with the b1 of this step."""
        now, following = self._numbers(seconds), self._numbers(later)
        rate, late = np.asarray(following.terms.rate), np.asarray(now.terms.late) - following.terms.late
        found = tables([now], lambda values, _: np.array(values))
        found.row.rate[:], found.row.share[:] = shares(following.terms).T
        found.row.share[:] += late * (1.0 - rate) / rate
        return found

    def advance(self, seconds: float, later: float | None = None) -> None:
        """Set the constants for this step and the next."""
        self.table = self._tables(seconds, later or seconds)

    def call(self, verb: str, x: float) -> float:
        """The result of a verb for x."""
        function = ARITHMETIC.verbs.verb(verb)
        assert function
        return float(function(self.table, self.state, 0, x))


PART = ChainPart(
    "creep", "creep", Place.LINEAR, called("creep"),
    lambda effect, seconds, _: numbers(effect, seconds),
    ARITHMETIC, late("creep"),
    code=("creep",), uneven=UnevenCreep, no_inverse=problems,
)
"""Creep as a part of the chain."""

PARTS = (PART,)
