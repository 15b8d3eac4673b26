"""How well the recorded actuator tracks with each compensator: straight line, plays alone, whole model."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hystgen.basics import arguments, display
from hystgen.basics.presented import Presented
from hystgen.basics.problems import counted
from hystgen.compensator.chain.layout import LEAST_LATE
from hystgen.identification import instruments
from hystgen.identification.prepared import about_skip, samples_in
from hystgen.model import Model
from hystgen.records import SHORTEST, in_units
from hystgen.simulation import simulate_records

if TYPE_CHECKING:
    from hystgen.records import Record

Array = NDArray[np.float64]

MOST_UNKNOWN = 0.8
"""[fraction of a record] If the drive has not visited both its extremes by this point, the whole record is judged. The
rms error over a fifth of a record in `examples/` is 0.12 to 2.0 times that over the whole record; over a twentieth, it
is 0.02 to 3.1 times that. Set by: benchmarks/chosen_numbers.py unknown."""

LINE, PLAYS, WHOLE = "straight line", "plays alone", "whole model"
"""The compensators compared, each of which turns the reference into a drive."""


@dataclass(frozen=True)
class Tracked:
    """Tracking of one record's motion, in output units: error (N,) of each compensator, reference minus motion, and
    `span` of the motion; `drive` (N,): that of the whole model, in input units.

    `known`: the sample by which the drive has visited both its extremes, so that the motion before the record no longer
    matters. Errors have their mean from `known` on removed, because the zero of a displacement is arbitrary. `limited`:
    how range limits affect each compensator's drives, one sentence each.
    """

    name: str
    t: Array
    drive: Array
    reference: Array
    errors: dict[str, Array]
    span: float
    known: int
    limited: tuple[str, ...] = ()

    def rms(self, which: str) -> float:
        """Rms error, % of the span."""
        return 100.0 * float(np.sqrt(np.mean(self.errors[which][self.known :] ** 2))) / self.span

    def most(self, which: str) -> float:
        """Largest error, % of the span."""
        return 100.0 * float(np.max(np.abs(self.errors[which][self.known :]))) / self.span


@dataclass(frozen=True, repr=False)
class Tracking(Presented):
    """Tracking errors of the recorded actuator with each compensator, record by record.

    `left_out`: names of the model's effects, which "plays alone" lacks; `notes`: unit conversions, one sentence each.
    The picture shows the errors over time.
    """

    unit: str
    records: tuple[Tracked, ...]
    left_out: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    drive_unit: str = ""

    FILES = ("tracking.json", "report.html", "tracking.svg")

    @property
    def compensators(self) -> dict[str, str]:
        """A description of each compensator."""
        names = ", ".join(self.left_out)
        without = f"the inverse of the model without its effects ({names}), all else as in the parameter file"
        return {
            LINE: "the drive as a linear function of the motion, by least squares over these records",
            PLAYS: without if names else "the inverse of the model, which has no effects",
            WHOLE: "the inverse of the model",
        }

    def __repr__(self) -> str:
        return f"<Tracking of {counted(len(self.records), 'record')}>"

    def _repr_html_(self) -> str:
        said = "\n".join(f"{which}: {what}." for which, what in self.compensators.items())
        return display.block(f"{self!r}: % of the motion's span, about the mean", said, self.draw, self.rows())

    def rows(self) -> list[tuple[str, ...]]:
        """The table: a header, and a row per record and compensator."""
        found = [
            (each.name, which, f"{each.rms(which):.3f}", f"{each.most(which):.3f}")
            for each in self.records for which in each.errors
        ]
        return [("record", "compensator", "rms %", "max %"), *found]

    def sentence(self) -> str:
        """The rms error with each compensator; on several records, the largest."""
        most = {which: max(each.rms(which) for each in self.records) for which in self.compensators}
        where = " at most" if len(self.records) > 1 else ""
        plays = f", with plays alone {most[PLAYS]:.3g} %" if self.left_out else ""
        return (
            f"The rms tracking error with the whole model is{where} {most[WHOLE]:.3g} % of the motion's span{plays}, "
            f"and with a straight line {most[LINE]:.3g} %."
        )

    def table(self) -> str:
        """The table that the command prints."""
        width = max(len(each.name) for each in self.records)
        lines = [f"{'record':{width}}  compensator     rms %    max %   of the motion's span, about the mean"]
        for each in self.records:
            for which in each.errors:
                name = each.name if which == LINE else ""
                lines.append(f"{name:{width}}  {which:14} {each.rms(which):6.3f}  {each.most(which):7.3f}")
        lines += [f"{which}: {what}." for which, what in self.compensators.items()]
        return "\n".join(lines)

    def to_json(self) -> str:
        """The table as JSON: errors in % of each motion's span, the span in output units."""
        content = {
            "hystgen": 1,
            "unit": self.unit,
            "left_out": list(self.left_out),
            "compensators": self.compensators,
            "records": [
                {
                    "name": each.name,
                    "span": each.span,
                    "samples": len(each.t) - each.known,
                    "errors": {which: {"rms": each.rms(which), "max": each.most(which)} for which in each.errors},
                    "limited": list(each.limited),
                }
                for each in self.records
            ],
        }
        return json.dumps(content, indent=2, allow_nan=False) + "\n"


