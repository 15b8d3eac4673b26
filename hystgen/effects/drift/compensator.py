"""Drift from the compensator's own clock, which counts samples exactly since it was started."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from hystgen.basics.jit import Action, Answer, Scalar, inside, jit, zero
from hystgen.basics.structures import Literal, Real, Struct, memory_of, note
from hystgen.effects.base import Place
from hystgen.effects.drift.model import CurvedDrift, LinearDrift
from hystgen.effects.kinds import BlockKind, numbered
from hystgen.effects.part import ChainPart, FloatSurroundings, Realized, Unmeasured, Verbs, called, late

# ---------------------------------------------------------------- clock.c

CARRY_SAMPLES = 2.0**24
"""Samples that a 24-bit number counts exactly; two numbers together count to 2^48, nine years at 1 MHz."""


class ClockTable(Struct):
    """Drift over time: its rate, and half the change in the rate per second."""

    sample: Real = note("duration in s of one sample, and of `carry` of them")
    block: Real
    carry: Real
    rate: Real
    half_change: Real
    farthest: Real
    one: Literal
    most_ahead: Literal  # largest number of samples by which references are ahead


class ClockState(Struct):
    """A clock."""

    high: Real = note("samples counted: multiples of the table's carry, and the rest")
    low: Real
    lead: Real = note("samples by which the next reference is ahead")


KIND = BlockKind("clock", ClockTable, ClockState, own=())


def numbers(effect: LinearDrift | CurvedDrift, seconds: float, farthest: float, ahead: int) -> tuple[float, ...]:
    """The constants at steps of `seconds`, for references `ahead` samples ahead of the motion."""
    change = effect.change if isinstance(effect, CurvedDrift) else 0.0
    block = CARRY_SAMPLES * seconds
    return seconds, block, CARRY_SAMPLES, effect.rate, 0.5 * change, farthest, 1.0, float(ahead)


@jit
def clock_start(t: ClockTable, s: ClockState, j: int) -> None:  # noqa: ARG001  block interface
    """Start the clock at the last absorbed drive."""
    s.high[j] = zero(s.high[j])
    s.low[j] = zero(s.low[j])


@jit
def clock_tick(t: ClockTable, s: ClockState, j: int, before: Scalar, v: Scalar) -> None:  # noqa: ARG001  block interface
    """Advance by one sample."""
    following = s.low[j] + t.one[j]
    if following >= t.carry[j]:
        s.low[j] = zero(following)
        s.high[j] = s.high[j] + t.one[j]
    else:
        s.low[j] = following


@jit
def clock_drift(t: ClockTable, s: ClockState, j: int, ahead: Scalar) -> Scalar:
    """The drift `ahead` samples after the present one."""
    time = s.high[j] * t.block[j] + (s.low[j] + ahead) * t.sample[j]
    drift = (t.rate[j] + t.half_change[j] * time) * time
    return inside(drift, -t.farthest[j], t.farthest[j])


def verbs(memory: Callable[..., object], start: Action, tick: Action, drift: Answer) -> Verbs:
    """The verbs of a clock from its functions in an arithmetic."""

    @jit
    def added(t: ClockTable, s: ClockState, j: int) -> Scalar:
        """The drift now."""
        return drift(t, s, j, zero(t.one[j]))

    @jit
    def lead(t: ClockTable, s: ClockState, j: int, filled: int) -> None:
        """Note a new reference: the next one is one sample further ahead, up to the length of the preview."""
        following = t.one[j]
        if filled:
            following = following + s.lead[j]
        s.lead[j] = t.most_ahead[j] if following > t.most_ahead[j] else following

    @jit
    def ahead(t: ClockTable, s: ClockState, j: int, filled: int, moving: int) -> Scalar:
        """The drift at the time of the newest reference."""
        late = s.lead[j] if filled else zero(t.one[j])
        return drift(t, s, j, late + t.one[j] if moving else late)

    return Verbs(memory, reset=start, move=tick, added=added, lead=lead, ahead=ahead)


def tables(effects: Sequence[LinearDrift | CurvedDrift], about: FloatSurroundings) -> ClockTable:
    """The constants of a model's clock."""
    rows = about.reals([numbers(each, about.seconds, about.span, about.ahead) for each in effects], "drift")
    return ClockTable.of(rows, rows.dtype)


ARITHMETIC = Realized(
    verbs(memory_of(ClockState), clock_start, clock_tick, clock_drift), numbered(KIND, 5), tables, kinds=(KIND,)
)

PART = ChainPart(
    "clock", "drift", Place.ADDED, called("drift"), lambda effect, *_: effect,
    ARITHMETIC, late("drift"),
    code=("clock",),
    unmeasured=Unmeasured(
        "drift",
        "a clock that runs by itself, with an unknown start; set_offset takes the drift from outside, and "
        "emit.compensation.compensate: [drift] lets the module count from there",
        "drift (a clock that runs by itself, with an unknown start",
    ),
)
"""Drift as a part of the chain: a clock's contribution to the displacement."""

PARTS = (PART,)
