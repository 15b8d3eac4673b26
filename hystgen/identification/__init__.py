"""Fitting models to measured records.

>>> fit = hystgen.identify("stage_recording.csv", holdout=["stage_holdout.csv"])
>>> print(fit.table())
>>> fit.write("stage.yaml")
"""

from __future__ import annotations

import math
import os
import re
import warnings as python_warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hystgen import memory
from hystgen.identification import pi, reduction
from hystgen.identification.pi import IdentificationError, Solution
from hystgen.identification.progress import Progress
from hystgen.identification.reduction import Course
from hystgen.identification.report import Row, table
from hystgen.identification.thresholds import rounded
from hystgen.records import SHORTEST, Record, read_record, read_records, write_atomically

if TYPE_CHECKING:
    from hystgen.params import Parameters

MODELS = ("pi", "gpi-deadzone", "gpi-tanh", "auto")
"""Names of the contract; this version fits the first."""

P0_FLOOR = 0.05
"""Share of the sum of weights below which p_0 is raised where the data allow it."""

HELD_OUT = 0.25
"""Share of each record, its end, that is held out for the figures when no record is given for that."""

AMPLIFIES = 100.0
"""Ratio of the largest slope to p_0 beyond which the inverse is called hard to use."""

SMALL_REACH = 0.1
"""Largest threshold, as a share of the drive range, below which a record is said to show little hysteresis."""

STARTS, UNLIKE = 8, 3.0
"""A start of so many samples whose rms error is so many times that of the rest tells of a wrong history."""

Source = Record | str | os.PathLike[str]


