"""An amplifier that covers a fixed share of the remaining way in each sample: a drive stage in front of the plays."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

import numpy as np

from hystgen.effects import Effect, OwnBlock, Place, Run, product

RATE, INVERSE_RATE = range(2)


def rest(t: Any, s: Any, x: Any) -> Any:  # noqa: ARG001
    s[0] = x
    return x


def resting(t: Any, y: Any) -> Any:  # noqa: ARG001
    return y


def solve(t: Any, s: Any, y: Any) -> Any:
    return s[0] + product(t[INVERSE_RATE], y - s[0])


def absorb(t: Any, s: Any, x: Any) -> Any:
    s[0] = s[0] + product(t[RATE], x - s[0])
    return s[0]


class Follower(Effect):
    name: Literal["user:follower"]
    bandwidth: float
    place: ClassVar[Place] = Place.DRIVE
    order: ClassVar[int] = 2
    block: ClassVar[OwnBlock] = OwnBlock(
        "follower.c", ("rate", "inverse_rate"), ("reached",), rest, resting, solve, absorb
    )

    def numbers(self, seconds: float) -> list[float]:
        rate = 1.0 - np.exp(-self.bandwidth * seconds)
        return [rate, 1.0 / rate]

    def drive(self, a: Any, run: Run) -> Any:
        y = a.copy()
        for k, seconds in enumerate(run.steps, 1):
            y[k] = y[k - 1] + (1.0 - np.exp(-self.bandwidth * seconds)) * (a[k] - y[k - 1])
        return y
