"""The gain that ageing leaves in fixed point, over a travel in drive codes that is counted exactly."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hystgen.arithmetic.factors import LARGEST as MOST
from hystgen.arithmetic.factors import factor, times
from hystgen.basics.jit import jit
from hystgen.effects.ageing import compensator as floating
from hystgen.effects.ageing.compensator import (
    GAIN,
    HIGH,
    INVERSE,
    LAST,
    Aged,
    AgeingState,
    AgeingTables,
    ageing_travelled,
)
from hystgen.effects.base import Array
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
from hystgen.effects.kinds import Constants, Kind, Rows
from hystgen.effects.part import Coded, CodedGain, Coding, FixedSurroundings, Realized, Speed, Verbs
from hystgen.plays.slots import zero

SHARE_BITS = 20
"""Fraction bits of the share of a piece; the gain changes by a hundredth along a piece, so it gets 27."""

CUBIC_ERROR = 8.0 * 2.0**-GAIN_BITS
"""[share of the signal] Error of a gain from a cubic piece: four coefficients and products, and a share rounded to 20
bits while the gain changes by a hundredth."""

LONGEST = 2**61
"""Most drive codes that a travel counts, 5e8 times a range in q31; beyond, the gain keeps its last value."""


KIND = Kind(
    "ageing", rows=Rows("piece", letters="wfbc"), counts=("n", "turns", "bits"), flags=("own",), reading=(),
    own=("solve", "absorb"), letters="w", memory="wii",
)


def constants(t: AgeingTables) -> Iterator[Constants]:
    """The numbers of each gain."""
    for each, number in zip(floating.constants(t), t.number, strict=True):
        counts = (*each.counts, int(number[0]))
        yield replace(each, kind=KIND, table=number[-1:], counts=counts, products=(8 + 2 * each.counts[1], 2))


def tables(rows: Sequence[tuple[Array, int]], lsb: float, bits: int) -> AgeingTables:
    """Pieces of the gain and Newton steps of each ageing effect, for drive codes of `lsb`.

    `bits`: how many bits a gain has below the code that sets it. Raises OverflowError.
    """
    piece: list[list[int]] = []
    number: list[list[int]] = []
    first = [0]
    for pieces, _ in rows:
        last = 0
        for row in pieces.tolist():
            length = 1.0 / row[floating.INVERSE_LENGTH] / lsb
            drop = max(0, round(length).bit_length() + 1 - (MOST.bit_length() - 1))
            begin = round(row[floating.BEGIN] / lsb)
            if begin + length >= LONGEST:
                break
            curve = [round(c * ONE) for c in row[floating.C0 :]]
            piece.append([begin, *factor(2.0**SHARE_BITS / length * 2.0**drop), drop, *curve])
            last = begin + round(length)
        number.append([bits, 0, 0, 0, last])
        first.append(len(piece))
    return AgeingTables(
        np.array(first, dtype=np.int64),
        np.array(piece, dtype=np.int64).reshape(-1, 8),
        np.array(number, dtype=np.int64).reshape(-1, 5),
        np.array([turns for _, turns in rows], dtype=np.int64),
    )


@dataclass(frozen=True)
class AgeingFormats(Coded):
    """An ageing block with its pieces of the gain and Newton steps."""

    one: Aged
    pieces: Array
    turns: int

    def gain(self, size: float, speed: Speed, at: Coding) -> CodedGain:
        """The gain's properties, for inputs within a size."""
        begun = 0.5 * at.drive_lsb * abs(floating.steepness(self.one.effect, 0.0))  # pieces begin at whole codes
        wrong = floating.TABLE_ERROR + begun + CUBIC_ERROR
        late = floating.most_at_once(self.one.effect, speed.step) + wrong / LEAST_GAIN + RECIPROCAL_ERROR
        return CodedGain(LEAST_GAIN, LARGEST_GAIN, wrong * size, late * size)


def formats(one: Aged, about: FixedSurroundings, *_: float) -> AgeingFormats:
    """A block of a model."""
    turns = newton_steps(floating.most_at_once(one.effect, about.ends[1] - about.ends[0]), 2.0**-GAIN_BITS)
    return AgeingFormats(one, floating.pieces(one.effect), turns)


