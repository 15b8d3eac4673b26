"""The gain that ageing leaves in fixed point, over a travel in drive codes that is counted exactly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from hystgen.arithmetic.factors import LARGEST as MOST
from hystgen.arithmetic.factors import factor, times
from hystgen.basics.jit import jit
from hystgen.basics.structures import Count, Factor, Flag, FourInt32, Int32, Int64, Struct, UInt8, firsts
from hystgen.effects.ageing import compensator as floating
from hystgen.effects.ageing.compensator import Aged, AgeingPiece, piece_at
from hystgen.effects.gains import (
    GAIN_BITS,
    LARGEST,
    LARGEST_GAIN,
    LEAST,
    LEAST_GAIN,
    ONE,
    RECIPROCAL_ERROR,
    followed,
    newton_steps,
    reciprocal,
)
from hystgen.effects.kinds import Rows, numbered
from hystgen.effects.part import Coded, CodedGain, Coding, FixedSurroundings, Realized, Speed
from hystgen.plays.slots import Counts, zero

SHARE_BITS = 20
"""Bits of the fraction of a piece's length; the gain, which changes by a hundredth along a piece, then has 27."""

CUBIC_ERROR = 8.0 * 2.0**-GAIN_BITS
"""[share of the signal] Error of a gain from a cubic piece: four coefficients and products, and a fraction of the
length rounded to 20 bits, over which the gain changes by a hundredth."""

LONGEST = 2**61
"""[drive codes] Largest travel that is counted, 5e8 ranges in q31; beyond it the gain keeps its last value."""


class FixedAgeingPiece(Struct):
    """A piece of the gain over travel: a cubic in the fraction of its length."""

    begin: Int64
    share: Factor  # of the travel since `begin`, without the bits that the product drops
    drop: UInt8
    c: FourInt32


class FixedAgeingTable(Struct):
    """Gain over travel up to `last`."""

    last: Int64
    n: Count
    turns: UInt8  # Newton steps for the reciprocal of a gain that has changed
    bits: UInt8  # of a gain below the code that sets it


class FixedAgeingState(Struct):
    """A gain."""

    high: Int64  # travel, drive codes
    gain: Int32
    inverse: Int32
    own: Flag  # the gain follows the travel


KIND = replace(
    floating.KIND, table=FixedAgeingTable, state=FixedAgeingState, rows=Rows("piece", FixedAgeingPiece)
)


class FixedAgeingTables(NamedTuple):
    """All ageing of a model, as in floating point."""

    block: FixedAgeingTable
    first: Counts
    piece: FixedAgeingPiece


def tables(rows: Sequence[tuple[AgeingPiece, int]], lsb: float, bits: int) -> FixedAgeingTables:
    """Tables from the pieces of the gain and the Newton steps of each ageing effect, for drive codes of `lsb`.

    `bits`: of a gain below the code that sets it. Raises OverflowError if a number does not fit.
    """
    piece: list[tuple[object, ...]] = []
    block = []
    for pieces, turns in rows:
        last, before = 0, len(piece)
        for begin, inverse_length, *curve in pieces.tolist():
            length = 1.0 / inverse_length / lsb
            drop = max(0, round(length).bit_length() + 1 - (MOST.bit_length() - 1))
            at = round(begin / lsb)
            if at + length >= LONGEST:
                break
            share = factor(2.0**SHARE_BITS / length * 2.0**drop)
            piece.append((at, share, drop, [round(c * ONE) for c in curve]))
            last = at + round(length)
        block.append((last, len(piece) - before, turns, bits))
    first = firsts(n for _, n, *_ in block)
    return FixedAgeingTables(FixedAgeingTable.of(block), first, FixedAgeingPiece.of(piece))


@dataclass(frozen=True)
class AgeingFormats(Coded):
    """An ageing block with its pieces of the gain and Newton steps."""

    one: Aged
    pieces: AgeingPiece
    turns: int

    def gain(self, size: float, speed: Speed, at: Coding) -> CodedGain:
        """The gain's properties, for inputs up to `size`."""
        begun = 0.5 * at.drive_lsb * abs(floating.steepness(self.one.effect, 0.0))  # pieces begin at whole codes
        wrong = floating.TABLE_ERROR + begun + CUBIC_ERROR
        late = floating.most_at_once(self.one.effect, speed.step) + wrong / LEAST_GAIN + RECIPROCAL_ERROR
        return CodedGain(LEAST_GAIN, LARGEST_GAIN, wrong * size, late * size)


