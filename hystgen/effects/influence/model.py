"""Gain and offset that follow a logged column: load, humidity, drive or position of another axis."""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Iterator, Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from hystgen.basics.quantities import NotNegative, Number
from hystgen.effects.base import About, Array, Candidate, Problem, not_as_many, span
from hystgen.effects.columns import TEMPERATURE, Follower, Law

MOST_CURVED = 2
"""Maximum number of coefficients of a curve: it adds x^2 and x^3 to a line."""

MOST_PLAYS = 64
"""Maximum number of plays of a column: a compensator moves all of them in one call."""

SHARES = (0.03, 0.07, 0.13, 0.22, 0.35)
"""[fraction of the column's range] Thresholds of the plays that a fit tries: a smaller one hardly differs from the
column itself, and a play of half the range never moves."""


class ColumnPlays(BaseModel):
    """Plays of the column above its reference; the offset is their weighted sum."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    thresholds: Annotated[tuple[NotNegative, ...], Field(min_length=1, max_length=MOST_PLAYS)] = Field(
        description="thresholds, column units, rising", examples=[[1.0, 4.0]]
    )
    weights: tuple[Number, ...] = Field(description="output units per column unit, one per threshold")


with warnings.catch_warnings():
    warnings.simplefilter("ignore", UserWarning)  # `gain` and `offset` name numbers here, methods in `Effect`

    class Influence(Follower):
        """Gain `1 + gain x` and offset `offset x`, with a curve and plays of x, for x of a column above a reference."""

        name: Literal["influence"] = Field(description="name of the effect")

        timed: ClassVar[bool] = False
        repeatable: ClassVar[bool] = True
        shown_by: ClassVar[Mapping[str, int]] = {"holds": 4, "settling": 4, "slow_again": 4}
        settled: ClassVar[tuple[str, ...]] = ("column", "reference", "range")
        compensation: ClassVar[str] = "exact, given the column along with the reference"

        column: Annotated[str, Field(min_length=1, max_length=64)] = Field(
            description="name of the column in the records", examples=["load"]
        )
        offset: Number = Field(default=0.0, description="change of offset, output units per column unit")  # type: ignore[assignment]
        gain: Number = Field(default=0.0, description="change of gain, 1 per column unit", examples=[-0.002])  # type: ignore[assignment]
        reference: Number = Field(default=0.0, description="value of the column at which nothing changes")
        time_constant: NotNegative = Field(default=0.0, description="of the response to the column, s", examples=[30.0])
        curve: Annotated[tuple[Number, ...], Field(max_length=MOST_CURVED)] = Field(
            default=(), description="offset per x^2, then per x^3, output units per column unit^2, ^3"
        )
        plays: ColumnPlays | None = Field(  # type: ignore[assignment]
            default=None, description="plays of x, for another axis's drive"
        )
        range: tuple[Number, Number] | None = Field(
            default=None, description="least and largest value of the column that was fitted, column units"
        )

        @property
        def law(self) -> Law:
            """What the column does."""
            moved = self.plays
            return Law(
                self.column, self.gain, self.offset, self.reference, self.time_constant, self.curve,
                moved.thresholds if moved else (), moved.weights if moved else (),
                *([self.range] if self.range else []),
            )

        def problems(self, thresholds: tuple[float, ...] | None) -> Iterator[Problem]:
            """Plays out of order, or not as many weights as thresholds, and a range without the reference."""
            moved = self.plays
            if moved:
                found = not_as_many("weights", moved.weights, "thresholds", moved.thresholds)
                yield from ((("plays", *keys), message) for keys, message in found)
                if any(b <= a for a, b in itertools.pairwise(moved.thresholds)):
                    yield ("plays", "thresholds"), "must rise strictly; sort them, and merge equal ones"
            if self.range and not self.range[0] <= self.reference <= self.range[1]:
                yield ("range",), "must contain the reference; widen it, or move the reference into it"
            elif self.range and not self.range[0] < self.range[1]:
                yield ("range",), "must be two rising numbers; write [lowest, highest]"

        @classmethod
        def candidates(cls, about: About) -> list[Candidate]:
            """Offset, gain and both for each column that every record has, then a lag, a curve and plays of it."""
            names = sorted(about.columns - {TEMPERATURE})  # `thermal` tries a temperature
            return [each for name in names for each in _of_column(cls, name, about.ends[name], about)]


MOST = 100.0
"""[per cent of the output's range, or of the gain, over half the column's range] Bounds of a search."""


def _of_column(kind: type[Influence], column: str, ends: tuple[float, float], about: About) -> Iterator[Candidate]:
    """Shapes for one column, in units of a hundredth of the output or the gain over half of the column's range."""
    half, middle = 0.5 * (ends[1] - ends[0]), 0.5 * (ends[0] + ends[1])
    if half <= 0.0 or not np.isfinite(half):
        return
    own, of_gain = 0.01 * about.output_range / half, 0.01 / half
    thresholds = tuple(2.0 * share * half for share in SHARES)
    rest = min(max(0.0, ends[0]), ends[1])  # another axis begins at rest where its drive is 0

    def one(what: str, keys: tuple[str, ...], beyond: str = "") -> Candidate:
        """Amounts of these keys; `late` is the logarithm of a time constant."""

        def build(x: Array) -> Influence:
            numbers = dict(zip(keys, x.tolist(), strict=True))
            weights = tuple(own * numbers.get(f"play {i}", 0.0) for i in range(len(thresholds)))
            return kind.model_validate({
                "name": "influence", "column": column, "range": ends,
                "reference": rest if "play 0" in numbers else middle,
                "offset": own * numbers.get("offset", 0.0), "gain": of_gain * numbers.get("gain", 0.0),
                "time_constant": 10.0 ** numbers["late"] if "late" in numbers else 0.0,
                "curve": (own / half * numbers["square"],) if "square" in numbers else (),
                "plays": {"thresholds": thresholds, "weights": weights} if "play 0" in numbers else None,
            })

        low, high = (np.array([limit if key == "late" else way * MOST for key in keys]) for way, limit in
                     zip((-1.0, 1.0), lags, strict=True))
        starts = [np.array([lag if key == "late" else 0.0 for key in keys]) for lag in
                  (lags[0] + share * (lags[1] - lags[0]) for share in ((0.5, 0.8, 0.2) if "late" in keys else (0.5,)))]
        amounts = tuple(i for i, key in enumerate(keys) if key != "late") if "late" in keys else ()
        return Candidate(
            f"influence of {column}, {what}", low, high, starts[0], build, starts[0], tuple(starts[1:]),
            beyond and f"influence of {column}, {beyond}", amounts=amounts,
        )

    lags = span(2.0 * about.sample_time, 0.5 * about.session)
    yield one("offset", ("offset",))
    yield one("gain", ("gain",))
    yield one("gain and offset", ("offset", "gain"))
    if about.timed:
        yield one("offset behind a lag", ("late", "offset"))
        yield one("gain behind a lag", ("late", "gain"))
    yield one("offset along a curve", ("offset", "square"), "offset")
    yield one("offset and plays", ("offset", *(f"play {i}" for i in range(len(thresholds)))), "offset")


SHAPES = (Influence,)
