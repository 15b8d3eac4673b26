"""A plan's drives and times, as integer multiples of decimal steps."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal

from hystgen.basics.problems import PlanError

MARGIN = 0.01
"""[fraction of the input range] Margin at either end of the range that no record enters."""

OF_RATE = 0.98
"""[fraction of the rate limit] Fastest rate in a plan, low enough to stay below the limit despite rounding."""

FULL_SCALE = 8
"""[sample times] Duration of a move over the whole range if no rate limit is given."""

LONGEST_EDGE = 32
"""[samples] Longest full-scale move at the rate limit; a longer move is sampled less often."""

MOVE = 12
"""[samples] Shortest full-scale move of a triangle."""

SLOW = 24.0
"""[s] Shortest duration of a slow record."""

SLOWER = 1.5
"""[times] A slow record takes at least this many times as long as a fast record."""

FAST_SAMPLES = 1000
"""[samples] Approximate length of a fast record."""

REST = 0.125
"""[durations of a slow record] Pause between records."""

LONGEST_MOVE = 60.0
"""[s] Longest move over the range; a plan with slower moves would take a day and is refused."""

SLOW_SAMPLES = 480
"""[samples] Length of a slow record."""


@dataclass(frozen=True)
class Grid:
    """Drive values as multiples of 10^-digits, from the lowest to the highest that a record visits."""

    digits: int
    low: int
    high: int

    @classmethod
    def over(cls, low: float, high: float) -> Grid:
        """A grid of a millionth of the range or finer. Raises PlanError if double precision is too coarse for it."""
        a, b = Decimal(low), Decimal(high)
        digits = 6 - (b - a).adjusted()
        if max(abs(low), abs(high)) > 1e8 * (high - low):
            raise PlanError([f"input_range [{low!r}, {high!r}] is too narrow for numbers of its magnitude"])
        margin = Decimal(str(MARGIN)) * (b - a)
        first, last = (x.scaleb(digits) for x in (a + margin, b - margin))
        return cls(digits, math.ceil(first), math.floor(last))

    def values(self, codes: Sequence[int]) -> list[float]:
        """The drives for codes, which are the doubles nearest to the decimal values."""
        unit = 10 ** abs(self.digits)
        return [code / unit if self.digits >= 0 else float(code * unit) for code in codes]

    def rate(self, per_second: float, seconds: float) -> int:
        """The largest number of codes by which the drive moves in `seconds`."""
        return math.floor(Decimal(OF_RATE * per_second) * Decimal(seconds) * Decimal(1).scaleb(self.digits))


@dataclass(frozen=True)
class Tempo:
    """Times as multiples of the sample time: the sample spacing in `fast` records, the duration of `slow` records, and
    the `rest` between records.

    `move`: samples of a full-scale move of the fast triangles.
    """

    sample_time: float
    max_rate: float
    fast: int
    slow: int
    rest: int
    move: int

    @classmethod
    def of(cls, grid: Grid, max_rate: float, sample_time: float) -> Tempo:
        """The tempo that sampling and rate limit allow. Raises PlanError if a drive would take days."""
        span = grid.high - grid.low
        across = float(span) * 10.0**-grid.digits / (OF_RATE * max_rate * sample_time)
        seconds = max(across, FULL_SCALE) * sample_time
        if not seconds <= LONGEST_MOVE:
            what = f"one move over the input range takes {seconds:.3g} s, and a plan has hundreds of moves"
            raise PlanError([f"{what}; give a larger max rate or a shorter sample time"])
        fast = max(1, math.ceil(across / LONGEST_EDGE))
        slow = max(math.ceil(SLOW / sample_time), math.ceil(SLOWER * FAST_SAMPLES * fast))
        move = max(MOVE, math.ceil(across / fast))
        return cls(sample_time, max_rate, fast, slow, math.ceil(REST * slow), move)

    def seconds(self, ticks: int) -> float:
        """The double nearest to the decimal value of `ticks` sample times."""
        return float(ticks * Decimal(repr(self.sample_time)))

    def every_of(self, share: float, samples: int) -> int:
        """Spacing, in sample times, of the `samples` of a record that lasts a fraction `share` of a slow record."""
        return max(self.fast, round(share * self.slow / samples))

    @property
    def middle(self) -> int:
        """Sample spacing, in sample times, halfway between fast and slow records on a logarithmic scale."""
        return max(self.fast, math.isqrt(self.fast * self.every_of(1.0, SLOW_SAMPLES)))
