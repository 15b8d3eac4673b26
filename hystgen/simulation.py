"""Running a model over sampled signals: in double precision, or as the bit reference of an arithmetic."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.problems import EffectsError
from hystgen.chain.chain import join
from hystgen.compensator.chained import LIMITED
from hystgen.model import Model
from hystgen.plays import slots
from hystgen.plays.slots import Bytes
from hystgen.records import Record


def simulate_records(
    model: Model,
    records: Sequence[Record],
    operator: str = "forward",
    arithmetic: str | None = None,
    engine: str | None = None,
    history: Sequence[float] = (),
    rest: float = 0.0,
) -> list[tuple[NDArray[Any], list[str]]]:
    """Answers of the model (column v) or its inverse (column u) for records that are one session, each with remarks.

    `history`: drives visited before the first record; `rest`: seconds of pause before every record, which effects
    alone see. The forward model is not limited to `input_range`, the inverse and every `arithmetic` are. Raises
    NotInvertibleError, FormatError, EffectsError and UnsupportedEffectsError.
    """
    if operator == "inverse":
        model.inverse()
    if model.effects and arithmetic is None and operator == "inverse":
        return _compensated(model, records, history, rest)
    if model.effects and arithmetic is None:
        runs = [model.run(record.v, record.t, record.extra, rest=rest) for record in records]
        answers = model.chain.simulate(runs, history)
        ends = model.cascade.input_range
        return [(y, _outside(r.name, ends, r.v, False)) for r, y in zip(records, answers, strict=True)]
    if model.effects:
        return [_emulated(model, records, operator, arithmetic)]
    session = model.session(operator, arithmetic, engine, clamp=operator == "inverse")
    moved = model.session() if operator == "inverse" and arithmetic is None else None
    for each in (session, moved):
        if each is not None and history:
            each.visit(history)
    found = []
    for record in records:
        signal = record.columns()["v" if operator == "forward" else "u"]
        samples, status = session.run(signal)
        if operator == "forward":
            limited = bool(np.any(status & slots.INPUT_CLAMPED))
            found.append((samples, _outside(record.name, session.drive_range, signal, limited)))
            continue
        missed = np.ones(len(samples), dtype=bool)
        if moved is not None:  # the bit reference says what the C says
            reached = model.cascade.output_range
            missed = np.abs(moved.run(samples)[0] - signal) > LIMITED * (reached[1] - reached[0])
        found.append((samples, _remarks(record.name, status, missed)))
    return found


def _emulated(
    model: Model, records: Sequence[Record], operator: str, arithmetic: str | None
) -> tuple[NDArray[Any], list[str]]:
    """Answers of the bit reference of a model with effects, which takes one record, and no remarks."""
    if len(records) > 1:
        raise EffectsError("the bit reference of a model with effects takes one record; simulate them one by one")
    (record,) = records
    signal = record.columns()["v" if operator == "forward" else "u"]
    run = model.simulate if operator == "forward" else model.inverse().simulate
    return run(signal, arithmetic, t=record.t, extra=record.extra), []


def _compensated(
    model: Model, records: Sequence[Record], history: Sequence[float], rest: float
) -> list[tuple[NDArray[Any], list[str]]]:
    """Drives for the references of records that are one session, of a model with effects."""
    runs = [model.run(record.columns()["u"], record.t, record.extra, rest=rest) for record in records]
    session = join(runs, history)
    asked = np.zeros(len(session.run.t), dtype=bool)
    for part in session.parts:
        asked[part] = True
    drives, limited = model.compensator.limited_drives(session.run, model.cascade.input_range, asked)
    return [
        (drives[part], _counted(record.name, limited[part], *DRIVES))
        for record, part in zip(records, session.parts, strict=True)
    ]


def _outside(name: str, ends: tuple[float, float], signal: NDArray[np.float64], limited: bool) -> list[str]:
    """A sentence about drives outside the range, if there are any."""
    outside = int(np.count_nonzero((signal < ends[0]) | (signal > ends[1])))
    how = "limited to it" if limited else "extrapolated, not limited"
    said = f"{name}: {outside} of {len(signal)} samples lie outside input_range {ends[0]:g} to {ends[1]:g}, {how}"
    return [said] if outside else []


REFERENCES = (
    "references", "lies outside the output range and was limited", "lie outside the output range and were limited",
)  # fmt: skip
DRIVES = "drives", "was limited to input_range", "were limited to input_range"
"""What is counted, and how one of them and several are spoken of."""


def _remarks(name: str, status: Bytes, missed: NDArray[np.bool_]) -> list[str]:
    """What a user should know about the drives of a record, one sentence each.

    `missed` (N,): references that the drives miss by more than rounding; where none is missed, none was limited.
    """
    return [
        said
        for bit, words in ((slots.INPUT_CLAMPED, REFERENCES), (slots.OUTPUT_CLAMPED, DRIVES))
        for said in _counted(name, (status & bit != 0) & missed, *words)
    ]


def _counted(name: str, limited: NDArray[np.bool_], things: str, one: str, several: str) -> list[str]:
    """A sentence about how many were limited, if any were."""
    count = int(np.count_nonzero(limited))
    return [f"{name}: {count} of {len(limited)} {things} {one if count == 1 else several}"] if count else []
