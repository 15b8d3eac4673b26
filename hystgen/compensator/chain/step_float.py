"""The parts of a step of a model with effects that are specific to floating point, where all signals have one type."""

from __future__ import annotations

from hystgen.arithmetic.factors import multiplied
from hystgen.basics.jit import Answer, Scalar, jit
from hystgen.compensator import step_float
from hystgen.compensator.chain import corners_float, moving_float
from hystgen.compensator.chain.layout import FloatChainTables, Stages
from hystgen.compensator.chain.parts import LED, PARTS
from hystgen.compensator.chain.preview import targeting
from hystgen.compensator.chain.sides import Blocks
from hystgen.compensator.chain.step import ChainState, Conversions
from hystgen.front.compensator import front_forward, front_inverse

# ---------------------------------------------------------------- chain_float.c


@jit(inline=True)
def bent(t: Stages, x: Scalar) -> Scalar:
    """The output of the saturation for the input x."""
    return front_forward(t, x, 1)


@jit(inline=True)
def unbent(t: Stages, y: Scalar) -> tuple[Scalar, int]:
    """The input of the saturation that gives y, and whether no such input exists."""
    return front_inverse(t, y, 1)


@jit(inline=True)
def entered(t: FloatChainTables, x: Scalar) -> Scalar:  # noqa: ARG001  as in fixed point
    """A number from the caller as a signal."""
    return x


@jit(inline=True)
def finer(t: FloatChainTables, s: ChainState, h: Scalar, w: Scalar, a: Scalar) -> Scalar:  # noqa: ARG001  as in fixed point
    """The signal in front of the plays, which already has all its bits."""
    return a


@jit(inline=True)
def output_code(t: FloatChainTables, y: Scalar) -> tuple[Scalar, int]:  # noqa: ARG001  as in fixed point
    """A displacement as the caller gets it, and its status."""
    return y, 0


@jit(inline=True)
def shared(t: FloatChainTables, share: Scalar, x: Scalar) -> Scalar:  # noqa: ARG001  as in fixed point
    """A share of x."""
    return share * x


# ---------------------------------------------------------------- chain_braked.c

led = PARTS[LED].floating.verbs.led
assert led
led_braked: Answer = led.braked
HALVES = led.halves


@jit
def braked(t: FloatChainTables, s: ChainState, v: Scalar, near: Scalar) -> Scalar:
    """The drive from which the lag does not overshoot, if `near` can be reached instead of v."""
    beyond = v - near if v > near else near - v
    falling, rising = t.number.slew_falling[0], t.number.slew_rising[0]
    return led_braked(t.blocks[LED], s.blocks[LED], near, beyond, falling, rising, HALVES)


# ---------------------------------------------------------------- slew_float.c


@jit
def ramp(before: Scalar, rest: Scalar, move: Scalar, more: Scalar) -> tuple[Scalar, Scalar]:
    """The drive one step of `move` and `more` after `before` with rounding remainder `rest`, and the new remainder."""
    following = before + move
    moved = following - before
    left = ((before - (following - moved)) + (move - moved)) + (rest + more)
    drive = following + left
    return drive, left - (drive - following)


BLOCKS = Blocks(
    lambda part: part.floating.verbs, (bent, unbent), targeting(multiplied), (front_forward, front_inverse),
    moving_float.UNMOVED, moving_float.PLAYS, finer, braked, ramp,
)
CORNERS = BLOCKS._replace(plays=corners_float.PLAYS)
CODES = Conversions(step_float.finite, entered, entered, entered, entered, output_code, entered, shared)
