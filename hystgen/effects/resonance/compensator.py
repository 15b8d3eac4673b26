"""A mode as a block of the forward operator.

The block keeps the distance `off` of the output from the input, and its `rate`, both 0 at rest, so that rounding errors
end with the motion. Only the forward operator has it: a second-order system sampled with linear input has zeros near
-0.27 and -3.7, so its inverse is unstable.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hystgen.basics.jit import Scalar, jit, zero
from hystgen.basics.structures import AnyFactor, FixedFactor, FixedUInt8, FloatReal, Signal, Struct, memory_of, note
from hystgen.effects.base import Array, Place
from hystgen.effects.kinds import BlockKind, numbered
from hystgen.effects.part import ChainPart, FloatSurroundings, Margin, One, Realized, Verbs, called, late
from hystgen.effects.resonance.model import Resonance

MOST_SAMPLES = 2**20
"""Samples of a free oscillation that are summed one by one; the remainder has a common bound."""

FADED = 45.0
"""Time constants after which an oscillation is below the last bit of a double."""


@dataclass(frozen=True)
class ModeNumbers(One):
    """A mode at one step length, and the sums of its absolute responses over all samples.

    `table` (5,): changes of `off` and `rate` per step due to themselves, their coupling, and their responses to a
    change of the input; `largest` and `fastest`: output and rate for inputs up to 1; `off_after`, `rate_after`: summed
    response of the output to a disturbance of `off`, and of `rate`; `turned`, `slowed`: the same for the rate.
    """

    table: tuple[float, ...]
    largest: float
    fastest: float
    off_after: float
    rate_after: float
    turned: float
    slowed: float

    @property
    def growth(self) -> float:
        """Largest output for inputs of magnitude at most 1."""
        return self.largest

    def rounding(self, size: float, u: float) -> tuple[float, float]:
        """Rounding errors of the output in floating point with unit roundoff `u`, for inputs up to `size`."""
        keep, turn, swing, lead, push = map(abs, self.table)
        off, rate = (1.0 + self.largest) * size, self.fastest * size
        steps = keep * off + turn * rate + 2.0 * lead * size, swing * rate + turn * off + 2.0 * push * size
        lost = [u * (state + 5.0 * step) for state, step in zip((off, rate), steps, strict=True)]
        return lost[0] * self.off_after + lost[1] * self.rate_after + u * self.largest * size, 0.0

    def grown(self, size: float, margin: Margin) -> float:
        """Largest output for inputs of magnitude up to `size`."""
        return size * self.largest * margin.slack + 1.0


def numbers(effect: Resonance, seconds: float) -> ModeNumbers:
    """The constants at steps of `seconds`, from responses in closed form, summed until they have decayed."""
    zeta, angle = effect.damping, 2.0 * math.pi * effect.frequency * seconds
    slow = zeta if zeta < 1.0 else 1.0 / (zeta + math.sqrt(zeta * zeta - 1.0))
    count = int(min(math.ceil(FADED / (slow * angle)) + 2, MOST_SAMPLES))
    _, cosine, sine = effect.factors(np.arange(count, dtype=np.float64) * seconds)
    _, _, lead, push = (float(x[0]) for x in effect.forced(np.array([seconds])))
    lead -= 1.0
    c, s = float(cosine[1]), float(sine[1])
    # |sine| <= k angle q^k and |cosine| <= (1 + k angle) q^k, after the samples that are summed
    lost = -math.expm1(-slow * angle)
    left = math.exp(-slow * angle * count) / lost
    tail = left * (1.0 + (1.0 + zeta) * angle * (count + 1.0 / lost))
    keeping, turning = cosine + zeta * sine, sine
    rates = cosine - zeta * sine
    off, rate = lead * keeping + push * turning, push * rates - lead * turning
    size = abs(lead) + abs(push)

    def total(each: Array) -> float:
        return float(np.sum(np.abs(each))) + tail

    largest = abs(1.0 + lead) + total(np.diff(off)) + 2.0 * size * tail
    fastest = abs(push) + total(np.diff(rate)) + 2.0 * size * tail
    table = (c - 1.0 + zeta * s, s, c - 1.0 - zeta * s, lead, push)
    return ModeNumbers(table, largest, fastest, total(keeping), total(turning), total(turning), total(rates))


# ---------------------------------------------------------------- mode.c


class ModeTable(Struct):
    """Mode of the stage. Its two states are output minus input, and the rate of this difference; in a step they change
    by shares of themselves (keep, swing), of each other (turn), and of a change in the input (lead, in fixed point late
    minus the change itself, and push)."""

    keep: AnyFactor
    turn: AnyFactor
    swing: AnyFactor
    lead: FloatReal
    late: FixedFactor
    push: AnyFactor
    bits: FixedUInt8 = note("bits of the states below those of a signal,")
    drop: FixedUInt8 = note("bits that products with states leave out,")
    lift: FixedUInt8 = note("and bits that products with a change in the input leave out")


class ModeState(Struct):
    """A mode of the stage."""

    before: Signal = note("input of the last sample")
    off: Signal = note("output minus input")
    rate: Signal = note("of `off`, per radian of the mode")


KIND = BlockKind("mode", ModeTable, ModeState, reading=("absorb",), own=("rest", "absorb"))


def tables(modes: Sequence[ModeNumbers], about: FloatSurroundings) -> ModeTable:
    """The tables of several modes in floating point."""
    rows = about.reals([one.table for one in modes], "the modes")
    return ModeTable.of(rows, rows.dtype)


@jit
def mode_rest(t: ModeTable, s: ModeState, j: int, x: Scalar) -> Scalar:  # noqa: ARG001  block interface
    """Settle everything at the input x. Returns the output."""
    s.before[j] = x
    s.off[j] = zero(x)
    s.rate[j] = zero(x)
    return x


@jit
def mode_absorb(t: ModeTable, s: ModeState, j: int, x: Scalar) -> Scalar:
    """Absorb the input x at this sample. Returns the output."""
    change = x - s.before[j]
    off = s.off[j]
    rate = s.rate[j]
    s.off[j] = off + ((t.keep[j] * off + t.turn[j] * rate) + t.lead[j] * change)
    s.rate[j] = rate + ((t.swing[j] * rate - t.turn[j] * off) + t.push[j] * change)
    s.before[j] = x
    return x + s.off[j]


ARITHMETIC = Realized(Verbs(memory_of(ModeState), mode_rest, mode_absorb), numbered(KIND, 6), tables, kinds=(KIND,))

PART = ChainPart(
    "mode", "resonance", Place.LINEAR, called("resonance", lambda effect: effect.block is None),
    lambda effect, seconds, _: numbers(effect, seconds),
    ARITHMETIC, late("resonance"), forward=True,
    code=("mode",),
)
"""A mode as a part of the chain, in the forward operator only."""

PARTS = (PART,)
