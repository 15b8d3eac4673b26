"""A mode that carries a share of the motion, as a block: unlike a whole mode, it passes the other share at once and has
an inverse.

It keeps the distance `off` of the output from the input, and its `rate`, both 0 at rest, as `compensator` does for a
whole mode. A change of the input adds the same share of its effect on a whole mode; the free oscillation is unchanged.
"""

from __future__ import annotations

from typing import Any

from hystgen.effects.kinds import OwnBlock, product

KEEP, TURN, SWING, LEAD, PUSH, INVERSE, NONE = range(7)
BEFORE, OFF, RATE = range(3)


def rest(t: Any, s: Any, x: Any) -> Any:
    """Settle everything at the input x. Returns the output."""
    s[BEFORE] = x
    s[OFF] = product(t[NONE], x)
    s[RATE] = product(t[NONE], x)
    return x


def resting(t: Any, y: Any) -> Any:  # noqa: ARG001  block interface
    """The input of the settled output y."""
    return y


def solve(t: Any, s: Any, y: Any) -> Any:
    """The input that gives the output y at this sample; moves nothing."""
    swung = product(t[KEEP], s[OFF]) + product(t[TURN], s[RATE])
    change = y - s[BEFORE] - (s[OFF] + swung)
    return s[BEFORE] + product(t[INVERSE], change)


def absorb(t: Any, s: Any, x: Any) -> Any:
    """Absorb the input x at this sample. Returns the output."""
    change = x - s[BEFORE]
    off = s[OFF]
    rate = s[RATE]
    swung = product(t[KEEP], off) + product(t[TURN], rate)
    turned = product(t[SWING], rate) - product(t[TURN], off)
    s[OFF] = off + (swung + product(t[LEAD], change))
    s[RATE] = rate + (turned + product(t[PUSH], change))
    s[BEFORE] = x
    return x + s[OFF]


BLOCK = OwnBlock(
    "part.c",
    table=("keep", "turn", "swing", "lead", "push", "inverse", "none"),
    state=("before", "off", "rate"),
    rest=rest, resting=resting, solve=solve, absorb=absorb,
)
