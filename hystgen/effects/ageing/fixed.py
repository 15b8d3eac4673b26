"""Ageing in fixed point: the gain as a function of the travel, which is counted exactly in drive codes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from hystgen.arithmetic.factors import LARGEST as MOST
from hystgen.arithmetic.factors import factor, times
from hystgen.basics.jit import jit, zero
from hystgen.basics.structures import firsts
from hystgen.effects.ageing import compensator as floating
from hystgen.effects.ageing.compensator import Aged, AgeingPiece, AgeingState, AgeingTable, AgeingTables
from hystgen.effects.gains import FIXED, GAIN_BITS, LARGEST_GAIN, LEAST_GAIN, ONE, RECIPROCAL_ERROR, newton_steps
from hystgen.effects.kinds import numbered
from hystgen.effects.part import Coded, CodedGain, Coding, FixedSurroundings, Realized, Speed

SHARE_BITS = 20
"""Bits of a position as a fraction of a piece's length; the gain changes by a hundredth over it, so it has 27 bits."""

CUBIC_ERROR = 8.0 * 2.0**-GAIN_BITS
"""[fraction of the signal] Error of a gain from a cubic piece: four coefficients and products, and a fraction of the
length rounded to 20 bits, over which the gain changes by a hundredth."""

LONGEST = 2**61
"""[drive codes] Largest travel that is counted, 5e8 ranges in q31; beyond it the gain keeps its last value."""


def tables(rows: Sequence[tuple[AgeingPiece, int]], lsb: float, bits: int) -> AgeingTables:
    """Tables from the pieces of the gain and the Newton steps of each ageing effect, for drive codes of `lsb`.

    `bits`: left shift from a caller's code to a gain. Raises OverflowError if a number does not fit.
    """
    piece: list[tuple[object, ...]] = []
    block = []
    for pieces, turns in rows:
        last, before = 0, len(piece)
        for begin, inverse_length, curve in pieces.tolist():
            length = 1.0 / inverse_length / lsb
            drop = max(0, round(length).bit_length() + 1 - (MOST.bit_length() - 1))
            at = round(begin / lsb)
            if at + length >= LONGEST:
                break
            share = factor(2.0**SHARE_BITS / length * 2.0**drop)
            piece.append((at, share, drop, [round(c * ONE) for c in curve]))
            last = at + round(length)
        block.append((*FIXED.limits, last, len(piece) - before, turns, bits))
    numbers = AgeingTable.of(block)
    return AgeingTables(numbers, firsts(numbers.n.tolist()), AgeingPiece.of(piece))


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
    """The formats of a block."""
    turns = newton_steps(floating.most_at_once(one.effect, about.ends[1] - about.ends[0]), 2.0**-GAIN_BITS)
    return AgeingFormats(one, floating.pieces(one.effect), turns)


def made(blocks: Sequence[AgeingFormats], about: FixedSurroundings) -> AgeingTables:
    """The tables of several blocks, made by `tables`."""
    rows = [(each.pieces, each.turns) for each in blocks]
    return tables(rows, float(about.drive_lsb), GAIN_BITS - (about.code_bits - 2))


# ---------------------------------------------------------------- ageing.c


@jit
def along(t: AgeingTables, k: int, travel: int) -> int:
    """As in floating point."""
    on = (travel - t.row.begin[k]) >> t.row.drop[k]
    share = times(on, t.row.share.mantissa[k], t.row.share.shift[k])
    return zero(share) + (1 << SHARE_BITS) if share > 1 << SHARE_BITS else share


@jit
def part_of(gain: int, share: int) -> int:
    """The product of a gain and a position in a piece."""
    return (gain * share + (1 << (SHARE_BITS - 1))) >> SHARE_BITS


@jit
def travel_on(t: AgeingTables, s: AgeingState, j: int, way: int) -> None:
    """Add the length of a move to the travel."""
    following = s.high[j] + way
    s.high[j] = t.block.last[j] if following > t.block.last[j] else following


ARITHMETIC = Realized(
    floating.verbs(FIXED, AgeingState, along, part_of, travel_on),
    numbered(floating.KIND, 8, 2), made, formats, kinds=(floating.KIND,),
)
