"""The preview: a weighted sum of the reference's samples around the present one.

A delay is compensated by linear interpolation between two samples; a mode by three samples, or by a shaper or a notch
for steps from point to point. In series they are one row of weights, which sum to 1; without recursion they are always
stable.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.jit import Answer, Scalar, jit
from hystgen.basics.problems import FormatError
from hystgen.parameters.schema import MOST_REFERENCES
from hystgen.plays.slots import Counts, Reals


class Mode(Protocol):
    """An effect with a pair of poles; the `emit.compensation` key of its name sets how it is compensated."""

    @property
    def name(self) -> str: ...
    @property
    def frequency(self) -> float: ...
    @property
    def damping(self) -> float: ...
    def rings(self, by: By, /) -> bool: ...
    def denominator(self, step: float, /) -> tuple[float, float]:
        """`a1`, `a2` of its poles at steps of this length, `z^2 + a1 z + a2`."""


class Taps(NamedTuple):
    """Weights of the reference from sample `first` to `first + len(weights) - 1`, counted from the present one."""

    first: int
    weights: NDArray[np.float64]

    @property
    def ahead(self) -> int:
        """Samples by which the last weight is ahead."""
        return self.first + len(self.weights) - 1


PLAIN = Taps(0, np.ones(1))
"""The reference unchanged."""


By = Literal["inverse", "shaper", "notch"]
"""How a mode is compensated."""


def taps(
    delay: float, modes: Sequence[Mode], seconds: float, number: int = 3, corner: int = 0, by: By = "inverse"
) -> Taps:
    """The weights for a delay in s and modes in series at samples `seconds` apart; without either, the plain reference.

    A mode takes `number` references: with 3 the motion is `(x_(k+1) + 4 x_k + x_(k-1))/6`; 5 references cancel that
    smoothing up to a fourth difference. `corner`: three centred moving averages over this many samples smooth the
    reference. `by`: how a mode that would ring after a step is kept from ringing.

    Raises FormatError if keeping modes from ringing takes more references than the C keeps.
    """
    samples = delay / seconds
    whole = math.floor(samples)
    share = samples - whole
    weights = np.array([1.0 - share, share] if share > 0.0 else [1.0])
    first = whole
    for mode in modes:
        if mode.rings(by):
            row = shaper(mode, seconds) if by == "shaper" else notch(mode, seconds)
            weights = np.convolve(weights, row)
            first -= len(row) - 1
            if len(weights) > MOST_REFERENCES:
                raise _too_long(mode, f"the modes take {len(weights)} samples in series")
            continue
        a1, a2 = mode.denominator(seconds)
        weights = np.convolve(weights, np.array([a2, a1, 1.0]) / (1.0 + a1 + a2))
        first -= 1
        if number == 5:
            weights = np.convolve(weights, np.array([-1.0, 8.0, -1.0]) / 6.0)
            first -= 1
    if corner > 1:
        mean = np.full(corner, 1.0 / corner)
        weights = np.convolve(weights, np.convolve(np.convolve(mean, mean), mean))
        first -= 3 * (corner - 1) // 2
        if corner % 2 == 0:  # an even number of samples has no middle one
            weights = np.convolve(weights, np.array([0.5, 0.5]))
            first -= 1
    return Taps(first, weights)


def shaper(mode: Mode, seconds: float) -> NDArray[np.float64]:
    """The weights (n + 2,) of the reference now and about half a period ago, after which a mode does not ring.

    They apply to the present sample and those n and n + 1 samples ago, between which half a period lies. They sum to 1
    and vanish at the mode's poles p, so that no vibration remains after a step: `sum w_k p^-k = 0`, the sampled form of
    a zero-vibration shaper.
    """
    a1, a2 = mode.denominator(seconds)
    pole = complex(-0.5 * a1, math.sqrt(a2 - 0.25 * a1 * a1))
    half = math.pi / math.atan2(pole.imag, pole.real)
    n = max(math.ceil(half) - 1, 1)
    if n >= MOST_REFERENCES:
        raise _too_long(mode, f"half a period of {mode.frequency:g} Hz is {half:.0f} samples")
    early, late = pole**-n, pole ** -(n + 1)
    rows = [[1.0, 1.0, 1.0], [1.0, early.real, late.real], [0.0, early.imag, late.imag]]
    now, soon, last = np.linalg.solve(rows, [1.0, 0.0, 0.0])
    weights = np.zeros(n + 2)
    weights[[0, 1, -1]] = last, soon, now
    return weights


def notch(mode: Mode, seconds: float) -> NDArray[np.float64]:
    """The weights of the present and earlier references with which a mode does not ring: its poles as zeros,
    `A(z)/A(1)`, behind two averages over `coth(w0 T/2)` samples.

    Two poles at `p = exp(-w0 T)` instead of the averages would have the same mean delay, `2 p/(1 - p)`, to within a
    sample, and the same bound on the gain of two differences, `((1 - p)/(1 + p))^2`; but they settle slowly, to 0.1 %
    of a step in 9.2 times `1/w0`, while the averages end after 4, and they keep a state that rounding may stall.
    """
    a1, a2 = mode.denominator(seconds)
    width = 1.0 / math.tanh(math.pi * mode.frequency * seconds)
    if 2.0 * width + 2.0 > MOST_REFERENCES:
        raise _too_long(mode, f"a notch for {mode.frequency:g} Hz takes {2.0 * width + 2.0:.0f} samples")
    return np.convolve(np.array([a2, a1, 1.0]) / (1.0 + a1 + a2), averages(2, width, centred=False))


def _too_long(mode: Mode, what: str) -> FormatError:
    message = f"{what}, and the C keeps {MOST_REFERENCES} at most; sample more slowly, or choose inverse"
    return FormatError((("emit", "compensation", mode.name), message))


def averages(times: int, width: float, centred: bool) -> NDArray[np.float64]:
    """The weights of `times` moving averages over `width` samples in series, from the oldest sample to the newest.

    `centred`: symmetric about a sample; else the newest samples have full weight.
    """
    n = whole(width, centred)
    rest = width - n
    ends = ([0.5 * rest] if centred else [rest]) if rest > 0.0 else []
    one = np.array([*ends, *[1.0] * n, *(ends if centred else [])]) / width
    row = np.ones(1)
    for _ in range(times):
        row = np.convolve(row, one)
    return row


def whole(width: float, centred: bool) -> int:
    """Number of samples of an average that have full weight."""
    return 2 * int((width - 1.0) // 2.0) + 1 if centred else int(width)


class Shaped(NamedTuple):
    """The modes that a shaper or a notch keeps from ringing at steps `seconds` apart, and their weights."""

    by: By
    modes: tuple[Mode, ...]
    seconds: float
    taps: Taps

    @property
    def late(self) -> float:
        """Samples by which the motion is late on a ramp: the weights' mean age, and `2 zeta/w0` of each mode."""
        ages = -(self.taps.first + np.arange(len(self.taps.weights)))
        own = math.fsum(each.damping / (math.pi * each.frequency) for each in self.modes)
        return float(ages @ self.taps.weights) + own / self.seconds

    def missed(self, period: float) -> float:
        """Tracking error of a sine as a fraction of its amplitude; `period` in samples."""
        turn = 2j * math.pi / period
        ages = -(self.taps.first + np.arange(len(self.taps.weights)))
        found = complex(np.exp(-turn * ages) @ self.taps.weights)
        for each in self.modes:
            s = turn / (2.0 * math.pi * each.frequency * self.seconds)
            found /= s * s + 2.0 * each.damping * s + 1.0
        return abs(1.0 - found)


