"""A fitted model with its figures, predictions and parameter file, and the samples compared."""

from __future__ import annotations

import os
import textwrap
import warnings as python_warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hystgen.basics import arguments, display, drawing
from hystgen.basics.problems import counted
from hystgen.identification import elements, faults, joint, quality, reduction
from hystgen.identification.quality import ErrorRow, Intervals, table
from hystgen.identification.reduction import Course, StartMemory
from hystgen.identification.verdict import Verdict
from hystgen.records import Record, Source, in_units, read_record, write_atomically

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hystgen.model import Model
    from hystgen.parameters.schema import Parameters


HELD_OUT = 0.25
"""Fraction of each record, at its end, held out for the figures if no held-out record is given."""


@dataclass(frozen=True, repr=False)
class Fit:
    """A fitted model and its quality.

    `parameters`: as in a parameter file; `rows`: the fit table; `warnings`: for the user, one sentence each;
    `intervals`: 95 % confidence intervals; `used`: the compared samples of each record, held-out records last;
    `verdict`: what the figures say about the model, and the next step;
    `history`: drive values visited before each record, None if unknown; `records`: the records of `used`, in that
    order; `draw`: makes the figure of `plot`, None if there is nothing to draw.
    """

    parameters: Parameters
    rows: tuple[ErrorRow, ...]
    warnings: tuple[str, ...]
    intervals: Intervals
    used: tuple[Used, ...]
    verdict: Verdict
    history: tuple[float, ...] | None = None
    records: tuple[Record, ...] = field(default=(), compare=False)
    draw: Callable[[Fit], Figure] | None = field(default=None, compare=False)

    def __repr__(self) -> str:
        row = next((row for row in self.rows if row.part == "held out"), self.rows[-1])
        plays = counted(len(self.parameters.model.pi.thresholds) - 1, "play")
        unit = f" {self.unit}" if self.unit else ""
        return f"<Fit {self.parameters.name}: {plays}, {row.part} rms {row.rms:.4g}{unit} ({row.rms_percent:.3g} %)>"

    def _repr_html_(self) -> str:
        draw = None if self.draw is None else partial(self.draw, self)
        return display.block(repr(self), "\n".join(self.remarks), draw, quality.cells(self.rows, self.unit))

    @property
    def model(self) -> Model:
        """The fitted model, to simulate, invert and emit."""
        from hystgen.model import Model

        return Model(self.parameters)

    def plot(self, path: str | os.PathLike[str] | None = None) -> Figure:
        """A figure: a record's loop (held-out if possible) with the model's loop; residuals over time; weights.

        Returns a matplotlib Figure, which a notebook displays; it is also saved to `path`, a .png or .svg file, if
        given. Needs matplotlib, from the extra `plot`. Raises PlotError, OSError.
        """
        if self.draw is None:
            raise drawing.PlotError("this fit has no figure; use the one returned by hystgen.identify")
        return drawing.picture(partial(self.draw, self), path)

    def table(self) -> str:
        """The fit table as text: rms and largest error, absolute and in % of the output range."""
        return table(self.rows, self.unit, self.remarks)

    def predict(
        self, record: Source, history: Sequence[float] | None = None, free_offset: bool = False
    ) -> NDArray[np.float64]:
        """Free-run output (N,) of the model along a record's drive, in output units.

        The start memory comes from `history`, or else from the history of the fit; without either, the plays start at
        rest at the first drive value, so the output is unreliable until the drive has swept its range. `free_offset`
        shifts the result to the mean of the record's `y`. Warns if the drive leaves the fitted range.
        """
        (data,) = in_units([_read(record)], self.parameters.units, sources=[record])
        outside = quality.outside(data.name, data.v, self.parameters.input_range)
        if outside:
            python_warnings.warn(outside, stacklevel=2)
        predicted = self._output(self._inner(data, self.history if history is None else visited(history)))
        if free_offset:
            if data.y is None:
                raise ValueError(f"{data.name} has no measured column y to take the offset from")
            return np.asarray(predicted + float(np.mean(data.y - predicted)))
        return np.asarray(predicted + self.parameters.model.output_offset)

    def along(self, record: Record, used: Used) -> NDArray[np.float64]:
        """Free-run output (N,) along a record, computed as in the fit.

        The drive is bridged where the fit bridged it; every part between gaps starts afresh, with the offset that fits
        its compared samples best; parts left out are NaN. Raises ValueError if `used` belongs to another record.
        """
        if (record.name, len(record)) != (used.name, used.samples) or record.y is None:
            raise ValueError(f"{record.name} is not the record {used.name} of {used.samples} samples that was compared")
        wrong, compared = np.zeros(len(record), dtype=bool), used.compared
        wrong[used.bridged] = True
        found = np.full(len(record), np.nan)
        for (first, stop), start in zip(used.parts, used.starts, strict=True):
            here = slice(first, stop)
            drive = replace(record.section(first, stop), v=faults.bridged(record.v[here], wrong[here]))
            visited = None if first in used.gaps else self.history
            output = self._output(self._inner(drive, visited if start is None else start.turns))
            known = compared[here]
            found[here] = output + float(np.mean((record.y[here] - output)[known]))
        return found

    def settled(self, record: Source) -> int:
        """First sample of a record from which no play remembers an unknown start; 0 if a history was given."""
        if self.history is not None:
            return 0
        largest = self.parameters.model.pi.thresholds[-1]
        return reduction.settled(self._inner(_read(record), None).v, largest)

    def _inner(self, record: Record, history: tuple[float, ...] | None) -> Course:
        """The record's drive as the plays see it."""
        from hystgen.model import cascade_of

        v = np.ascontiguousarray(record.v, dtype=np.float64)
        course = Course(record.name, v, v, history, 0, len(v))
        return joint.through_front(course, cascade_of(self.parameters).stages)

    def _output(self, inner: Course) -> NDArray[np.float64]:
        """The output (N,) of the plays and of the elements in parallel, without offset."""
        part = self.parameters.model
        r, p = np.array(part.pi.thresholds), np.array(part.pi.weights)
        output = reduction.prediction(inner.v, inner.history, r, p)
        for parallel in part.effects:
            output += elements.term(inner, parallel)
        return output

    def text(self) -> str:
        """The parameter file: models and records of the fit as comments, then the parameters."""
        from hystgen.parameters.files import dump_parameters

        lines = ["Identified by hystgen; errors have a free offset per record."]
        lines += [row.sentence() for row in self.rows]
        sure = self.intervals
        lines.append(f"95 % intervals from a bootstrap by blocks of {sure.block} samples: {self._interval_sentence()}")
        lines += [f"Warning: {warning}" for warning in self.warnings]
        ends = " ".join(f"{low:.4g}..{high:.4g}" for low, high in sure.weights)
        comments = {"model.pi.weights": "\n".join(textwrap.wrap(f"95 %: {ends}", 90))}
        return dump_parameters(self.parameters, comments, "\n".join(lines))

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the parameter file completely or not at all."""
        write_atomically(path, self.text())

    def _interval_sentence(self) -> str:
        """Loop width and held-out error with their intervals."""
        sure, units = self.intervals, self.parameters.units
        drive, output = (f" {unit}" if unit else "" for unit in (units and units.input, self.unit))
        said = f"widest loop (input of the plays) {sure.width[0]:.4g} to {sure.width[1]:.4g}{drive}"
        if sure.held_out is not None:
            said += f", held-out rms error {sure.held_out[0]:.4g} to {sure.held_out[1]:.4g}{output}"
        return said

    @property
    def unit(self) -> str:
        """Unit of the output, empty if unknown."""
        units = self.parameters.units
        return (units.output or "") if units is not None else ""

    @property
    def remarks(self) -> list[str]:
        """Explanations of the terms in the fit table, one or two sentences each."""
        n = len(self.parameters.model.pi.thresholds) - 1
        reported = [
            f"{counted(n, 'play')}. Errors of a free run with a free offset per record; % of the largest peak-to-peak "
            "output compared in any of the row's records."
        ]
        if any(row.model == "trial" for row in self.rows):
            reported.append(
                f"trial: fitted to the first {100 * (1 - HELD_OUT):g} % of each record (row fit), compared with the "
                "rest (row held out), both in % of the whole. written: fitted to everything."
            )
        elif any(row.part == "held out" for row in self.rows):
            reported.append("written: fitted to the records of row fit only.")
        if any(row.ignored for row in self.rows):
            reported.append("ignored: samples at the start, where the memory from before the record is unknown.")
        if len(self.parameters.model.pi.thresholds) > 1:
            reported += [each.start_sentence(self.unit) for each in self.used if any(each.starts)]
        reported.append(f"95 % confidence: {self._interval_sentence()}.")
        return reported


def _read(source: Source) -> Record:
    return source if isinstance(source, Record) else read_record(source, need=("v",))


def visited(values: Sequence[float]) -> tuple[float, ...]:
    """A history as plain numbers. Raises ValueError unless all are finite, TypeError unless they are a list."""
    return arguments.numbers("history", values, "[100, -100]")


# Samples of each record that a fit compared and left out -----------------------------------------------------


Indices = NDArray[np.intp]


@dataclass(frozen=True)
class Used:
    """How a fit used one record; arrays are ascending indices into its samples.

    `name`: the record's name; `held_out`: whether the record took no part in the fit; `samples`: its length; `parts`:
    first and last sample (exclusive) of each part that was simulated, a single part if there is no gap; `starts`: the
    start memory found for each part, None if it was given or not found; `skipped`: samples excluded at the start on
    request; `ignored`: samples not compared at the start of a part because its start memory is unknown; `outliers`:
    isolated samples of y not compared; `stretches`: samples of y not compared in drop-outs, held runs or converter
    saturation; `bridged`: samples of v replaced by a straight line; `gaps`: first sample after each; `left_out`: parts
    between gaps too short to use.
    """

    name: str
    held_out: bool
    samples: int
    parts: tuple[tuple[int, int], ...]
    starts: tuple[StartMemory | None, ...] = field(repr=False)
    skipped: Indices = field(repr=False, compare=False)
    ignored: Indices = field(repr=False, compare=False)
    outliers: Indices = field(repr=False, compare=False)
    stretches: Indices = field(repr=False, compare=False)
    bridged: Indices = field(repr=False, compare=False)
    gaps: Indices = field(repr=False, compare=False)
    left_out: Indices = field(repr=False, compare=False)

    @property
    def compared(self) -> NDArray[np.bool_]:
        """Whether each sample (samples,) was compared."""
        found = np.ones(self.samples, dtype=bool)
        for masked in (self.skipped, self.ignored, self.outliers, self.stretches, self.left_out):
            found[masked] = False
        return found

    def start_sentence(self, unit: str) -> str:
        """The sentence about the start memories that were estimated."""
        most = max(start.uncertainty for start in self.starts if start is not None)
        return (
            f"{self.name}: the start memory was estimated with the weights; its part of the output is known to "
            f"+-{most:.3g}{' ' if unit else ''}{unit} (95 %)."
        )

    def sentences(self) -> list[str]:
        """The sentences that give the numbers of isolated wrong samples."""
        return [
            faults.sentence(self.name, found, what)
            for found, what in ((self.bridged, faults.BRIDGED), (self.outliers, faults.NOT_COMPARED))
            if len(found)
        ]


def used_of(records: Sequence[Record], courses: Sequence[Course], held_out: bool) -> tuple[Used, ...]:
    """How the samples of `records` were used, given the courses finally compared."""
    return tuple(
        _of_record(record, [item for item in courses if item.origin[0] == number], held_out)
        for number, record in enumerate(records)
    )


def _of_record(record: Record, courses: Sequence[Course], held_out: bool) -> Used:
    parts = tuple((item.origin[1], item.origin[1] + len(item.v)) for item in courses)
    skipped, ignored, outliers, stretches, bridged = [], [], [], [], []
    outside = np.ones(len(record), dtype=bool)
    for item, (start, stop) in zip(courses, parts, strict=True):
        outside[start:stop] = False
        skipped.append(np.arange(start, start + item.begin))
        ignored.append(np.arange(start + item.begin, start + item.first))
        known = np.isfinite(item.y)
        known[: item.first] = True
        faulty = np.zeros(len(known), dtype=bool) if item.stretches is None else item.stretches
        outliers.append(start + np.flatnonzero(~known & ~faulty))
        stretches.append(start + np.flatnonzero(~known & faulty))
        bridged.append(start + np.flatnonzero(item.v != record.v[start:stop]))
    gaps = [piece.first for piece in faults.between_gaps(record)[1:]]
    return Used(
        record.name,
        held_out,
        len(record),
        parts,
        tuple(item.start if item.history is None else None for item in courses),
        np.concatenate(skipped),
        np.concatenate(ignored),
        np.concatenate(outliers),
        np.concatenate(stretches),
        np.concatenate(bridged),
        np.array(gaps, dtype=np.intp),
        np.flatnonzero(outside),
    )
