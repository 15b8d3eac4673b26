"""A delay in the forward operator: drives wait in a ring buffer, and are linear between samples.

The inverse accounts for it in its preview (`hystgen.compensator.chain.preview`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import DTypeLike, NDArray

from hystgen.arithmetic.factors import factor, multiplied, paired
from hystgen.basics.jit import Answer, Scalar, jit
from hystgen.effects.base import Place
from hystgen.effects.part import ChainPart, One, Realized, Setting, Surroundings, Verbs, called
from hystgen.plays.slots import Counts, Reals

MOST_SAMPLES = 2**15
"""[samples] Longest delay: it fits a 16-bit counter, and takes more memory than small cores have."""


class DelayTables(NamedTuple):
    """`share` (1,), in fixed point (1, 2): elapsed fraction of the step after the oldest sample; `samples`: how many
    wait, 0 without a delay."""

    share: Reals
    samples: int


class Waiting(NamedTuple):
    """The samples that wait (n,), and the index of the oldest (1,)."""

    sample: Reals
    oldest: Counts


@dataclass(frozen=True)
class Wait(One):
    """A delay, in s."""

    time: float

    def rounding(self, size: float, u: float) -> tuple[float, float]:
        """Rounding errors of the delayed drive."""
        return 4.0 * u * size, 0.0


def numbers(seconds: float, step: float) -> tuple[float, int]:
    """`share` and `samples` of `DelayTables` for a delay at steps of `step`."""
    late = seconds / step
    whole = math.ceil(late)
    return whole - late, whole + 1 if late > 0.0 else 0


# ---------------------------------------------------------------- delay.c


@jit
def delay_rest(line: Waiting, v: Scalar) -> None:
    """Set the whole past of the drive to v."""
    for i in range(len(line.sample)):
        line.sample[i] = v
    line.oldest[0] = 0


@jit
def delay_next(line: Waiting) -> int:
    """The index after that of the oldest sample."""
    following = line.oldest[0] + 1
    return following if following < len(line.sample) else 0


@jit
def delay_put(line: Waiting, v: Scalar) -> None:
    """Put the drive v of this sample into the line."""
    line.sample[line.oldest[0]] = v
    line.oldest[0] = delay_next(line)


def memory(t: DelayTables, dtype: DTypeLike) -> Waiting:
    """Memory of the delay of a model."""
    return Waiting(np.zeros(t.samples, dtype), np.zeros(1, np.int64))


def verbs(product: Answer) -> Verbs:
    """The verbs of a delay in an arithmetic, from its product of a number and a factor of an array."""

    @jit
    def delayed(t: DelayTables, line: Waiting) -> Scalar:
        """The drive that leaves the delay now, in fixed point to the nearest code."""
        oldest = line.sample[line.oldest[0]]
        return oldest + product(line.sample[delay_next(line)] - oldest, t.share, 0)

    @jit
    def rest(t: DelayTables, line: Waiting, j: int, v: Scalar) -> Scalar:  # noqa: ARG001  block interface
        """Set the whole past of the drive to v. Returns the delayed drive."""
        delay_rest(line, v)
        return delayed(t, line)

    @jit
    def absorb(t: DelayTables, line: Waiting, j: int, v: Scalar) -> Scalar:  # noqa: ARG001  block interface
        """Absorb the drive v of this sample. Returns the delayed drive."""
        delay_put(line, v)
        return delayed(t, line)

    return Verbs(memory, rest, absorb)


def tables(waits: Sequence[Wait], about: Surroundings, share: Callable[[float], NDArray[Any]]) -> DelayTables:
    """The tables of a model's delays, combined into one delay; `share`: converts a fraction to the arithmetic."""
    waited, waiting = numbers(math.fsum(one.time for one in waits), about.seconds)
    return DelayTables(share(waited) if waiting else share(0.0)[:0], waiting)


ARITHMETIC = Realized(
    verbs(multiplied), lambda _: (),
    lambda blocks, about: tables(blocks, about, lambda share: about.reals([share], "the delay")),
)
FIXED_ARITHMETIC = Realized(
    verbs(paired), lambda _: (),
    lambda blocks, about: tables(blocks, about, lambda share: np.array([factor(share)], dtype=np.int64)),
)


def problems(_: object, at: Setting) -> Iterator[str]:
    """Why the forward operator cannot keep the drives that wait."""
    delay = math.fsum(each.dead_time for each in at.listed)
    if at.operator != "inverse" and delay > MOST_SAMPLES * at.seconds:
        yield (
            f"{delay / at.seconds:.6g} samples, and the forward operator keeps {MOST_SAMPLES} at most; "
            "emit the inverse alone"
        )


PART = ChainPart(
    "wait", "a delay", Place.DRIVE, called("delay", lambda effect: effect.time > 0.0),
    lambda effect, *_: Wait(effect.time), ARITHMETIC, lambda: FIXED_ARITHMETIC, forward=True, joined=True,
    problems=problems, code=("delay",),
)
"""A delay as a part of the chain: the drive as the amplifier of the forward operator receives it."""

PARTS = (PART,)