def shaped(modes: Sequence[Mode], seconds: float, by: By) -> Shaped | None:
    """The modes that `by` keeps from ringing; None if there are none."""
    found = tuple(mode for mode in modes if mode.rings(by))
    return Shaped(by, found, seconds, taps(0.0, found, seconds, by=by)) if found else None


def led(needed: Taps, samples: int | None) -> Taps:
    """The weights for a reference `samples` ahead, if that is more than needed."""
    more = (samples or 0) - max(needed.ahead, 0)
    return needed if more <= 0 else Taps(needed.first, np.append(needed.weights, np.zeros(more)))


# ---------------------------------------------------------------- preview.c


class PreviewLine(NamedTuple):
    """The last samples of the reference (L,), newest last, and whether the line has been filled (1,)."""

    sample: Reals
    filled: Counts


@jit
def preview_put(line: PreviewLine, x: Scalar) -> None:
    """Append a sample; the first one fills the line."""
    n = len(line.sample)
    for i in range(n - 1):
        line.sample[i] = line.sample[i + 1] if line.filled[0] else x
    line.sample[n - 1] = x
    line.filled[0] = 1


@jit
def preview_repeat(line: PreviewLine) -> None:
    """Append the newest sample again, if there is one."""
    if line.filled[0]:
        preview_put(line, line.sample[len(line.sample) - 1])


def targeting(product: Answer) -> Answer:
    """The function that returns the output to reach at this sample, the weighted sum of the line; `product`: of a
    number and a factor from an array."""

    @jit
    def preview_target(tap: Reals, line: PreviewLine) -> Scalar:
        total: Scalar = product(line.sample[0], tap, 0)
        for i in range(1, len(tap)):
            total = total + product(line.sample[i], tap, i)
        return total

    return preview_target
