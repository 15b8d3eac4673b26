"""A part of a compensator's chain: one kind of block, described once in the folder of its effect."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

from hystgen.effects.kinds import Constants

Function = Callable[..., Any]


class Led(NamedTuple):
    """How the only block in front of the plays is led where what follows depends on the way there: where it is, the
    input that leads to an output, the one that is kept, what follows from an input, and what is missed of a way in its
    first sample; and the input from which it does not overshoot behind a slew limit, found by so many `halves`."""

    state: Function
    solve: Function
    kept: Function
    absorb: Function
    missed: Function
    braked: Function
    halves: int = 0


@dataclass(frozen=True)
class Verbs:
    """What blocks of one kind do in one arithmetic: functions of the tables and the memory of all of them, the index of
    a block, and numbers. The chain calls those that a kind has.

    `memory`: made for tables and a dtype; `rest`, `absorb`, `resting`, `solve`: of a block that signals pass; without
    `rest` it settles as it absorbs, without `resting` it rests as it solves.

    `reset`: as in the parameter file; `move`: the drive has moved from one value to another in one sample; `set_*`: by
    a number from the caller, and whether that had to be limited; `travelled`: of the memory alone, the way so far.
    `added`: to the displacement, now; `lead`: a reference has come, whether or not it is the first one; `ahead`: added
    to the displacement by the time of the newest reference, by whether there are any and whether the drive has moved.
    `led`: of a block in front of the plays that may be led.
    """

    memory: Function
    rest: Function | None = None
    absorb: Function | None = None
    resting: Function | None = None
    solve: Function | None = None
    reset: Function | None = None
    move: Function | None = None
    set_temperature: Function | None = None
    set_gain: Function | None = None
    set_travel: Function | None = None
    travelled: Function | None = None
    added: Function | None = None
    lead: Function | None = None
    ahead: Function | None = None
    led: Led | None = None

    def verb(self, name: str) -> Function | None:
        """The function that does this."""
        found: Function | None = getattr(self, name)
        instead = {"rest": self.absorb, "resting": self.solve}
        return found or instead.get(name)


@dataclass(frozen=True)
class Arithmetic:
    """A kind of block in one arithmetic: its verbs, and its constants from its tables."""

    verbs: Verbs
    constants: Callable[[Any], Iterable[Constants]]


@dataclass(frozen=True)
class Part:
    """One kind of block. `name`: as in C; `calls`: of the interface that it answers; `forward`: only the forward
    operator has it."""

    name: str
    floating: Arithmetic
    fixed: Arithmetic
    calls: tuple[str, ...] = ()
    forward: bool = False

    def arithmetic(self, fixed: bool) -> Arithmetic:
        """It in fixed point, or else in floating point."""
        return self.fixed if fixed else self.floating
