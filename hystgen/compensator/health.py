"""A watch over the model's error on the target: bands of a healthy unit with the probability that it leaves them, and
the bit-exact reference of `c_runtime/compensator/health.c`."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, TypeAlias

import mpmath
import numpy as np
from numpy.typing import NDArray

from hystgen.arithmetic import Arithmetic
from hystgen.basics.problems import FormatError

if TYPE_CHECKING:
    from hystgen.parameters.schema import Parameters

Values: TypeAlias = NDArray[np.number]

MODEL_LEFT = 64
"""The status bit MODEL_LEFT."""

KEY = ("emit", "health")

ENOUGH = 100.0
"""[independent samples] A window of automatic length contains about this many of the residual's: its rms is then known
to 1/sqrt(2*100) = 7 %, so a rise by half is far outside the band. Longer windows would only answer later."""

LEAST, MOST = 2**6, 2**16
"""[samples] Shortest and longest window. In float32, sums over the longest are exact to 2^16 * 2^-24 = 0.4 %."""

DIGITS = 6
"""Significant digits of bands, far more than a residual determines."""


@dataclass(frozen=True)
class Band:
    """Windows of `window` samples; bands for the magnitude of the mean error and for its rms, in output units.

    `false_alarms`: probability that a window of a healthy unit leaves them, None for a band given in the file;
    `independent`: number of independent samples of the error in a window.
    """

    window: int
    mean: float
    rms: float
    false_alarms: float | None
    independent: float

    @classmethod
    def of(cls, parameters: Parameters, changed: bool = False) -> Band:
        """The band for a parameter file; `changed`: the C leaves out effects. Raises FormatError.

        The residual of identification is a sample of `residual.samples` independent normal values, and a window of a
        healthy unit another one, of n = window * sample_time / residual.correlation values (at least 1). The ratio of
        their mean squares then follows the F distribution with (n, samples) degrees of freedom. The zero of a sensor
        is not part of identification, where every record has its own: it is the mean of an earlier window. The square
        of the difference of both means, divided by (2/n + 1/samples) times the residual's mean square, follows the F
        distribution with (1, samples). Each of the two bands is left with half of the probability.
        """
        health, found, seconds = parameters.emit.health, parameters.residual, parameters.sample_time
        if health.band is not None:
            window = health.window or 4096
            return cls(window, health.band, health.band, None, float(window))
        if found is None or changed:
            why = "the C leaves out effects, so the residual of identification is not its error" if changed else (
                "the file has no `residual`, which identify and diagnose write for records with times"
            )
            own = "`emit: {health: {window: 4096, band: 0.05}}`"
            raise FormatError((KEY, f"no band for --health: {why}; identify again, or give a band, as in {own}"))
        if seconds is None:
            raise FormatError((("sample_time",), (
                "is missing, and --health needs it to know how many samples of a window are independent; add "
                "`sample_time: SECONDS`, the time between two samples"
            )))
        each = found.correlation / seconds
        window = health.window or min(max(LEAST, 1 << math.ceil(math.log2(ENOUGH * each))), MOST)
        independent = max(1.0, window / max(each, 1.0))
        half = health.false_alarms / 2.0
        mean = math.sqrt((2.0 / independent + 1.0 / found.samples) * f_tail(1.0, found.samples, half))
        rms = math.sqrt(f_tail(independent, found.samples, half))
        mean, rms = (float(f"{found.rms * times:.{DIGITS}g}") for times in (mean, rms))
        return cls(window, mean, rms, health.false_alarms, independent)


def f_tail(n: float, m: float, p: float) -> float:
    """The value that a variable of the F distribution with (n, m) degrees of freedom exceeds with probability p.

    P(F > x) = I_z(m/2, n/2) with z = m/(m + n x), the regularised incomplete beta function (Abramowitz and Stegun
    26.6.2).
    """
    low, high = -60.0, 0.0  # of log10(z)
    for _ in range(60):
        middle = (low + high) / 2.0
        if mpmath.betainc(m / 2.0, n / 2.0, 0, mpmath.mpf(10) ** middle, regularized=True) < p:
            low = middle
        else:
            high = middle
    z = 10.0**low
    return float(m * (1.0 - z) / (n * z))


class Watch(ABC):
    """The watch in an arithmetic. `macros`: names, without the model's prefix, and values of the constants in the C;
    `lsb`: names and values of output units per unit of the mean, and their square per unit of the mean square, where
    these are counted; `types`: of the mean and of the mean square in C; `unequal`: how C compares two of them; `skips`:
    whether a sample may be no number."""

    band: Band
    lsb: tuple[tuple[str, float], ...] = ()
    types: ClassVar[tuple[str, str]]
    unequal: ClassVar[str]
    skips: ClassVar[bool]
    macros: tuple[tuple[str, int | np.floating], ...]

    def update(self, expected: Values, measured: Values) -> tuple[NDArray[np.uint32], Values, Values]:
        """Status, mean and mean square (N,) after each of the samples (N,), from init."""
        known, error = self._errors(expected, measured)
        count = len(error) // self.band.window
        mean, square = self._windows(error[: count * self.band.window].reshape(count, self.band.window))
        status = np.where(self._inside(mean, square), 0, MODEL_LEFT).astype(np.uint32)
        whole = np.cumsum(known) // self.band.window
        mean, square, status = (np.concatenate([[each.dtype.type(0)], each]) for each in (mean, square, status))
        return status[whole], mean[whole], square[whole]

    @abstractmethod
    def _errors(self, expected: Values, measured: Values) -> tuple[NDArray[np.bool_], Values]:
        """The samples that count (N,), and their errors."""

    @abstractmethod
    def _windows(self, error: Values) -> tuple[Values, Values]:
        """Mean and mean square (windows,) of errors (windows, samples)."""

    @abstractmethod
    def _inside(self, mean: Values, square: Values) -> NDArray[np.bool_]:
        """Whether windows are inside the band."""


class FloatWatch(Watch):
    """In floating point. Raises FormatError if the squares underflow."""

    types = ("hystgen_real_t", "hystgen_real_t")
    unequal = "!hystgen_selftest_same({}, {})"
    skips = True

    def __init__(self, band: Band, arithmetic: Arithmetic) -> None:
        self.band, self._real = band, arithmetic.real
        unit = float(np.finfo(self._real).eps) / 2.0
        rounded = band.window * unit  # relative error of a sum, at most
        self._share = self._real(1.0 / band.window)
        self._mean = self._real((band.mean + rounded * band.rms) ** 2)
        self._square = self._real((1.0 + rounded) * band.rms**2)
        least = float(np.finfo(self._real).tiny)
        if not least < min(float(self._mean), float(self._square)) * unit**2:
            raise FormatError((KEY, f"an error of {band.mean:.3g} squared is too small for {arithmetic.name}; give the "
                               "displacement in smaller units"))
        self.macros = (
            ("HEALTH_SHARE", self._share), ("HEALTH_MEAN_MOST", self._mean), ("HEALTH_SQUARE_MOST", self._square),
        )

    def _errors(self, expected: Values, measured: Values) -> tuple[NDArray[np.bool_], Values]:
        with np.errstate(over="ignore", invalid="ignore"):
            error = np.asarray(measured, self._real) - np.asarray(expected, self._real)
        known = np.isfinite(error)
        return known, error[known]

    def _windows(self, error: Values) -> tuple[Values, Values]:
        begun = np.zeros((len(error), 1), self._real)
        with np.errstate(over="ignore"):
            sums = [
                np.add.accumulate(np.hstack([begun, each]), axis=1, dtype=self._real)[:, -1] * self._share
                for each in (error, error * error)
            ]
        return sums[0], sums[1]

    def _inside(self, mean: Values, square: Values) -> NDArray[np.bool_]:
        with np.errstate(over="ignore"):
            return np.asarray((mean * mean <= self._mean) & (square <= self._square))


class FixedWatch(Watch):
    """In fixed point; `lsb`: output units per code of `bits` bits without its sign.

    Differences of codes keep 32 bits: with 32-bit codes, half of each is subtracted. Squares lose as many low bits as
    their sum over a window has more than 62. Expected and measured displacement are each rounded to a code, so the
    bands are one code wider. The one for the mean is rounded up to 8 bits, at most 0.8 % more, which ARM cores take
    without loading a constant.
    """

    types = ("int32_t", "int64_t")
    unequal = "{} != {}"
    skips = False

    def __init__(self, band: Band, lsb: float, bits: int) -> None:
        self.band = band
        self._halved = int(bits > 30)
        self._bits = band.window.bit_length() - 1
        self._shift = max(0, -(-(2 * (bits + 1 - self._halved) + self._bits - 62) // 2))
        mean_lsb = lsb * 2**self._halved
        square_lsb = (mean_lsb * 2**self._shift) ** 2 / band.window
        self.lsb = ("MEAN", mean_lsb), ("SQUARE", square_lsb)
        mean = math.ceil((band.mean + lsb) / mean_lsb)
        low = max(mean.bit_length() - 8, 0)
        self._mean = -(-mean >> low) << low
        self._square = math.ceil((band.rms + lsb) ** 2 / square_lsb)
        if self._mean >= 2**31 or self._square >= 2**62:
            raise FormatError((KEY, f"a band of {band.rms:.3g} is wider than the range of displacements; give less"))
        self.macros = (
            ("HEALTH_BITS", self._bits), ("HEALTH_HALVED", self._halved), ("HEALTH_SHIFT", self._shift),
            ("HEALTH_MEAN_MOST", self._mean), ("HEALTH_SQUARE_MOST", self._square),
        )

    def _errors(self, expected: Values, measured: Values) -> tuple[NDArray[np.bool_], Values]:
        error = (np.asarray(measured, np.int64) >> self._halved) - (np.asarray(expected, np.int64) >> self._halved)
        return np.ones(len(error), dtype=bool), error

    def _windows(self, error: Values) -> tuple[Values, Values]:
        part = error.astype(np.int64) >> self._shift
        return error.astype(np.int64).sum(axis=1) >> self._bits, (part * part).sum(axis=1)

    def _inside(self, mean: Values, square: Values) -> NDArray[np.bool_]:
        return np.asarray((np.abs(mean) <= self._mean) & (square <= self._square))
