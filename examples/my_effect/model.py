"""An effect of your own: the droop of a charge amplifier, whose charge leaks away while the drive is at rest.

    hystgen simulate stage_x.yaml drive.csv -o predicted.csv --effects examples/my_effect
    hystgen diagnose stage_x.yaml records.csv -o diagnosis --effects examples/my_effect
    hystgen emit diagnosis/params.yaml -o firmware --effects examples/my_effect
    hystgen verify diagnosis/params.yaml --targets host,cortex-m4f --effects examples/my_effect

In the parameter file it is

    model:
      effects:
        - {name: user:droop, share: 0.05, time_constant: 2.0}

An effect is a class: a name `user:..`, a place in the chain, the method for that place, and a field for each key of the
parameter file. `candidates` tells a fit what to try. This is enough for `simulate` forwards and for `diagnose`. An
inverse and C need a `block`: four functions, here and again in `droop.c`.
"""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from hystgen.effects import About, Candidate, Effect, OwnBlock, Place, Run, decays, follow, product

# The block: y = h - X, where X follows share * h. With h linear between two samples, X_k = X_(k-1) + (early h_(k-1) +
# late h_k - rate X_(k-1)), of which everything but late h_k is known beforehand.
INVERSE_SLOPE, REST, INVERSE_REST, SHARE, RATE, EARLY, LATE = range(7)
LEAKED, BEFORE = range(2)


def rest(t: Any, s: Any, x: Any) -> Any:
    """Settle everything at the input x; return the output."""
    s[LEAKED] = product(t[SHARE], x)
    s[BEFORE] = x
    return product(t[REST], x)


def resting(t: Any, y: Any) -> Any:
    """The input that belongs to the settled output y."""
    return product(t[INVERSE_REST], y)


def solve(t: Any, s: Any, y: Any) -> Any:
    """The input that gives the output y at this sample; moves nothing."""
    leaking = product(t[EARLY], s[BEFORE])
    change = leaking - product(t[RATE], s[LEAKED])
    return product(t[INVERSE_SLOPE], y + (s[LEAKED] + change))


def absorb(t: Any, s: Any, x: Any) -> Any:
    """Take in the input x at this sample; return the output."""
    leaking = product(t[EARLY], s[BEFORE]) + product(t[LATE], x)
    s[LEAKED] = s[LEAKED] + (leaking - product(t[RATE], s[LEAKED]))
    s[BEFORE] = x
    return x - s[LEAKED]


class Droop(Effect):
    """A `share` of the displacement leaks away with a time constant: `y = h - X`, `tau X' = share h - X`."""

    name: Literal["user:droop"] = Field(description="name of the effect")
    share: Annotated[float, Field(ge=0, lt=1)] = Field(description="share of the displacement that finally leaks away")
    time_constant: Annotated[float, Field(gt=0, allow_inf_nan=False)] = Field(description="tau, s")

    place: ClassVar[Place] = Place.LINEAR
    compensation: ClassVar[str] = "solved, since the charge that has leaked is known; nothing remains"
    block: ClassVar[OwnBlock] = OwnBlock(
        "droop.c",
        table=("inverse_slope", "rest", "inverse_rest", "share", "rate", "early", "late"),
        state=("leaked", "before"),
        rest=rest, resting=resting, solve=solve, absorb=absorb,
    )  # fmt: skip

    def numbers(self, seconds: float) -> list[float]:
        """The table of the block for steps of `seconds`, in double precision."""
        _, early, late = (self.share * float(x[0]) for x in decays(np.array([seconds]), self.time_constant))
        rate = -float(np.expm1(-seconds / self.time_constant))  # 1 - E, without losing digits
        settled = 1.0 - self.share
        return [1.0 / (1.0 - late), settled, 1.0 / settled, self.share, rate, early, late]

    def filtered(self, h: np.ndarray, run: Run) -> np.ndarray:
        """The displacement minus the droop, for each row of h separately."""
        y = np.empty_like(h)
        for row, left in zip(np.atleast_2d(h), np.atleast_2d(y), strict=True):
            follow(row, *run.factors(self.time_constant), row[0], left)
        return h - self.share * y

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """The share in hundredths; the time constant from ten samples to the length of a record."""
        low, high = np.log10(10.0 * about.sample_time), np.log10(max(about.duration, 100.0 * about.sample_time))

        def build(x: np.ndarray) -> Droop:
            return cls(name="user:droop", share=0.01 * float(x[0]), time_constant=float(10.0 ** x[1]))

        start = np.array([1.0, 0.5 * (low + high)])
        bounds = np.array([0.0, low]), np.array([50.0, high])
        return [Candidate("user:droop", *bounds, start, build, np.array([0.0, start[1]]), amounts=(0,))]
