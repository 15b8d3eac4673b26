"""The gain from the reference to the drive over all frequencies, and the averages that keep it below a limit.

A lead uses differences, whose gain grows with the frequency. A moving average over w samples lowers the largest gain of
a difference to at most 2/w: `(1 - z)(1 + z + .. + z^(n-1) + e z^n) = 1 - (1 - e) z^n - e z^(n+1)` has no gain above 2,
like `1 - z` itself. Averages are weights of the preview like all others: no state, no recursion, hence no limit cycles,
and centred averages cause no delay. Low-pass poles in front of the lead that meet the same limit cause 5 to 50 times
the error on smooth references with a preview, 1.02 to 1.9 times without (benchmarks/chosen_numbers.py averages).

The averages are placed in front of all leads. Blocks in series are linear about an operating point, so only the product
of their gains matters, and the limit need not be divided among them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.problems import UnsupportedEffectsError
from hystgen.chain.static import StaticModel
from hystgen.compensator.chain import moving
from hystgen.compensator.chain.parts import AHEAD, BEHIND, Parts
from hystgen.compensator.chain.preview import Taps, averages, whole
from hystgen.effects.part import One, Responses
from hystgen.parameters.schema import MOST_REFERENCES

Array = NDArray[np.float64]

FREQUENCIES = np.append(np.geomspace(1e-10, 1e-3, 281)[:-1], np.linspace(1e-3, np.pi, 4096))
"""[rad per sample] Frequencies at which a gain is evaluated first: 8 per lobe of an average over 1000 samples, 40 per
decade below, where creep with time constants of up to 2^28 samples causes a step in the gain."""

PEAK = 0.9
"""[fraction of the largest value] Local maxima above this are refined: between `FREQUENCIES` a lobe can rise unseen by
at most 8 %, `1 - cos(pi/8)`."""

HALVINGS = 60
"""[steps] Length of a search for a frequency or a width, enough to reach the last bits of a double."""

SAME = 1e-9
"""[relative] Excess over a limit that counts as rounding: responses of a thousand weights are off by about 1e-13."""

SERIES = 1.1
"""[ratio] Between successive widths in a search: below 11 samples each step adds less than one sample, while the gain
takes two samples to fall and rise again."""

MOST_TIMES = 4
"""[averages] Maximum number in series. A single one loses least if the gain is to be halved, two if it is to fall to a
twentieth, three if a lag and a mode are led; five are never best. Set by: benchmarks/chosen_numbers.py averages."""


@dataclass(frozen=True)
class Gain:
    """The largest gain (N,) of a model's inverse at frequencies (N,) in rad per sample, relative to the gain at rest.

    It applies to small changes of the reference, with any number of plays following: plays that relax, or whose
    thresholds grow with the rate, follow more slowly than in the static inverse. Blocks behind a lag remember the
    signal that arrived, the one solved for minus its second difference: if F is their response, D the part of F without
    delay, and L the fraction arriving through the lag, the input solved for is `1/(D + (F - D) L)`. `taps`: preview.
    """

    static: StaticModel
    parts: Parts
    seconds: float
    taps: Taps

    @cached_property
    def _blocks(self) -> list[One]:
        """The blocks of the inverse, the user's own last."""
        parts = sorted((part for part in (*AHEAD, *BEHIND) if not part.forward), key=lambda part: part.joined)
        turning = self.parts.turning(self.static.branches_differ)
        return [one for each in self.parts.ones(self.seconds, turning, parts).values() for one in each]

    def __call__(self, at: Array) -> Array:
        led, rest, answers = self._answers(at)
        return np.asarray(np.abs(led) * np.max([np.abs(slope * rest / answer) for slope, answer in answers], axis=0))

    def drive(self, at: Array) -> Array:
        """The gain in drive units per unit of the reference, where plays and front are least steep; saturation, which
        increases it near the ends of its range, is left out."""
        led, _, answers = self._answers(at)
        least = self.static.front_slopes[0]
        if not self._moving_plays:
            least *= self._flattest
        return np.asarray(np.abs(led) * np.max([1.0 / np.abs(answer) for _, answer in answers], axis=0) / least)

    def _answers(self, at: Array) -> tuple[NDArray[np.complex128], float, list[tuple[float, NDArray[np.complex128]]]]:
        """The lead (N,), the gain at rest behind the plays, and for each number of plays that follow, their slope at
        rest and the response (N,) by which the lead is divided."""
        z = np.exp(-1j * at)
        led = np.polynomial.polynomial.polyval(z, self.taps.weights[::-1].astype(complex))
        found = Responses(led, np.ones_like(z), np.ones_like(z), 1.0, 1.0)
        for one in self._blocks:
            found = one.respond(z, found)
        answers = []
        for slope, plays, at_once in self._plays(z):
            later, first = plays * found.passed, at_once * found.direct
            answers.append((slope, first + (later - first) * found.arriving))
        return found.led, found.rest, answers

    def _plays(self, z: NDArray[np.complex128]) -> Iterator[tuple[float, NDArray[np.complex128], float]]:
        """For each number of plays that follow: slope at rest, response, and the part of it without delay."""
        if not self._moving_plays:
            yield 1.0, np.ones_like(z), 1.0
        for mover in moving.movers(self.static, self.parts.plays, self._steepest):
            yield from mover.responses(z, self.seconds)

    @property
    def _moving_plays(self) -> bool:
        """Whether an effect makes plays depend on the rate."""
        return any(effect.moves_plays() for effect in self.parts.plays)

    @cached_property
    def _flattest(self) -> float:
        """Smallest slope of the plays, bent or not."""
        return moving.least_slope(self.static, self.parts.plays)

    @cached_property
    def _steepest(self) -> Array:
        """Weights of the plays where bent ones are steepest."""
        p = np.array(self.static.pi.weights)
        p[1:] *= 1.0 + moving.steepest_bend(self.static, self.parts.plays)
        return p

    @cached_property
    def near(self) -> Array:
        """Frequencies dense enough that no peak of the gain is missed, even if a user's own blocks ring."""
        return np.unique(np.concatenate([FREQUENCIES, *(one.ringing for one in self._blocks)]))


