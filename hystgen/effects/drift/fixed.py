"""Drift from the compensator's own clock in fixed point: summed sample by sample, without rounding.

The change per sample, and the change of that change, are constants with 60 bits below a signal; the sum is kept as
whole signals and a fraction. The clock stops once the drift has left the range of offsets for good.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

from hystgen.basics.jit import inside, jit, zero
from hystgen.basics.structures import Literal, Signal, Struct, UInt8, memory_of, note
from hystgen.effects.drift import compensator as floating
from hystgen.effects.drift.model import CurvedDrift, LinearDrift
from hystgen.effects.kinds import BlockKind, numbered
from hystgen.effects.part import FixedSurroundings, Realized

MOST_SAMPLES = 2**44
"""Maximum number of samples counted: half a year at 1 MHz. A drift that is then still in range stays constant."""

STATE_BITS = 58
"""Bits of a change per sample, excluding its sign: references ahead of time sum several such changes."""


class FixedClockTable(Struct):
    """Drift over time: its change in the first sample, and the growth of this change per sample."""

    slope: Signal
    change: Signal
    samples: Signal = note("after which the drift is constant")
    farthest: Signal
    bits: UInt8 = note("bits of slope and change below those of a signal")
    one: Literal
    most_ahead: Literal  # largest number of samples by which references are ahead


class FixedClockState(Struct):
    """A clock."""

    whole: Signal = note("drift, in units of signals,")
    part: Signal = note("and the fraction below, in units of the table")
    lead: Signal = note("samples by which the next reference is ahead")
    gained: Signal = note("growth of the change in a sample since the start")
    count: Signal = note("samples since the start")


KIND = BlockKind("clock", FixedClockTable, FixedClockState, own=())


@dataclass(frozen=True)
class ClockFormats:
    """The members of `FixedClockTable`, and the largest error of the drift in signals."""

    table: tuple[int, ...]
    error: float


def numbers(
    effect: LinearDrift | CurvedDrift, step: float, signal: Fraction, farthest: float, ahead: int
) -> ClockFormats:
    """The constants for samples `step` seconds apart, signals of `signal` output units, and a drift of up to `farthest`
    signals either way. Raises OverflowError if the drift overflows its numbers before it stays beyond `farthest`."""
    rate, change = (Fraction(x) for x in (effect.rate, getattr(effect, "change", 0.0)))
    own = Fraction(step)
    twice = change * own * own / signal
    slope = rate * own / signal + twice / 2
    samples = _samples(float(slope), float(twice), farthest)
    peak = 0.0 if not twice else min(max(float(-slope / twice), 0.0), float(samples))
    far = max(abs(_drift(float(slope), float(twice), n)) for n in (peak, float(samples)))
    fastest = abs(slope) + abs(twice) * (samples + ahead)
    room = STATE_BITS - math.ceil(math.log2(2.0 + 2.0 * ahead))
    bits = min(room - max(math.ceil(math.log2(float(fastest))), 0) if fastest else room, room)
    if bits < 0 or far > 2.0**60:
        raise OverflowError("no room")
    scaled = round(slope * 2**bits), round(twice * 2**bits)
    reach = samples + ahead
    error = 1.0 + 0.5 * 2.0**-bits * (reach + 0.5 * float(reach) ** 2 * bool(twice))
    return ClockFormats((*scaled, samples, math.floor(farthest), bits, 1, ahead), error)


def _drift(slope: float, twice: float, n: float) -> float:
    return slope * n + 0.5 * twice * n * (n - 1.0)


def _samples(slope: float, twice: float, farthest: float) -> int:
    """The number of samples after which the drift stays beyond `farthest`; at most `MOST_SAMPLES`."""
    if abs(_drift(slope, twice, float(MOST_SAMPLES))) <= farthest:
        return MOST_SAMPLES
    low, high = max(math.ceil(-slope / twice) + 1, 0) if slope * twice < 0.0 else 0, MOST_SAMPLES  # after the turn
    while high - low > 1:
        middle = (low + high) // 2
        if _drift(slope, twice, float(middle)) * math.copysign(1.0, twice or slope) > farthest:
            high = middle
        else:
            low = middle
    return high


# ---------------------------------------------------------------- clock.c


@jit
def clock_start(t: FixedClockTable, s: FixedClockState, j: int) -> None:  # noqa: ARG001  block interface
    """Start the clock at the last absorbed drive."""
    s.whole[j] = zero(s.whole[j])
    s.part[j] = s.whole[j]
    s.gained[j] = s.whole[j]
    s.count[j] = s.whole[j]


@jit
def clock_tick(t: FixedClockTable, s: FixedClockState, j: int, before: int, v: int) -> None:  # noqa: ARG001  block interface
    """Advance by one sample."""
    if s.count[j] >= t.samples[j]:
        return
    part = s.part[j] + t.slope[j] + s.gained[j]
    whole = part >> t.bits[j]
    s.whole[j] = s.whole[j] + whole
    s.part[j] = part - (whole << t.bits[j])
    s.gained[j] = s.gained[j] + t.change[j]
    s.count[j] = s.count[j] + 1


@jit
def clock_drift(t: FixedClockTable, s: FixedClockState, j: int, ahead: int) -> int:
    """The drift `ahead` samples after the present one."""
    more = (t.slope[j] + s.gained[j]) * ahead + t.change[j] * ((ahead * (ahead - 1)) // 2)
    drift = s.whole[j] + ((s.part[j] + more) >> t.bits[j])
    return inside(drift, -t.farthest[j], t.farthest[j])


def formats(effect: LinearDrift | CurvedDrift, about: FixedSurroundings, *_: float) -> ClockFormats:
    """The clock of an effect, for references up to `about.ahead` samples ahead."""
    return numbers(effect, about.seconds, about.output_lsb / 2**about.bits, float(about.farthest), about.ahead)


ARITHMETIC = Realized(
    floating.verbs(memory_of(FixedClockState), clock_start, clock_tick, clock_drift), numbered(KIND, 3),
    lambda clocks, _: FixedClockTable.of([one.table for one in clocks]), formats, kinds=(KIND,),
)
