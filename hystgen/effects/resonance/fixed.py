"""A mode as a block of the forward operator in fixed point, with states that have bits below a signal's.

A change of the input enters `off` in full, less the part that the output follows in the same step: for a mode far below
the sample rate that is a small factor, with 31 bits of its own.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from hystgen.arithmetic.factors import GUARD, LARGEST, STATE_BITS, factor, lifted, times
from hystgen.arithmetic.factors import error as missed
from hystgen.basics.jit import jit
from hystgen.effects.kinds import Constants, Kind
from hystgen.effects.part import Coded, Realized, Verbs
from hystgen.effects.resonance import compensator
from hystgen.effects.resonance.compensator import BEFORE, OFF, RATE, ModeNumbers
from hystgen.plays.fixed import nearest
from hystgen.plays.slots import Reals

KIND = Kind("mode", own=("rest", "absorb"), reading=("absorb",), letters="fffffbbb", memory="www")


def constants(t: Reals) -> Iterator[Constants]:
    """The numbers of each mode, from tables (k, 13)."""
    for row in t:
        yield Constants(KIND, row, (12, 0))


def largest_state(one: ModeNumbers, size: float) -> float:
    """The largest `off` or `rate` for inputs up to `size`."""
    return max(1.0 + one.largest, one.fastest) * size


def row(one: ModeNumbers, size: float) -> list[int]:
    """The numbers of a mode whose inputs are signals up to `size`. Raises OverflowError where states have no room."""
    state = max(largest_state(one, size), 1.0)
    wanted = math.ceil(math.log2(max(one.off_after + one.rate_after, 1.0))) + GUARD
    bits = min(wanted, STATE_BITS - 2 - math.ceil(math.log2(state)))
    if bits < 0:
        raise OverflowError("no room")
    drop = max(0, math.ceil(math.log2(state)) + bits + 1 - (LARGEST.bit_length() - 1))
    keep, turn, swing, lead, push = one.table
    late = 1.0 + lead
    lift = max(lifted(late, bits), lifted(push, bits))
    given = (*(x * 2.0**drop for x in (keep, turn, swing)), late * 2.0 ** (bits - lift), push * 2.0 ** (bits - lift))
    return [*(part for x in given for part in factor(x)), bits, drop, lift]


def rounding(one: ModeNumbers, table: Any, size: float) -> float:
    """Roundings of the output in signals, for inputs up to `size` of them."""
    bits, drop, lift = (int(x) for x in table[BITS:])
    state, most = 2.0**-bits, largest_state(one, size)
    keep, turn, swing, lead, push = one.table

    def products(own: float, enters: float) -> float:
        """Roundings of a step's change of a state: two products with states, and one with a change of the input."""
        found = state * (1.0 + 2.0**drop * (abs(own) + abs(turn)) + 0.5 * 2.0**lift)
        found += most * sum(missed(x * 2.0**drop) * 2.0**-drop for x in (own, turn))
        scale = 2.0 ** (bits - lift)
        return found + 2.0 * size * missed(enters * scale) / scale

    lost = products(keep, 1.0 + lead) * one.off_after + products(swing, push) * one.rate_after
    return lost + 0.5 * state + 0.5


@dataclass(frozen=True)
class ModeFormats(Coded):
    """A mode by its numbers."""

    one: ModeNumbers
    row: list[int]

    def there(self, size: float, signal: float) -> float:
        """Roundings of the output for inputs within a size, with signals of this unit."""
        return rounding(self.one, self.row, size / signal) * signal


# ---------------------------------------------------------------- mode_fixed.c

KEEP, TURN, SWING, LATE, PUSH, BITS, DROP, LIFT = 0, 2, 4, 6, 8, 10, 11, 12
mode_rest = compensator.mode_rest  # nothing in it is rounded


@jit
def scaled(t: Reals, j: int, x: Any, which: int) -> Any:
    """A number of a state's units times a factor of mode j."""
    return times(x >> t[j, DROP], t[j, which], t[j, which + 1])


@jit
def mode_absorb(t: Reals, s: Reals, j: int, x: Any) -> Any:
    """The input is x at this sample. Returns the output."""
    change = x - s[j, BEFORE]
    off = s[j, OFF]
    rate = s[j, RATE]
    late = times(change, t[j, LATE], t[j, LATE + 1]) << t[j, LIFT]
    push = times(change, t[j, PUSH], t[j, PUSH + 1]) << t[j, LIFT]
    turned = scaled(t, j, off, KEEP) + scaled(t, j, rate, TURN)
    s[j, OFF] = off + (turned + (late - (change << t[j, BITS])))
    s[j, RATE] = rate + (scaled(t, j, rate, SWING) - scaled(t, j, off, TURN) + push)
    s[j, BEFORE] = x
    return x + nearest(s[j, OFF], t[j, BITS])


ARITHMETIC = Realized(
    Verbs(compensator.memory, mode_rest, mode_absorb), constants,
    lambda modes, _: np.array([each.row for each in modes], dtype=np.int64).reshape(-1, 13),
    lambda one, about, given, _: ModeFormats(one, row(one, given * 2.0**about.bits)),
)