def peaks(gain: Callable[[Array], Array], near: Array) -> tuple[Array, Array]:
    """The local maxima (M,) close to the largest one, and their frequencies; `near` is ascending, with at most one
    maximum in any three adjacent frequencies."""
    found = gain(near)
    before, behind = (np.append(-np.inf, found[:-1]), np.append(found[1:], -np.inf))
    places = np.flatnonzero((found >= before) & (found >= behind) & (found >= PEAK * np.max(found)))
    low, high = near[np.maximum(places - 1, 0)], near[np.minimum(places + 1, len(near) - 1)]
    for _ in range(HALVINGS):
        third = (high - low) / 3.0
        rises = gain(low + third) < gain(high - third)
        low, high = np.where(rises, low + third, low), np.where(rises, high, high - third)
    at = np.append(near[places], 0.5 * (low + high))
    return gain(at), at


def largest(gain: Gain) -> float:
    """The largest gain over all frequencies."""
    return float(np.max(peaks(gain, gain.near)[0]))


def loudest(gain: Gain) -> tuple[float, float]:
    """The largest `Gain.drive` over all frequencies, and the frequency in Hz at which it occurs."""
    found, at = peaks(gain.drive, gain.near)
    k = int(np.argmax(found))
    return float(found[k]), float(at[k]) / (2.0 * np.pi * gain.seconds)


def check(gain: float, limit: float) -> None:
    """Raise UnsupportedEffectsError if even the widest averages leave a noise gain above its limit, rounding aside."""
    if gain > limit * (1.0 + SAME):
        raise UnsupportedEffectsError(
            f"averages over {MOST_REFERENCES} samples of the reference, the most that the C keeps, leave a noise gain "
            f"of {gain:.4g}, more than emit.compensation.noise_gain = {limit:g}; raise the limit"
        )


