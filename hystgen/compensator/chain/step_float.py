"""The parts of a step of a model with effects that are specific to floating point, where all signals have one type."""

from __future__ import annotations

from typing import Any

from hystgen.basics.jit import jit
from hystgen.compensator import step_float
from hystgen.compensator.chain import corners_float, moving_float
from hystgen.compensator.chain.layout import ChainTables, Stages
from hystgen.compensator.chain.parts import LED, PARTS
from hystgen.compensator.chain.preview import preview_target
from hystgen.compensator.chain.sides import Blocks
from hystgen.compensator.chain.step import ChainState, Codes
from hystgen.front.compensator import front_forward, front_inverse

# ---------------------------------------------------------------- chain_float.c


@jit(inline=True)
def bent(t: Stages, x: Any) -> Any:
    """The output of the saturation for the input x."""
    return front_forward(t, x, 1)


@jit(inline=True)
def unbent(t: Stages, y: Any) -> tuple[Any, int]:
    """The input of the saturation that gives y, and whether there is none."""
    return front_inverse(t, y, 1)


@jit(inline=True)
def entered(t: ChainTables, x: Any) -> Any:  # noqa: ARG001  as in fixed point
    """A number from the caller as a signal."""
    return x


@jit(inline=True)
def finer(t: ChainTables, s: ChainState, h: Any, w: Any, a: Any) -> Any:  # noqa: ARG001  as in fixed point
    """The signal in front of the plays, which is already as fine as it gets."""
    return a


@jit(inline=True)
def output_code(t: ChainTables, y: Any) -> tuple[Any, int]:  # noqa: ARG001  as in fixed point
    """A displacement as the caller gets it, and its status."""
    return y, 0


@jit(inline=True)
def shared(t: ChainTables, share: Any, x: Any) -> Any:  # noqa: ARG001  as in fixed point
    """A share of x."""
    return share * x


# ---------------------------------------------------------------- chain_braked.c

led = PARTS[LED].floating.verbs.led
assert led
led_braked, HALVES = led.braked, led.halves


@jit
def braked(t: ChainTables, s: ChainState, v: Any, near: Any) -> Any:
    """The drive from which the lag does not overshoot, if `near` is in reach instead of v."""
    beyond = v - near if v > near else near - v
    falling, rising = t.number.slew_falling[0], t.number.slew_rising[0]
    return led_braked(t.blocks[LED], s.blocks[LED], near, beyond, falling, rising, HALVES)


# ---------------------------------------------------------------- slew_float.c


@jit
def ramp(before: Any, rest: Any, move: Any, more: Any) -> tuple[Any, Any]:
    """The drive one step of `move` and `more` after `before`, with rounding remainder `rest`, and its own remainder."""
    following = before + move
    moved = following - before
    left = ((before - (following - moved)) + (move - moved)) + (rest + more)
    drive = following + left
    return drive, left - (drive - following)


BLOCKS = Blocks(
    lambda part: part.floating.verbs, (bent, unbent), preview_target, (front_forward, front_inverse),
    moving_float.PLAYS, finer, braked, ramp,
)
CORNERS = BLOCKS._replace(plays=corners_float.PLAYS)
CODES = Codes(step_float.finite, entered, entered, entered, entered, output_code, entered, shared)
