"""The interface of a block of the chain, one sample at a time, from which a compensator is made.

Every block between the drive and the output has three verbs: `rest`, everything has settled at an input; `solve`, which
input gives an output now, without moving anything; `absorb`, the input was this. A compensator solves backwards from
the output and absorbs the applied drive forwards, so that its memory holds only what the actuator has seen.
"""

from __future__ import annotations

from typing import Protocol


class Block(Protocol):
    """One block of the chain. Signals are in the units of its input and output, times in s."""

    def resting(self, y: float) -> float:
        """The input that gives the output `y` once everything has settled."""

    def rest(self, x: float) -> float:
        """Settle at the input `x`; returns the output."""

    def advance(self, seconds: float) -> None:
        """The next sample comes this long after the last one."""

    def solve(self, y: float) -> float:
        """The input that gives the output `y` at this sample."""

    def absorb(self, x: float) -> float:
        """The input is `x` at this sample; returns the output."""