@dataclass(frozen=True)
class Fit:
    """A fitted model and how good it is.

    `parameters`: as a parameter file holds them; `rows`: the fit table; `warnings`: what the user should know, one
    sentence each; `history`: drive values visited before each record, None when unknown.
    """

    parameters: Parameters
    rows: tuple[Row, ...]
    warnings: tuple[str, ...]
    history: tuple[float, ...] | None = None

    def table(self) -> str:
        """The fit table as text: rms and largest error, absolute and in % of the output range."""
        return table(self.rows, self._unit, self._remarks)

    def predict(
        self, record: Source, history: Sequence[float] | None = None, free_offset: bool = False
    ) -> NDArray[np.float64]:
        """Free-run output (N,) of the model along a record's drive, in output units.

        The start memory comes from `history`, else from the history of the fit, else the plays are at rest at the
        first drive value: then the samples before the drive has swept its range count little. `free_offset` shifts the
        result to the mean of the record's `y`. Warns when the drive leaves the fitted range.
        """
        data = read_record(record, need=("v",)) if not isinstance(record, Record) else record
        outside = _outside(data.name, data.v, self.parameters.input_range)
        if outside:
            python_warnings.warn(outside, stacklevel=2)
        before = self.history if history is None else _history(history)
        part = self.parameters.model.pi
        predicted = reduction.prediction(data.v, before, np.array(part.thresholds), np.array(part.weights))
        if free_offset:
            if data.y is None:
                raise ValueError(f"{data.name} has no measured column y to take the offset from")
            return np.asarray(predicted + float(np.mean(data.y - predicted)))
        return np.asarray(predicted + self.parameters.model.output_offset)

    def settled(self, record: Source) -> int:
        """First sample of a record at which no play remembers an unknown start; 0 where a history was given."""
        data = read_record(record, need=("v",)) if not isinstance(record, Record) else record
        largest = self.parameters.model.pi.thresholds[-1]
        return 0 if self.history is not None else reduction.settled(data.v, largest)

    def text(self) -> str:
        """The parameter file: what was fitted on what as comments, then the parameters."""
        from hystgen.params import dump_parameters

        lines = ["Identified by hystgen; errors have a free offset a record."]
        lines += [row.sentence() for row in self.rows]
        lines += [f"Warning: {warning}" for warning in self.warnings]
        return dump_parameters(self.parameters, header="\n".join(lines))

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the parameter file, all or nothing."""
        write_atomically(path, self.text())

    @property
    def _unit(self) -> str:
        units = self.parameters.units
        return (units.output or "") if units is not None else ""

    @property
    def _remarks(self) -> list[str]:
        n = len(self.parameters.model.pi.thresholds) - 1
        remarks = [
            f"{n} play{'' if n == 1 else 's'}. Errors of a free run with a free offset a record; % of the largest "
            "peak-to-peak output of the row's records, each taken whole."
        ]
        if any(row.model == "trial" for row in self.rows):
            remarks.append(
                f"trial: fitted to the first {100 * (1 - HELD_OUT):g} % of each record (row fit), compared with the "
                "rest (row held out). written: fitted to everything."
            )
        elif any(row.part == "held out" for row in self.rows):
            remarks.append("written: fitted to the records of row fit only.")
        if any(row.ignored for row in self.rows):
            remarks.append("ignored: samples at the start, before the drive had wiped an unknown start memory.")
        return remarks


def identify(
    records: Source | Iterable[Source],
    *,
    model: str = "pi",
    thresholds: int | Sequence[float] | None = None,
    holdout: Source | Iterable[Source] = (),
    history: Sequence[float] | None = None,
    rest: float = 0.0,
    name: str = "stage",
    units: Mapping[str, str] | None = None,
    skip: int = 0,
    p0_floor: float = P0_FLOOR,
    columns: Mapping[str, str] | None = None,
    sample_time: float | None = None,
    delimiter: str | None = None,
    progress: bool = False,
) -> Fit:
    """Fit a model to measured records.

    `records`: one or several `Record`s or paths (read with `columns`, `sample_time`, `delimiter`), each with a free
    offset. `model`: `pi`. `thresholds`: a number of plays without r_0, or a list of thresholds; by default both number
    and places are chosen by blocked validation on the records. `holdout`: records that take no part in any choice;
    without them the last quarter of each record gives the held-out figures, from a trial model that has not seen it,
    and the model written is then fitted to everything. `history`: drive values visited before every record from a
    virgin state; without it the start of each record is ignored until the drive has wiped the memory that matters.
    `rest`: seconds of pause after the history; a PI model does not depend on time, so it changes nothing here.
    `name`: C identifier of the model. `units`: `input` and `output`. `skip`: samples at the start of every record that
    are not compared, though their drive counts. `p0_floor`: see `weights.fit`; 0 leaves p_0 as it comes.
    `progress`: a bar on a terminal's stderr when it takes more than a second.

    The start memory in the parameter file is the one that `history` leads to. Without it, it is 0, that of a virgin
    actuator: no record tells in which state the firmware will find it. Raises RecordError for unusable files,
    IdentificationError for records that nothing can be fitted to, ValueError for wrong arguments.
    """
    if model not in MODELS:
        raise ValueError(f"model {model!r} is none of {', '.join(MODELS)}")
    if model != "pi":
        raise ValueError(f"this version fits model pi only, not {model}")
    wanted = pi.checked_thresholds(thresholds)
    before = None if history is None else _history(history)
    if not (math.isfinite(rest) and rest >= 0.0):
        raise ValueError(f"rest is a number of seconds, not negative, not {rest}")
    if skip < 0:
        raise ValueError(f"skip is a number of samples, not negative, not {skip}")
    if not 0.0 <= p0_floor < 1.0:
        raise ValueError(f"p0_floor is a share of the sum of weights from 0 to below 1, not {p0_floor}")

    to_fit, to_hold = _several(records), _several(holdout)
    read = read_records([*to_fit, *to_hold], columns, sample_time, delimiter)
    fit_records, held_records = read[: len(to_fit)], read[len(to_fit) :]
    if not fit_records:
        raise ValueError("there is no record to fit")
    told = [f"{record.name}: {note}" for record in (*fit_records, *held_records) for note in record.notes]
    courses = [pi.course(record, before, skip) for record in fit_records]
    held = [pi.course(record, before, skip) for record in held_records]
    rows: list[Row] = []
    with Progress(sum(len(item.v) for item in courses) * (1.0 if held else 2.0 - HELD_OUT), progress) as bar:
        if not held:
            rows, reason = _trial(courses, wanted, p0_floor, skip, bar)
            if reason:
                told.append(reason)
        solution, compared = pi.solve(courses, wanted, p0_floor, skip, bar.tick)
    r, p = solution.thresholds, solution.weights
    begins = [skip] * len(compared)
    errors = [pi.compare(item, r, p) for item in compared]
    own = pi.row("fit" if held or not rows else "all", "written", errors, begins)
    rows.append(own)
    low = min(item.drive_range[0] for item in compared)
    high = max(item.drive_range[1] for item in compared)
    if held:
        settled = [pi.resettled(item, float(r[-1]), skip) for item in held]
        for item in settled:
            if item.used < SHORTEST:
                raise IdentificationError(
                    f"{item.name} is held out, but only {item.used} of its samples can be compared once its start "
                    f"memory is known, at least {SHORTEST} are needed; hold out a longer record, or give --history"
                )
        rows.append(pi.row("held out", "written", [pi.compare(item, r, p) for item in settled], [skip] * len(held)))
        told += [text for item in held if (text := _outside(item.name, item.v, (low, high)))]
    offset = rounded(errors[0].offset, pi.DIGITS)
    told += [
        f"{item.name}: only {item.used} samples are left once its start memory is known; it hardly counts"
        for item in compared
        if item.used < SHORTEST
    ]
    told += [text for each in errors if (text := _about_start(each, float(r[-1])))]
    told += _about_model(solution, wanted, compared, own)
    return Fit(_parameters(name, units, (low, high), r, p, offset, before), tuple(rows), tuple(told), before)


def _several(sources: Source | Iterable[Source]) -> list[Source]:
    return [sources] if isinstance(sources, Record | str | os.PathLike) else list(sources)


def _trial(
    courses: Sequence[Course], wanted: int | tuple[float, ...] | None, floor: float, skip: int, bar: Progress
) -> tuple[list[Row], str]:
    """Rows of a model fitted to the first part of each record and compared with the rest, or why there is none."""
    short = "too short, or too little of the drive's range in its first part, to hold its end out; give --holdout"
    fronts, splits = [], []
    for item in courses:
        split = round(len(item.v) * (1.0 - HELD_OUT))
        front = pi.resettled(replace(item, last=split), math.inf, skip)
        if front.used < SHORTEST or np.ptp(item.v[front.first : split]) == 0.0:
            return [], f"{item.name}: {short}"
        fronts.append(front)
        splits.append(split)
    try:
        solution, compared = pi.solve(fronts, wanted, floor, skip, bar.tick)
    except IdentificationError as failure:
        return [], f"nothing was held out: {failure}"
    r, p = solution.thresholds, solution.weights
    rests = [pi.resettled(item, float(r[-1]), split) for item, split in zip(courses, splits, strict=True)]
    for item in rests:
        if item.used < SHORTEST:
            return [], f"{item.name}: {short}"
    fit_errors = [pi.compare(item, r, p) for item in compared]
    held_errors = [pi.compare(item, r, p) for item in rests]
    return [
        pi.row("fit", "trial", fit_errors, [skip] * len(compared)),
        pi.row("held out", "trial", held_errors, splits),
    ], ""


def _about_model(
    solution: Solution, wanted: int | tuple[float, ...] | None, compared: Sequence[Course], own: Row
) -> list[str]:
    """What the user should know about the model itself."""
    told = []
    p, made = solution.weights, solution.fitted
    if made.free_p0 is not None and made.free_rms is not None:
        told.append(
            f"p_0 was raised from {made.free_p0:.3g} to {p[0]:.3g} so that the model has a usable inverse; the data "
            f"hardly tell: rms error {made.free_rms:.4g} before, {made.rms:.4g} after. A lag in the measurement lowers "
            "p_0: record more slowly if you can"
        )
    elif p[0] == 0.0:
        told.append(
            "p_0 is 0: after each reversal the output stands still (series backlash). The model has no inverse and is "
            "of use forward only. If the actuator has no backlash, record more slowly or with more samples a second"
        )
    elif np.sum(p) > AMPLIFIES * p[0]:
        told.append(
            f"p_0 is small: the inverse amplifies small movements {np.sum(p) / p[0]:.0f} times as much as large ones"
        )
    low = min(item.drive_range[0] for item in compared)
    high = max(item.drive_range[1] for item in compared)
    if solution.reach < SMALL_REACH * (high - low):
        told.append(
            f"the records tell little about hysteresis: no play above {solution.reach:.3g} moves enough in them; "
            "record full cycles, several times, or give --history"
        )
    if isinstance(wanted, tuple):
        beyond = [r for r in wanted if r > solution.reach * (1.0 + 1e-9)]
        if beyond:
            told.append(
                f"{len(beyond)} threshold{'' if len(beyond) == 1 else 's'} above {solution.reach:.6g} hardly move in "
                "these records; their weights are not to be trusted for larger drives"
            )
    outputs = [item.y[item.first : item.last] for item in compared]
    spread = sum(float(np.sum((y - np.mean(y)) ** 2)) for y in outputs) / own.samples
    share = 1.0 - own.rms**2 / spread
    if share < 0.9:
        told.append(
            f"the model explains only {100 * max(share, 0.0):.0f} % of the measured variance; check which column is "
            "which, and the units"
        )
    return told


def _about_start(errors: pi.Errors, largest: float) -> str:
    """Whether a record's start disagrees with the history it was given."""
    item = errors.course
    end = reduction.settled(item.v, largest) - item.first
    if item.history is None or end < STARTS or len(errors.error) - end < STARTS:
        return ""
    start, rest = (float(np.sqrt(np.mean(part**2))) for part in (errors.error[:end], errors.error[end:]))
    if start <= UNLIKE * rest:
        return ""
    return (
        f"{item.name}: the first {end} samples, whose output depends on the history, are off by {start:.3g} rms "
        f"against {rest:.3g} for the rest; the history may not be what the actuator saw. Leave it out if in doubt"
    )


