"""Run a model on sampled signals, in double precision or as the bit-exact reference for an arithmetic."""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np

from hystgen.arithmetic import FIXED
from hystgen.basics.problems import EffectsError, RecordError
from hystgen.chain.chain import join
from hystgen.compensator import remarks
from hystgen.model import Answers, Model
from hystgen.records import Record, in_units
from hystgen.records.units import quantity

SIGNALS = {"forward": ("v", "y"), "inverse": ("u", "v")}
"""Column that each operator takes, and the one it answers with."""


def simulate_records(
    model: Model, records: Sequence[Record], operator: str = "forward", arithmetic: str | None = None,
    engine: str | None = None, history: Sequence[float] = (), rest: float = 0.0,
) -> list[Answers]:
    """Outputs of the model (for column v) or its inverse (for column u) over the records of one session, with remarks.

    `history`: drives visited before the first record; `rest`: pause in s before every record, which matters only to
    effects. Records in other units of the same quantity are converted to the model's units; see `in_numbers_of`. The
    forward model is not limited to `input_range`; the inverse and every `arithmetic` are. Raises NotInvertibleError,
    FormatError, EffectsError, UnsupportedEffectsError and RecordError.
    """
    converted = in_numbers_of(model, records, operator, arithmetic)
    found = _simulated(model, converted, operator, arithmetic, engine, history, rest)
    notes = [new.notes[len(old.notes) :] for old, new in zip(records, converted, strict=True)]
    return [
        (answers, [*_of(record.name, said), *more])
        for record, said, (answers, more) in zip(converted, notes, found, strict=True)
    ]


def in_numbers_of(
    model: Model, records: Sequence[Record], operator: str, arithmetic: str | None, sources: Sequence[object] = ()
) -> list[Record]:
    """The records with the operator's signal in the model's units; in fixed point it has to consist of codes.

    `sources`: the records as given, for messages. Raises RecordError for a signal in another quantity, and in fixed
    point for one in a physical unit, which would pass for codes.
    """
    signal, _ = SIGNALS[operator]
    if arithmetic not in FIXED:
        return in_units(records, model.parameters.units, need=(signal,), sources=sources)
    lsb = f"{model.name.upper()}_{'DRIVE' if signal == 'v' else 'OUTPUT'}_LSB"
    problems = []
    for k, record in enumerate(records):
        unit, source = record.units.get(signal, ""), sources[k] if k < len(sources) else None
        if quantity(unit, signal) is not None:
            place = os.fspath(source) if isinstance(source, str | os.PathLike) else record.name
            problems.append(
                f"{place}: error: column {signal} is in {unit}, but {arithmetic} takes codes; divide it by {lsb} of "
                "the emitted header, round, and leave out the unit"
            )
    if problems:
        raise RecordError(problems)
    return in_units(records, need=(), sources=sources)


def _simulated(
    model: Model, records: Sequence[Record], operator: str, arithmetic: str | None, engine: str | None,
    history: Sequence[float], rest: float,
) -> list[Answers]:
    """`simulate_records` for records that are already in the model's units."""
    if operator == "inverse":
        model.inverse()
    if model.effects and arithmetic is None and operator == "inverse":
        return _compensated(model, records, history, rest)
    if model.effects and arithmetic is None:
        runs = [model.run(record.v, record.t, record.extra, rest=rest) for record in records]
        answers = model.chain.simulate(runs, history)
        ends = model.cascade.input_range
        return [(y, _of(r.name, remarks.forward(r.v, ends, False))) for r, y in zip(records, answers, strict=True)]
    if model.effects:
        return [_emulated(model, records, operator, arithmetic)]
    session = model.session(operator, arithmetic, engine, clamp=operator == "inverse")
    moved = model.session() if operator == "inverse" and arithmetic is None else None
    for each in (session, moved):
        if each is not None and history:
            each.visit(history)
    found = []
    for record in records:
        signal = record.columns()[SIGNALS[operator][0]]
        samples, said = remarks.run(session, signal, moved)
        found.append((samples, _of(record.name, said)))
    return found


def _emulated(
    model: Model, records: Sequence[Record], operator: str, arithmetic: str | None
) -> Answers:
    """Output of the bit-exact reference for a model with effects, which takes a single record, and remarks."""
    if len(records) > 1:
        raise EffectsError("the bit-exact reference of a model with effects takes one record; simulate them one by one")
    (record,) = records
    signal = record.columns()[SIGNALS[operator][0]]
    run = model.answers if operator == "forward" else model.inverse().answers
    answers, said = run(signal, arithmetic, t=record.t, extra=record.extra)
    return answers, _of(record.name, said)


def _compensated(
    model: Model, records: Sequence[Record], history: Sequence[float], rest: float
) -> list[Answers]:
    """Drives from the inverse of a model with effects for the references of one session's records, and remarks."""
    runs = [model.run(record.columns()["u"], record.t, record.extra, rest=rest) for record in records]
    session = join(runs, history)
    low, high = ends = model.cascade.input_range
    asked = np.zeros(len(session.run.t), dtype=bool)
    for part in session.parts:
        asked[part] = True
    drives, beyond = model.compensator.answers(session.run, ends, asked)
    outside = model.outside(session.run) & asked
    limited = beyond > remarks.ROUNDED * (high - low)
    return [
        (drives[part], _of(record.name, remarks.compensated(outside[part], limited[part])))
        for record, part in zip(records, session.parts, strict=True)
    ]


def _of(name: str, said: Sequence[str]) -> list[str]:
    return [f"{name}: {text}" for text in said]
