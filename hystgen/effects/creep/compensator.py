"""Creep as a block: exactly invertible, since a state answers a move at once by a known share."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from hystgen.basics.jit import jit
from hystgen.effects.base import Array, decays
from hystgen.effects.creep.model import ExponentialCreep, LogarithmicCreep
from hystgen.effects.kinds import Constants, Kind, Rows
from hystgen.plays.slots import Counts, Reals, zero

EFFECTS = (ExponentialCreep, LogarithmicCreep)


class CreepBlock:
    """`y_k = d h_k + sum X_i`, `X_i <- E_i X_i + c_i (b0_i h_(k-1) + b1_i h_k)`, the weights folded into the states.

    `direct`: d, the share of a step that arrives at once; `weights`: c_i >= 0. Solved, `h_k = (y_k - sum (E_i X_i +
    c_i b0_i h_(k-1)))/(d + sum c_i b1_i)`: for d > 0 the inverse is stable whatever the time constants are, since the
    response is strictly positive real.
    """

    def __init__(self, direct: float, time_constants: Array, weights: Array) -> None:
        self.direct, self.time_constants, self.weights = direct, time_constants, weights
        self.states, self.before = np.zeros(len(weights)), 0.0
        self._factors = functools.lru_cache(maxsize=64)(self._of_step)
        self.advance(0.0)

    def _of_step(self, seconds: float) -> tuple[Array, Array, Array, float]:
        step = np.array([seconds])
        decay, early, late = np.array([np.concatenate(decays(step, tau)) for tau in self.time_constants]).T
        late = self.weights * late
        return decay, self.weights * early, late, self.direct + float(np.sum(late))

    def resting(self, y: float) -> float:
        """`y/(d + sum c_i)`."""
        return y / (self.direct + float(np.sum(self.weights)))

    def rest(self, x: float) -> float:
        """Every state holds its share of `x`."""
        self.states, self.before = self.weights * x, x
        return self.direct * x + float(np.sum(self.states))

    def advance(self, seconds: float) -> None:
        """The factors of this step."""
        self.decay, self.early, self.late, self.slope = self._factors(seconds)

    def solve(self, y: float) -> float:
        """The play sum that gives `y` with what creeps anyway."""
        return (y - float(np.sum(self.decay * self.states + self.early * self.before))) / self.slope

    def absorb(self, x: float) -> float:
        """The states follow."""
        self.states = self.decay * self.states + self.early * self.before + self.late * x
        self.before = x
        return self.direct * x + float(np.sum(self.states))


def block(effect: ExponentialCreep | LogarithmicCreep) -> CreepBlock:
    """The block of an effect without `problems`."""
    if isinstance(effect, ExponentialCreep):
        return CreepBlock(1.0, np.array(effect.time_constants), np.array(effect.weights))
    tau, weight = effect.spectrum()
    return CreepBlock(effect.at_once, tau, np.full(len(tau), weight))


def problems(effect: ExponentialCreep | LogarithmicCreep) -> Iterator[str]:
    """Why there is no inverse."""
    if isinstance(effect, LogarithmicCreep) and not effect.at_once > 0.0:
        yield (
            f"creep, logarithmic: with per_decade = {effect.per_decade:g}, t0 = {effect.t0:g} s and t_min = "
            f"{effect.t_min:g} s nothing of a step arrives at once ({effect.at_once:.3g} of it); give a t0 nearer to "
            "t_min, or a smaller share"
        )


class CreepNumbers(NamedTuple):
    """Constants of a block at even steps, in double precision. `terms` (m, 4): of each state 1 - E, c b0, c b1, c."""

    slope: float  # d + sum c_i b1_i
    rest: float  # d + sum c_i
    terms: Array


def numbers(effect: ExponentialCreep | LogarithmicCreep, seconds: float) -> CreepNumbers:
    """The constants of an effect without `problems` at steps of `seconds`."""
    one = block(effect)
    one.advance(seconds)
    rate = -np.expm1(-seconds / one.time_constants)
    terms = np.column_stack([rate, one.early, one.late, one.weights])
    return CreepNumbers(one.slope, one.direct + float(np.sum(one.weights)), terms)


RATE, EARLY, LATE, WEIGHT = 0, 1, 2, 3


def shares(terms: Array) -> Array:
    """Constants (m, 2) of the states in floating point: 1 - E, and `k = c (1 - b1)`.

    What a state adds to the next output for an input of 0 there, `A = E X + c b0 h`, follows `A += (1 - E)(k h - A)`,
    since `b0 + b1 = 1 - E`.
    """
    return np.column_stack([terms[:, RATE], terms[:, WEIGHT] - terms[:, LATE]])


# ---------------------------------------------------------------- creep.c

SLOPE, INVERSE_SLOPE, REST, INVERSE_REST = 0, 1, 2, 3
SHARE = 1
BEFORE, AHEAD = 1, 0
HIGH, LOW = 0, 1


KIND = Kind(
    "creep", ("slope", "inverse_slope", "rest", "inverse_rest"), ("ahead",),
    rows=Rows("term", ("rate", "share"), ("high", "low")), counts=("n",),
)  # fmt: skip


class CreepTables(NamedTuple):
    """All creep blocks of a model: `block` (k, 4), the states of each from `first` (k + 1) on in `term` (m, 2),
    in fixed point more of either."""

    block: Reals
    first: Counts
    term: Reals


def constants(t: CreepTables) -> Iterator[Constants]:
    """The numbers of each block."""
    for j, row in enumerate(t.block):
        terms = t.term[t.first[j] : t.first[j + 1]]
        yield Constants(KIND, row, (1 + 2 * len(terms), 1), terms, (len(terms),))


class CreepState(NamedTuple):
    """`block` (k, 2): the output at the next sample for an input of 0, or in fixed point for the same input as at the
    last one, which is the second column; `state` (m, 2): in two parts."""

    block: Reals
    state: Reals


@jit
def creep_rest(t: CreepTables, s: CreepState, j: int, x: Any) -> Any:
    """Everything has settled at the input x. Returns the output."""
    ahead = zero(x)
    for i in range(t.first[j], t.first[j + 1]):
        settled = t.term[i, SHARE] * x
        s.state[i, HIGH] = settled
        s.state[i, LOW] = zero(x)
        ahead = ahead + settled
    s.block[j, AHEAD] = ahead
    return t.block[j, REST] * x


@jit(inline=True)
def creep_resting(t: CreepTables, s: CreepState, j: int, y: Any) -> Any:  # noqa: ARG001  as of every block
    """The input that gives the output y once everything has settled."""
    return y * t.block[j, INVERSE_REST]


@jit(inline=True)
def creep_solve(t: CreepTables, s: CreepState, j: int, y: Any) -> Any:
    """The input that gives the output y at this sample."""
    return (y - s.block[j, AHEAD]) * t.block[j, INVERSE_SLOPE]


@jit
def creep_absorb(t: CreepTables, s: CreepState, j: int, x: Any) -> Any:
    """The input is x at this sample. Returns the output."""
    y = s.block[j, AHEAD] + t.block[j, SLOPE] * x
    ahead = zero(x)
    for i in range(t.first[j], t.first[j + 1]):
        state = s.state[i, HIGH]
        change = t.term[i, RATE] * (t.term[i, SHARE] * x - state) + s.state[i, LOW]
        following = state + change
        s.state[i, HIGH] = following
        s.state[i, LOW] = change - (following - state)
        ahead = ahead + following
    s.block[j, AHEAD] = ahead
    return y