def made(blocks: Sequence[AgeingFormats], about: FixedSurroundings) -> AgeingTables:
    """The tables of several blocks, by `tables`."""
    rows = [(each.pieces, each.turns) for each in blocks]
    return tables(rows, float(about.drive_lsb), GAIN_BITS - (about.code_bits - 2))


# ---------------------------------------------------------------- ageing_fixed.c

BEGIN, SHARE, DROP, C0 = 0, 1, 3, 4
BITS = 0


@jit
def ageing_gain(t: AgeingTables, j: int, travel: Any) -> Any:
    """The gain at a travel; past the last piece it stays constant."""
    low = t.first[j]
    high = t.first[j + 1]
    while high - low > 1:
        middle = (low + high) // 2
        if travel >= t.piece[middle, BEGIN]:
            low = middle
        else:
            high = middle
    share = times((travel - t.piece[low, BEGIN]) >> t.piece[low, DROP], t.piece[low, SHARE], t.piece[low, SHARE + 1])
    if share > 1 << SHARE_BITS:
        share = zero(share) + (1 << SHARE_BITS)
    gain = zero(share)
    for k in range(C0 + 3, C0 - 1, -1):
        gain = t.piece[low, k] + ((gain * share + (1 << (SHARE_BITS - 1))) >> SHARE_BITS)
    return gain


@jit
def ageing_set_travel(t: AgeingTables, s: AgeingState, j: int, travel: Any) -> bool:
    """Set the travel. Returns whether it had to be limited."""
    inside = travel
    if inside < 0:
        inside = zero(travel)
    elif inside > t.number[j, LAST]:
        inside = t.number[j, LAST]
    s.block[j, HIGH] = inside
    s.own[j] = 1
    s.block[j, GAIN] = ageing_gain(t, j, inside)
    s.block[j, INVERSE] = reciprocal(s.block[j, GAIN])
    return bool(inside != travel)


@jit
def ageing_reset(t: AgeingTables, s: AgeingState, j: int) -> None:
    """Return to the state of the parameter file: nothing has been travelled."""
    ageing_set_travel(t, s, j, zero(t.number[j, LAST]))


@jit
def ageing_set(t: AgeingTables, s: AgeingState, j: int, gain: Any) -> bool:
    """Set a gain in place of the one that follows the travel. Returns whether it had to be limited."""
    given = gain << t.number[j, BITS]
    inside = given
    if inside < LEAST:
        inside = zero(given) + LEAST
    elif inside > LARGEST:
        inside = zero(given) + LARGEST
    s.own[j] = 0
    s.block[j, GAIN] = inside
    s.block[j, INVERSE] = reciprocal(inside)
    return bool(inside != given)


@jit
def ageing_move(t: AgeingTables, s: AgeingState, j: int, before: Any, v: Any) -> None:
    """The drive has moved to v."""
    way = v - before
    following = s.block[j, HIGH] + (way if way >= 0 else -way)
    if following > t.number[j, LAST]:
        following = t.number[j, LAST]
    s.block[j, HIGH] = following
    if s.own[j]:
        gain = ageing_gain(t, j, following)
        s.block[j, INVERSE] = followed(gain, s.block[j, INVERSE], t.turns[j])
        s.block[j, GAIN] = gain


@jit
def ageing_solve(t: AgeingTables, s: AgeingState, j: int, y: Any) -> Any:  # noqa: ARG001  block interface
    """The input that gives the output y."""
    return times(y, s.block[j, INVERSE], GAIN_BITS)


@jit
def ageing_absorb(t: AgeingTables, s: AgeingState, j: int, x: Any) -> Any:  # noqa: ARG001  block interface
    """The output for the input x."""
    return times(x, s.block[j, GAIN], GAIN_BITS)


ARITHMETIC = Realized(
    Verbs(
        floating.memory, absorb=ageing_absorb, solve=ageing_solve, reset=ageing_reset, move=ageing_move,
        set_gain=ageing_set, set_travel=ageing_set_travel, travelled=ageing_travelled,
    ),
    constants, made, formats,
)