def late(model: Model, records: Sequence[Record]) -> str:
    """A sentence saying how late `emit.compensation` makes the motion; empty if it is not late."""
    if not model.effects:
        return ""
    step = float(np.median(np.diff(records[0].t)))
    samples = model.compensator.reading(step).late(model.parameters.emit.compensation.preview)
    if samples <= LEAST_LATE:
        return ""
    return (
        f"with emit.compensation of the parameter file the motion of the whole model is {samples:.3g} samples late, "
        "which counts as error"
    )


def track(
    model: Model, records: Sequence[Record], history: Sequence[float] = (), rest: float = 0.0, skip: float = 0.0,
    clock_skew: float | str | None = None,
) -> Tracking:
    """The tracking error with each compensator if the records' motions were the references.

    The recorded actuator is assumed to respond to a drive as the model does, plus the residual of the record: `y =
    model[v] + (y_recorded - model[v_recorded])`. The reference is the model's motion for the recorded drive. `straight
    line`: the drive as a linear function of the reference, by least squares; `plays alone`: the inverse of `model`
    without its effects, nothing else changed and nothing fitted; `whole model`: the inverse of `model`. `history` and
    `rest` come before every record; `skip`: seconds at the start of each record that are not compared; `clock_skew`: as
    for `identify`. Raises NotInvertibleError, EffectsError, ValueError for records without y, RecordError for
    incompatible units.
    """
    if any(record.y is None for record in records):
        raise ValueError("tracking needs the measured motion: a column y in every record")
    given, records = records, instruments.put_right(in_units(records, model.parameters.units), clock_skew)
    notes = [f"{b.name}: {note}" for a, b in zip(given, records, strict=True) for note in b.notes[len(a.notes) :]]
    for record in records:
        if len(record) < samples_in(record, skip) + SHORTEST:
            raise ValueError(
                f"{record.name} has {len(record)} samples, of which {min(samples_in(record, skip), len(record))} are "
                f"to be skipped, but at least {SHORTEST} are needed; skip less, or record more"
            )
    notes += [text for record in records for text in about_skip(record, samples_in(record, skip))]
    notes += arguments.outside("history", history, model.cascade.input_range, "the model's input_range")
    model.inverse()
    compensators = {PLAYS: model.without(model.effects), WHOLE: model}
    runs = [model.run(record.v, record.t, record.extra, rest=rest) for record in records]
    moved = [model.chain.simulate([run], history)[0] for run in runs]
    ends = model.cascade.input_range
    slope, start = np.polyfit(np.concatenate(moved), np.concatenate([record.v for record in records]), 1)
    found = []
    for record, run, reference in zip(records, runs, moved, strict=True):
        assert record.y is not None
        asked = replace(record, extra={**record.extra, "u": reference})
        drives = {LINE: np.clip(start + slope * reference, *ends)}
        limited = []
        for which, each in compensators.items():
            ((drives[which], said),) = simulate_records(each, [asked], "inverse")
            limited += [f"{sentence}, {which}" for sentence in said]
        beside = record.y - reference
        moves = {which: model.chain.simulate([model.run(v, run.t, run.extra)])[0] for which, v in drives.items()}
        known = max(int(np.argmax(record.v)), int(np.argmin(record.v)))
        known = max(known if known < MOST_UNKNOWN * len(record.v) else 0, samples_in(record, skip))
        errors = {}
        for which, y in moves.items():
            error = reference - y - beside
            errors[which] = error - np.mean(error[known:])
        found.append(
            Tracked(
                record.name, run.t, drives[WHOLE], reference, errors, float(np.ptp(reference)), known, tuple(limited)
            )
        )
    names = dict.fromkeys(effect.name for effect in model.effects)
    units = model.parameters.units
    return Tracking(units.output, tuple(found), tuple(names), tuple(notes), units.input)
