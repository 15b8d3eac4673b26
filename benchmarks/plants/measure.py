"""The converters: white or coloured noise, and the steps of both channels."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

Array = NDArray[np.float64]

COLOURS = ("white", "mixed", "pink")


@dataclass(frozen=True)
class Converters:
    """`noise` rms before conversion [output]; steps and bits of both converters."""

    noise: float
    colour: str
    correlation: float
    """Correlation time of the coloured part in samples."""
    output_step: float
    output_bits: int
    drive_step: float
    drive_bits: int

    def output(self, rng: np.random.Generator, y: Array) -> Array:
        return quantised(y + self.noise * coloured(rng, len(y), self.colour, self.correlation), self.output_step)

    def drive(self, rng: np.random.Generator, v: Array) -> Array:
        return quantised(v + 0.3 * self.drive_step * rng.standard_normal(len(v)), self.drive_step)


def draw(rng: np.random.Generator, noise: float, span_out: float, span: float, colour: str) -> Converters:
    """Converters of 12 to 18 bits whose steps do not exceed the noise."""
    wide_out = span_out * rng.uniform(1.25, 2.0)
    bits = [b for b in (12, 14, 16, 18) if wide_out / 2**b <= 0.9 * noise]
    output_bits = bits[int(rng.integers(min(len(bits), 2)))]
    wide = 1.2 * span
    # converted to output units by the loop's slope, the drive step stays well below the noise
    drive_bits = next(b for b in (12, 14, 16, 18, 20) if 0.4 * wide / 2**b * span_out / span <= 0.12 * noise)
    return Converters(
        noise,
        colour,
        float(np.exp(rng.uniform(math.log(3.0), math.log(25.0)))),
        wide_out / 2**output_bits,
        output_bits,
        wide / 2**drive_bits,
        drive_bits,
    )


def coloured(rng: np.random.Generator, number: int, colour: str, correlation: float) -> Array:
    """Noise of rms 1: white, half white and half with an exponential correlation, or about 1/f over two decades."""
    white = rng.standard_normal(number)
    if colour == "white":
        return white
    if colour == "mixed":
        return np.asarray(math.sqrt(0.5) * (white + _correlated(rng, number, correlation)))
    parts = [_correlated(rng, number, time) for time in (1.0, 5.0, 25.0)]
    return np.asarray(0.5 * (white + parts[0] + parts[1] + parts[2]))


def quantised(x: Array, step: float) -> Array:
    return np.asarray(np.round(x / step) * step)


def _correlated(rng: np.random.Generator, number: int, time: float) -> Array:
    pole = math.exp(-1.0 / time)
    lead = int(10 * time)
    x = rng.standard_normal(number + lead)
    return np.asarray(lfilter([math.sqrt(1.0 - pole * pole)], [1.0, -pole], x)[lead:])