@dataclass(frozen=True)
class Smoothing:
    """`times` moving averages over `width` samples in series, `centred` or not, as in `preview.averages`.

    `ahead`: samples by which the newest sample of the last average is ahead of the motion. `without`: noise gain
    without the averages.
    """

    times: int
    width: float
    centred: bool
    ahead: int = 0
    without: float = 1.0

    @property
    def row(self) -> Array:
        """Weights of all averages together, from the oldest sample to the newest."""
        return averages(self.times, self.width, self.centred)

    @property
    def age(self) -> float:
        """Mean age of the samples, counted from the newest one."""
        return float(self.row @ np.arange(len(self.row))[::-1])

    @property
    def late(self) -> float:
        """Samples by which the averages delay the motion."""
        return self.age - self.ahead

    @property
    def variance(self) -> float:
        """Variance of the samples' age: a slow sine loses `variance frequency^2/2`, the frequency in rad per sample."""
        return float(self.row @ (np.arange(len(self.row))[::-1] - self.age) ** 2)

    def gain(self, at: Array) -> Array:
        """The gain at frequencies (N,) above 0."""
        n = whole(self.width, self.centred)
        rest = self.width - n
        if self.centred:
            one = np.sin(0.5 * n * at) / np.sin(0.5 * at) + rest * np.cos(0.5 * (n + 1) * at)
        else:
            z = np.exp(-1j * at)
            one = (1.0 - z**n) / (1.0 - z) + rest * z**n
        return np.asarray((np.abs(one) / self.width) ** self.times)

    def loss(self, period: float) -> float:
        """Fraction of its amplitude that a sine loses; `period` in samples."""
        return 1.0 - float(self.gain(np.array([2.0 * np.pi / period]))[0])

    def before(self, row: Taps) -> Taps:
        """The weights of these averages in series with a preview `row`."""
        return Taps(row.first + self.ahead - (len(self.row) - 1), np.convolve(row.weights, self.row))


def smoothing(gain: Gain, limit: float, references: int, asked: int | None) -> Smoothing | None:
    """The averages that meet a noise gain limit, or come closest, with at most `references` weights in the preview.

    None if the gain is already within the limit. The averages are centred if the reference may be read `asked` samples
    ahead (None: as far as needed); else they look back, with the least delay. Their number is chosen to attenuate a
    slow reference least.
    """
    without = largest(gain)
    if without <= limit * (1.0 + SAME):
        return None
    room = references - len(gain.taps.weights)
    ahead = max(gain.taps.ahead, 0)
    found = least(gain, limit, room, centred=True)
    half = (len(found.row) - 1) // 2
    if asked is None or asked >= ahead + half:
        return Smoothing(found.times, found.width, True, half, without)
    found = least(gain, limit, room, centred=False)
    return Smoothing(found.times, found.width, False, min(max(asked - ahead, 0), int(found.age)), without)


def least(gain: Gain, limit: float, room: int, centred: bool) -> Smoothing:
    """The averages of least variance that meet the limit with `room` additional weights; failing that, of least
    gain."""
    holding, failing = [], []
    for times in range(1, MOST_TIMES + 1):
        one, most = narrowest(gain, limit, times, max(room // times - 1.0, 1.0), centred)
        if most <= limit * (1.0 + SAME):
            holding.append((one.variance, one))
        else:
            failing.append((most, one))
    return min(holding or failing, key=lambda each: each[0])[1]


def narrowest(gain: Gain, limit: float, times: int, widest: float, centred: bool) -> tuple[Smoothing, float]:
    """The smallest width at which `times` averages meet the limit, and their gain; `widest` if no width does."""
    near, sizes = gain.near, gain(gain.near)

    def holds(width: float) -> bool:
        return bool(np.max(sizes * Smoothing(times, width, centred).gain(near)) <= limit)

    while True:
        low, high = _bracket(holds, widest)
        for _ in range(HALVINGS if low < high else 0):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if holds(middle) else (middle, high)
        one = Smoothing(times, high, centred)
        found, at = peaks(lambda at, one=one: gain(at) * one.gain(at), gain.near)  # type: ignore[misc]
        most = float(np.max(found))
        fresh = np.setdiff1d(at, near)
        if most <= limit * (1.0 + SAME) or high >= widest or not fresh.size:
            return one, most
        order = np.argsort(np.append(near, fresh))
        near, sizes = np.append(near, fresh)[order], np.append(sizes, gain(fresh))[order]


def _bracket(holds: Callable[[float], bool], widest: float) -> tuple[float, float]:
    """Two successive widths, the first of which misses the limit while the second meets it; `widest` twice if none
    does. The gain does not always fall with the width: half the sample rate decides first, later the lobes."""
    low = high = 1.0
    while not holds(high):
        if high >= widest:
            return high, high
        low, high = high, min(SERIES * high, widest)
    return low, high
