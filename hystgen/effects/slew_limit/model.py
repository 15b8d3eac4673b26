"""Limited slew rate of the amplifier."""

from __future__ import annotations

from typing import Any, ClassVar, Literal, cast

import numpy as np
from pydantic import Field, model_validator

from hystgen.basics.jit import jit
from hystgen.basics.quantities import Positive
from hystgen.effects.base import About, Array, Candidate, Compensated, Effect, Place, Run

BELOW = (0.3, 0.5, 0.7, 1.0, 1.6, 2.2)
"""Starts below the fastest recorded rate, in decades: a limit met never, or always, leaves no trace."""

LEAST = 3.0
"""The same of the least rate: a step from sample to sample is faster than all else by a hundred times and more."""


@jit
def limit(u: Array, up: Array, down: Array, out: Array) -> None:
    """`u`, straight between samples, followed at no more than `up_k` upwards and `down_k` downwards in a step.

    Where it is met within a step, the rest of the step goes along with it, or as fast as it may.
    """
    x = u[0]
    out[0] = x
    for k in range(len(u) - 1):
        change = u[k + 1] - u[k]
        ahead = u[k] - x
        closing = up[k] - change if ahead > 0.0 else down[k] + change
        if ahead != 0.0 and not closing > abs(ahead):
            x = x + up[k] if ahead > 0.0 else x - down[k]
        elif -down[k] <= change <= up[k]:
            x = u[k + 1]
        else:
            part = abs(ahead) / closing if ahead != 0.0 else 0.0
            x = u[k] + part * change + (1.0 - part) * (up[k] if change > 0.0 else -down[k])
        out[k + 1] = x


class SlewLimit(Effect):
    """Slew limit `-S_falling <= a' <= S` of the drive: `a` goes towards `v` as fast as it may.

    Exact for straight `v` between samples.
    """

    name: Literal["slew_limit"] = Field(description="name of the effect")
    rate: Positive = Field(description="S, input units per s", examples=[5.0e3])
    falling_rate: Positive = Field(
        default=cast("float", None), description="limit of a falling drive, input units per s; by default the same"
    )

    place: ClassVar[Place] = Place.DRIVE
    order: ClassVar[int] = 1
    compensated: ClassVar[Compensated] = "none"
    compensation: ClassVar[str] = "the drive is kept within it, so that the memory is the actuator's"

    @model_validator(mode="after")
    def _same_rate(self) -> SlewLimit:
        if self.falling_rate is None:
            object.__setattr__(self, "falling_rate", self.rate)
        return self

    def drive(self, a: Array, run: Run) -> Array:
        """The drive as fast as it may be."""
        out = np.empty_like(a)
        limit(a, self.rate * run.steps, self.falling_rate * run.steps, out)
        return out

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """One rate, then one for each direction, up to the fastest recorded one."""
        fastest = np.log10(max(about.fastest, 1e-12))

        def build(x: Array) -> SlewLimit:
            return cls(name="slew_limit", rate=10.0 ** float(x[0]), falling_rate=10.0 ** float(x[-1]))

        def candidate(label: str, n: int, **more: Any) -> Candidate:
            none = np.full(n, fastest)
            start, *others = (none - below for below in BELOW)
            return Candidate(label, none - LEAST, none, start, build, none, tuple(others), **more)

        return [
            candidate("slew limit", 1),
            candidate("slew limit, rising and falling", 2, beyond="slew limit", grown=lambda x: np.repeat(x, 2)),
        ]


SHAPES = (SlewLimit,)


def load() -> None:
    """Have the recursions compiled, or read from the cache, on two samples."""
    limit(np.arange(2.0), np.ones(1), np.ones(1), np.empty(2))
