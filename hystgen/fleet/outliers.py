"""Units that differ from the rest of their fleet.

Modified z-scores: `0.6745 (x - median) / MAD`, with MAD the median absolute deviation from the median; 0.6745 makes
them comparable with z-scores of a normal distribution, and a value beyond 3.5 counts as an outlier (B. Iglewicz and
D. C. Hoaglin, How to Detect and Handle Outliers, 1993).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

BEYOND = 3.5
"""Modified z-score beyond which a unit is an outlier."""

FEWEST = 8
"""[units] With fewer units, a median absolute deviation means little, and no unit is marked."""

SAME = 1e-6
"""Relative spread below which units count as equal; rounding of written digits and different solvers cause less."""

MATTERS, MATTERS_ERROR = 0.05, 0.2
"""[fraction of the median] An outlier differs from the median by at least the first fraction, and an outlying error
exceeds it by at least the second: in a tight fleet, units score high for differences that nobody would act on."""

LEAST_ERROR = 1e-6
"""Held-out errors below this, in %, come from rounding of the written digits."""


@dataclass(frozen=True)
class Judged:
    """A figure by which to compare units, with its name in words and its column. For an `error`, logarithms are
    compared, and only high values count."""

    words: str
    column: str
    error: bool = False

    def value(self, figures: Mapping[str, object]) -> float | None:
        """The number to compare; None if a unit has no such figure."""
        number = figures.get(self.column)
        if not isinstance(number, float) or not math.isfinite(number):
            return None
        return math.log(max(number, LEAST_ERROR)) if self.error else number


JUDGED = (
    Judged("held-out rms %", "held_out_rms_percent", error=True),
    Judged("gain", "gain"),
    Judged("width", "width"),
    Judged("p_0", "p_0"),
)


def spread(values: Sequence[float]) -> tuple[float, float]:
    """Median, and the difference from it that scores 1; the latter is 0 if all values are equal.

    If more than half of the values are equal, MAD is 0 and the mean absolute deviation takes its place with its own
    factor sqrt(2/pi).
    """
    x = np.asarray(values, dtype=np.float64)
    middle = float(np.median(x))
    away = np.abs(x - middle)
    alike = SAME * max(abs(middle), float(np.finfo(np.float64).tiny))
    for found, factor in ((float(np.median(away)), 0.6745), (float(np.mean(away)), math.sqrt(2.0 / math.pi))):
        if found > alike:
            return middle, found / factor
    return middle, 0.0


def modified_scores(values: Sequence[float]) -> list[float]:
    """Modified z-score of every value, in the order given; 0 if all values are equal."""
    middle, one = spread(values)
    return [(x - middle) / one if one else 0.0 for x in values]


def margin(judged: Judged, values: Sequence[float]) -> float:
    """Distance from the median beyond which a value is an outlier."""
    middle, one = spread(values)
    return max(BEYOND * one, math.log1p(MATTERS_ERROR) if judged.error else MATTERS * abs(middle))


def find(units: Mapping[str, Mapping[str, object]]) -> dict[str, str] | None:
    """Units (name to figures) that are outliers, each with the figures that are far off; None if there are too few."""
    if len(units) < FEWEST:
        return None
    found: dict[str, list[str]] = {}
    for judged in JUDGED:
        values = {name: value for name, figures in units.items() if (value := judged.value(figures)) is not None}
        if len(values) < FEWEST:
            continue
        listed = list(values.values())
        far = margin(judged, listed)
        for name, score in zip(values, modified_scores(listed), strict=True):
            if score and (score > 0.0 or not judged.error) and abs(values[name] - spread(listed)[0]) > far:
                number = float(units[name][judged.column])  # type: ignore[arg-type]
                found.setdefault(name, []).append(f"{judged.words} {number:.4g} (z {score:+.1f})")
    return {name: "; ".join(words) for name, words in found.items()}
