"""The interface of a block of the chain, one sample at a time, from which a compensator is made.

Every block between the drive and the output has three verbs: `rest`, everything settled at an input; `solve`, which
input gives an output now, moving nothing; `absorb`, the input was this. A compensator solves from the output backwards
and absorbs forwards what was applied, so that its memory is the actuator's and nothing else.
"""

from __future__ import annotations

from typing import Protocol


class Block(Protocol):
    """One block of the chain. Numbers are in the units of its input and output, times in s."""

    def resting(self, y: float) -> float:
        """The input that gives the output `y` once everything has settled."""

    def rest(self, x: float) -> float:
        """Settle at the input `x`; returns the output."""

    def advance(self, seconds: float) -> None:
        """The next sample comes this much after the last one."""

    def solve(self, y: float) -> float:
        """The input that gives the output `y` at this sample."""

    def absorb(self, x: float) -> float:
        """The input is `x` at this sample; returns the output."""
