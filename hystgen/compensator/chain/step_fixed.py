"""The parts of a step of a model with effects that are specific to fixed point, where signals have bits below a code.

Signals in front of the plays are in units of the plays' input, signals behind them in fractions of an output code.
"""

from __future__ import annotations

from collections.abc import Callable

from hystgen.arithmetic.factors import paired, times
from hystgen.basics.jit import inside, jit
from hystgen.compensator import step_fixed
from hystgen.compensator.chain import corners_fixed, moving_fixed
from hystgen.compensator.chain.layout import REST_BITS, TRAVEL_BITS, FixedChainTables
from hystgen.compensator.chain.parts import LED, PARTS
from hystgen.compensator.chain.preview import targeting
from hystgen.compensator.chain.sides import Blocks
from hystgen.compensator.chain.step import ChainState, Conversions
from hystgen.effects.maps import maps_forward, maps_inverse
from hystgen.front import curve
from hystgen.plays.fixed import divide_by_slope, nearest
from hystgen.plays.slots import OUTPUT_CLAMPED

# ---------------------------------------------------------------- chain_finer.c or chain_whole.c


@jit
def finer(t: FixedChainTables, s: ChainState, h: int, w: int, a: int) -> int:
    """The signal in front of the plays at which their sum is h, with more bits than their input w: the remainder of h
    at w is divided by the slope."""
    bits = t.number.arriving_bits[0]
    if bits == 0:
        return a
    whole = a << bits
    if h > t.number.largest_level[0] or h < -t.number.largest_level[0]:
        return whole
    left = h << t.number.level_drop[0]
    k = 1
    for i in range(len(s.plays.play)):
        low = w - t.plays.threshold[i]
        high = w + t.plays.threshold[i]
        play = s.plays.play[i]
        z = inside(play, low, high)
        if z != play:
            k = i + 1
        left = left - t.plays.weight[i] * z
    size = -left if left < 0 else left
    if size > t.plays.slope[k]:
        return whole
    more = divide_by_slope(t.plays, size << bits, k)
    return whole - more if left < 0 else whole + more


# ---------------------------------------------------------------- chain_fixed.c


@jit
def drive_signal(t: FixedChainTables, v: int) -> int:
    """A drive code as a signal."""
    return v << t.number.drive_bits[0]


@jit
def arriving(t: FixedChainTables, a: int) -> int:
    """A signal in front of the plays in units of their input."""
    return nearest(a, t.number.arriving_bits[0])


@jit
def level_signal(t: FixedChainTables, u: int) -> int:
    """An output code as a signal."""
    return u << t.number.level_bits[0]


@jit
def drive_code(t: FixedChainTables, x: int) -> int:
    """The drive code of a signal, limited to two spans beyond the range."""
    return inside(nearest(x, t.number.drive_bits[0]), t.number.least_code[0], t.number.most_code[0])


@jit
def output_code(t: FixedChainTables, y: int) -> tuple[int, int]:
    """The output code of a signal, limited to the type, and its status."""
    code = nearest(y, t.number.level_bits[0])
    within = inside(code, -t.limits.code_max[0], t.limits.code_max[0])
    return within, OUTPUT_CLAMPED if within != code else 0


@jit
def entered_travel(t: FixedChainTables, x: int) -> int:  # noqa: ARG001  as in floating point
    """The travel in drive codes for a code given as argument."""
    return x << TRAVEL_BITS


@jit
def shared(t: FixedChainTables, share: int, x: int) -> int:
    """A share of a signal. The share is a code; the largest code stands for almost 1."""
    return times(x, share << t.number.share_bits[0], 31)


# ---------------------------------------------------------------- chain_braked.c

led = PARTS[LED].fixed.verbs.led
assert led
led_braked: Callable[..., int] = led.braked


@jit
def braked(t: FixedChainTables, s: ChainState, v: int, near: int) -> int:
    """The drive from which the lag does not overshoot, if `near` can be reached instead of v."""
    bits = t.number.drive_bits[0]
    beyond = v - near if v > near else near - v
    falling, rising = t.number.slew_falling[0] << bits, t.number.slew_rising[0] << bits
    drive = led_braked(
        t.blocks[LED], s.blocks[LED], near << bits, beyond << bits, falling, rising, 1 << bits, t.number.braked_drop[0]
    )
    return drive_code(t, drive)


# ---------------------------------------------------------------- slew_fixed.c


@jit
def ramp(before: int, rest: int, move: int, more: int) -> tuple[int, int]:
    """The drive one step of `move` and `more` after `before` with rounding remainder `rest`, and the new remainder."""
    left = rest + more
    whole = (left + (1 << (REST_BITS - 1))) >> REST_BITS
    return before + move + whole, left - (whole << REST_BITS)


BLOCKS = Blocks(
    lambda part: part.fixed.verbs, (maps_forward, maps_inverse), targeting(paired),
    (curve.front_forward, curve.front_inverse), moving_fixed.UNMOVED, moving_fixed.PLAYS, finer, braked, ramp,
)
CORNERS = BLOCKS._replace(plays=corners_fixed.PLAYS, finer=corners_fixed.finer)
CODES = Conversions(
    step_fixed.finite, drive_signal, arriving, level_signal, drive_code, output_code, entered_travel, shared
)
