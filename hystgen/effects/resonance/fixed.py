"""A mode as a block of the forward operator in fixed point, with states finer than a signal.

A change of the input enters `off` in full, minus the part that the output follows in the same step: for a mode far
below the sample rate this part is a small factor, with 31 bits of its own.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from hystgen.arithmetic.factors import GUARD, LARGEST, STATE_BITS, factor, lifted, times
from hystgen.arithmetic.factors import error as missed
from hystgen.basics.jit import jit
from hystgen.basics.structures import AnyFactor, memory_of
from hystgen.effects.kinds import numbered
from hystgen.effects.part import Coded, Realized, Verbs
from hystgen.effects.resonance import compensator
from hystgen.effects.resonance.compensator import ModeNumbers, ModeState, ModeTable
from hystgen.plays.fixed import nearest

Row = tuple[tuple[int, int], tuple[int, int], tuple[int, int], tuple[int, int], tuple[int, int], int, int, int]
"""The members of a `ModeTable`."""


def largest_state(one: ModeNumbers, size: float) -> float:
    """The largest `off` or `rate` for inputs up to `size`."""
    return max(1.0 + one.largest, one.fastest) * size


def row(one: ModeNumbers, size: float) -> Row:
    """The table of a mode whose inputs are signals up to `size`. Raises OverflowError if the states do not fit."""
    state = max(largest_state(one, size), 1.0)
    wanted = math.ceil(math.log2(max(one.off_after + one.rate_after, 1.0))) + GUARD
    bits = min(wanted, STATE_BITS - 2 - math.ceil(math.log2(state)))
    if bits < 0:
        raise OverflowError("no room")
    drop = max(0, math.ceil(math.log2(state)) + bits + 1 - (LARGEST.bit_length() - 1))
    keep, turn, swing, lead, push = one.table
    late = 1.0 + lead
    lift = max(lifted(late, bits), lifted(push, bits))
    scale, entered = 2.0**drop, 2.0 ** (bits - lift)
    own = factor(keep * scale), factor(turn * scale), factor(swing * scale)
    return *own, factor(late * entered), factor(push * entered), bits, drop, lift


def rounding(one: ModeNumbers, table: Row, size: float) -> float:
    """Rounding errors of the output, in signals, for inputs up to `size` signals."""
    *_, bits, drop, lift = table
    state, most = 2.0**-bits, largest_state(one, size)
    keep, turn, swing, lead, push = one.table

    def products(own: float, enters: float) -> float:
        """Rounding errors of a state's change in a step: two products with states, one with a change of the input."""
        found = state * (1.0 + 2.0**drop * (abs(own) + abs(turn)) + 0.5 * 2.0**lift)
        found += most * sum(missed(x * 2.0**drop) * 2.0**-drop for x in (own, turn))
        scale = 2.0 ** (bits - lift)
        return found + 2.0 * size * missed(enters * scale) / scale

    lost = products(keep, 1.0 + lead) * one.off_after + products(swing, push) * one.rate_after
    return lost + 0.5 * state + 0.5


@dataclass(frozen=True)
class ModeFormats(Coded):
    """A mode, given by its constants."""

    one: ModeNumbers
    row: Row

    def there(self, size: float, signal: float) -> float:
        """Rounding errors of the output for inputs up to `size`, with signals in units of `signal`."""
        return rounding(self.one, self.row, size / signal) * signal


# ---------------------------------------------------------------- mode.c


mode_rest = compensator.mode_rest  # nothing in it is rounded


@jit
def scaled(t: ModeTable, j: int, x: int, by: AnyFactor) -> int:
    """A number in a state's units times a factor of mode j."""
    return times(x >> t.drop[j], by.mantissa[j], by.shift[j])


@jit
def entered(t: ModeTable, j: int, change: int, by: AnyFactor) -> int:
    """A change of the input times a factor of mode j, in a state's units."""
    return times(change, by.mantissa[j], by.shift[j]) << t.lift[j]


@jit
def mode_absorb(t: ModeTable, s: ModeState, j: int, x: int) -> int:
    """Absorb the input x at this sample. Returns the output."""
    change = x - s.before[j]
    off = s.off[j]
    rate = s.rate[j]
    turned = scaled(t, j, off, t.keep) + scaled(t, j, rate, t.turn)
    s.off[j] = off + (turned + (entered(t, j, change, t.late) - (change << t.bits[j])))
    s.rate[j] = rate + (scaled(t, j, rate, t.swing) - scaled(t, j, off, t.turn) + entered(t, j, change, t.push))
    s.before[j] = x
    return x + nearest(s.off[j], t.bits[j])


ARITHMETIC = Realized(
    Verbs(memory_of(ModeState), mode_rest, mode_absorb), numbered(compensator.KIND, 12),
    lambda modes, _: ModeTable.of([each.row for each in modes]),
    lambda one, about, given, _: ModeFormats(one, row(one, given * 2.0**about.bits)),
    kinds=(compensator.KIND,),
)