def formats(one: Aged, about: FixedSurroundings, *_: float) -> AgeingFormats:
    """A block of a model."""
    turns = newton_steps(floating.most_at_once(one.effect, about.ends[1] - about.ends[0]), 2.0**-GAIN_BITS)
    return AgeingFormats(one, floating.pieces(one.effect), turns)


def made(blocks: Sequence[AgeingFormats], about: FixedSurroundings) -> FixedAgeingTables:
    """The tables of several blocks, by `tables`."""
    rows = [(each.pieces, each.turns) for each in blocks]
    return tables(rows, float(about.drive_lsb), GAIN_BITS - (about.code_bits - 2))


# ---------------------------------------------------------------- ageing_fixed.c


@jit
def ageing_gain(t: FixedAgeingTables, j: int, travel: int) -> int:
    """The gain at a travel; past the last piece it stays constant."""
    low = piece_at(t.first, t.piece.begin, j, travel)
    on = (travel - t.piece.begin[low]) >> t.piece.drop[low]
    share = times(on, t.piece.share.mantissa[low], t.piece.share.shift[low])
    if share > 1 << SHARE_BITS:
        share = zero(share) + (1 << SHARE_BITS)
    gain = zero(share)
    for k in range(3, -1, -1):
        gain = t.piece.c[low, k] + ((gain * share + (1 << (SHARE_BITS - 1))) >> SHARE_BITS)
    return gain


@jit
def ageing_set_travel(t: FixedAgeingTables, s: FixedAgeingState, j: int, travel: int) -> bool:
    """Set the travel. Returns whether it had to be limited."""
    inside = travel
    if inside < 0:
        inside = zero(travel)
    elif inside > t.block.last[j]:
        inside = t.block.last[j]
    s.high[j] = inside
    s.own[j] = 1
    s.gain[j] = ageing_gain(t, j, inside)
    s.inverse[j] = reciprocal(s.gain[j])
    return bool(inside != travel)


@jit
def ageing_set(t: FixedAgeingTables, s: FixedAgeingState, j: int, gain: int) -> bool:
    """Set a gain that replaces the one from the travel. Returns whether it had to be limited."""
    given = gain << t.block.bits[j]
    inside = given
    if inside < LEAST:
        inside = zero(given) + LEAST
    elif inside > LARGEST:
        inside = zero(given) + LARGEST
    s.own[j] = 0
    s.gain[j] = inside
    s.inverse[j] = reciprocal(inside)
    return bool(inside != given)


@jit
def ageing_move(t: FixedAgeingTables, s: FixedAgeingState, j: int, before: int, v: int) -> None:
    """Note that the drive has moved from `before` to v."""
    way = v - before
    following = s.high[j] + (way if way >= 0 else -way)
    if following > t.block.last[j]:
        following = t.block.last[j]
    s.high[j] = following
    if s.own[j]:
        gain = ageing_gain(t, j, following)
        s.inverse[j] = followed(gain, s.inverse[j], t.block.turns[j])
        s.gain[j] = gain


@jit
def ageing_solve(t: FixedAgeingTables, s: FixedAgeingState, j: int, y: int) -> int:  # noqa: ARG001  block interface
    """The input that gives the output y."""
    return times(y, s.inverse[j], GAIN_BITS)


@jit
def ageing_absorb(t: FixedAgeingTables, s: FixedAgeingState, j: int, x: int) -> int:  # noqa: ARG001  block interface
    """The output for the input x."""
    return times(x, s.gain[j], GAIN_BITS)


ARITHMETIC = Realized(
    floating.verbs(FixedAgeingState, ageing_absorb, ageing_solve, ageing_move, ageing_set, ageing_set_travel),
    numbered(KIND, 8, 2), made, formats, kinds=(KIND,),
)
