"""The digital-to-analogue converter that outputs the drives: bits, range and coding."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Codes = NDArray[np.int64]

CODINGS = ("straight", "twos-complement")
"""How codes are written: straight (offset) binary from 0 up, or two's complement with 0 in the middle of the range."""

FEWEST_BITS, MOST_BITS = 8, 32
"""Smallest and largest number of converter bits: with fewer, one code exceeds the margin between drives and the ends of
the range; with more, codes do not fit the types of the C header."""

FEWEST_CODES = 100
"""Minimum number of codes between the lowest and the highest drive: with fewer, one code exceeds the margin between
drives and the ends of the range."""


@dataclass(frozen=True)
class Dac:
    """A converter as seen by the drive, including the amplifier.

    `low`: drive at the lowest code; `high`: drive one code above the highest, that is, the data sheet's reference
    voltage times the gain: `drive = low + k (high - low)/2^bits`, k = 0 .. 2^bits - 1. `coding`: one of `CODINGS`; k is
    written as k, or as k - 2^(bits-1).
    """

    bits: int
    low: float
    high: float
    coding: str = CODINGS[0]

    @property
    def lsb(self) -> float:
        """Change in the drive per code."""
        return (self.high - self.low) / 2.0**self.bits

    @property
    def zero(self) -> int:
        """The k that is written as 0."""
        return 2 ** (self.bits - 1) if self.coding == CODINGS[1] else 0

    @property
    def bytes(self) -> int:
        """Bytes per code in memory."""
        return 1 if self.bits <= 8 else 2 if self.bits <= 16 else 4

    def codes(self, drives: ArrayLike) -> Codes:
        """The codes (N,) nearest to drives (N,)."""
        k = np.floor((np.asarray(drives, dtype=np.float64) - self.low) / self.lsb + 0.5)
        return k.astype(np.int64) - self.zero

    def drives(self, codes: ArrayLike) -> NDArray[np.float64]:
        """The drives (N,) produced by codes (N,)."""
        return self.low + (np.asarray(codes) + self.zero) * self.lsb

    def problems(self, low: float, high: float) -> Iterator[str]:
        """All problems that this converter has with drives from `low` to `high`."""
        own = [*wrong_bits(self.bits), *wrong_range(self.low, self.high)]
        yield from own
        if own:
            return
        top = self.high - self.lsb
        if low < self.low or high > top:
            yield (
                f"the DAC gives {self.low:g} to {top:g}, but the drives need {low:g} to {high:g}; give the range behind"
                " the amplifier, or narrow input_range"
            )
        elif (high - low) / self.lsb < FEWEST_CODES:
            yield (
                f"one code of the DAC is {self.lsb:.3g}, and the drives span {high - low:.3g}: fewer than "
                f"{FEWEST_CODES} codes; narrow the range of the DAC, or give it more bits"
            )

    def sentence(self, unit: str, span: float) -> str:
        """A sentence about its resolution for drives over `span`; `unit`: the drive's unit after a space, or empty."""
        how = "straight binary" if self.coding == CODINGS[0] else "two's complement"
        return (
            f"Drives are codes of a {self.bits}-bit DAC over {self.low:g} to {self.high:g}{unit}, {how}: one code is "
            f"{self.lsb:.4g}{unit}, {100.0 * self.lsb / span:.2g} % of the drives' span, and drives lie at most one "
            "code from the straight lines between turning points."
        )


def wrong_bits(bits: int) -> Iterator[str]:
    """Problems with the number of bits of a converter."""
    if not FEWEST_BITS <= bits <= MOST_BITS:
        yield f"the DAC has {bits} bits; give {FEWEST_BITS} to {MOST_BITS}"


def wrong_range(low: float, high: float) -> Iterator[str]:
    """Problems with the range of a converter."""
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        yield f"the DAC range {low:g} to {high:g} is not increasing; give its lower end first"


def filled(codes: ArrayLike, every: int) -> Codes:
    """Codes (N,) at every tick, from codes given at every `every`-th tick: the integers nearest to the straight lines
    between the given codes."""
    nodes = np.asarray(codes, dtype=np.int64)
    steps = np.diff(nodes)[:, None] * (2 * np.arange(every)) + every
    return np.append((nodes[:-1, None] + steps // (2 * every)).ravel(), nodes[-1])