def _outside(name: str, v: NDArray[np.float64], allowed: tuple[float, float]) -> str:
    number = int(np.count_nonzero((v < allowed[0]) | (v > allowed[1])))
    if not number:
        return ""
    return (
        f"{name}: {number} samples have a drive outside the fitted range {allowed[0]:.6g} to {allowed[1]:.6g}; "
        "the model is a guess there"
    )


def _history(values: Sequence[float]) -> tuple[float, ...]:
    visited = tuple(float(x) for x in values)
    if not all(math.isfinite(x) for x in visited):
        raise ValueError("history is a list of finite drive values")
    return visited


def _parameters(
    name: str,
    units: Mapping[str, str] | None,
    drive: tuple[float, float],
    r: NDArray[np.float64],
    p: NDArray[np.float64],
    offset: float,
    history: tuple[float, ...] | None,
) -> Parameters:
    from hystgen.params import make_parameters

    content: dict[str, object] = {"hystgen": 1, "name": name}
    if units:
        content["units"] = dict(units)
    content["input_range"] = list(drive)
    content["model"] = {
        "pi": {"thresholds": r.tolist(), "weights": p.tolist(), "initial_state": _start(r, history)},
        "output_offset": offset,
    }
    return make_parameters(content)


def _start(r: NDArray[np.float64], history: tuple[float, ...] | None) -> float | list[float]:
    """The start memory to write: after the history, or virgin; one number where all plays agree."""
    if history is None or len(r) < 2:
        return 0.0
    states, _ = memory.project(reduction.start_states(np.zeros(1), history, r).tolist(), r.tolist())
    return states[0] if len(set(states)) == 1 else list(states)


def identifier_from(text: str) -> str:
    """A C identifier made from any text, such as a file's stem: `stage` where nothing is left of it."""
    from hystgen.names import name_problem

    words = re.sub(r"[^0-9A-Za-z]+", "_", text).strip("_")
    if not words:
        return "stage"
    if words[0].isdigit():
        words = f"stage_{words}"
    words = words[:40].rstrip("_")
    return f"stage_{words}" if name_problem(words) else words


__all__ = ["MODELS", "Fit", "IdentificationError", "Row", "identifier_from", "identify"]
