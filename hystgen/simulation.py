"""Run a model on sampled signals, in double precision or as the bit-exact reference for an arithmetic."""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystgen.arithmetic import FIXED
from hystgen.basics.problems import EffectsError, RecordError, counted
from hystgen.chain.chain import join
from hystgen.compensator import remarks
from hystgen.compensator.chain.parts import Parts
from hystgen.model import Answers, Model
from hystgen.records import Record, in_units
from hystgen.records.units import quantity

SIGNALS = {"forward": ("v", "y"), "inverse": ("u", "v")}
"""Column that each operator takes, and the one it answers with."""

AT_LIMIT = 0.999
"""[fraction of a slew limit] A drive at least this fast counts as held back by it. In float32 a drive of 100 V every
50 us is rounded by 0.15 V/s, 0.05 % of a limit of 333 V/s. Set by: tests/test_simulation.py."""


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


def units_of(model: Model, operator: str, arithmetic: str | None) -> tuple[str, str]:
    """Units of the signal that an operator takes and of its answers; fixed point takes and gives codes."""
    units = model.parameters.units
    ends = (units.input, units.output) if arithmetic not in FIXED else ("codes", "codes")
    return ends if operator == "forward" else ends[::-1]


def pace(t: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rate of change (N-1,) of a signal from each sample to the next, per second."""
    return np.asarray(np.diff(x) / np.diff(t), dtype=np.float64)


def slew_limits(model: Model) -> list[tuple[float, float]]:
    """Fastest rise and fastest fall of the drive at the amplifier, input units per second, per slew limit."""
    return [(each.rate, each.falling_rate) for each in Parts.of(model.effects).slew]


def motion(model: Model, record: Record, drives: ArrayLike, arithmetic: str | None) -> tuple[str, list[str]]:
    """How far and how fast a reference and the inverse's drives (N,) for it move, and a sentence per limit exceeded.

    `record`: the reference, column u, in the model's units. The limits are the slew rate of the model's amplifier and
    `emit.compensation.max_rate`; those of the ranges are among the remarks of `simulate_records`.
    """
    said, v = [f"{record.name}: {_counted(record)}"], np.asarray(drives, dtype=np.float64)
    reference, drive = units_of(model, "inverse", arithmetic)
    reference = reference or record.units.get("u", "")
    for what, x, unit in (("reference", record.columns()["u"], reference), ("drive", v, drive)):
        span = f"{what} {np.min(x):.6g} to {np.max(x):.6g} {unit}".rstrip()
        fastest = f", at most {np.max(np.abs(pace(record.t, x))):.4g} {unit or 'units'}/s" if len(x) > 1 else ""
        said.append(span + fastest)
    return "; ".join(said), [] if arithmetic in FIXED else _of(record.name, _limits(model, pace(record.t, v)))


def _counted(record: Record) -> str:
    """Number of samples of a record, their rate and its length."""
    if len(record) < 2 or not record.timed:
        return counted(len(record), "sample")
    seconds = float(record.t[-1] - record.t[0])
    return f"{counted(len(record), 'sample')} at {1.0 / record.sample_time:.6g} Hz, {seconds:.6g} s"


def _limits(model: Model, rates: NDArray[np.float64]) -> list[str]:
    """Sentences on drive rates (N-1,) at the slew limit of the amplifier, or beyond that of the error bounds."""
    unit = model.parameters.units.input or "units"
    said = []
    for up, down in slew_limits(model):
        if number := int(np.count_nonzero(np.maximum(rates / up, -rates / down) > AT_LIMIT)):
            limit = f"{up:.4g}" if up == down else f"{up:.4g} up and {down:.4g} down"
            said.append(
                f"{number} of {len(rates)} moves of the drive are at the amplifier's slew limit, {limit} {unit}/s, and "
                "the motion falls behind the reference; move more slowly"
            )
    bound = model.parameters.emit.compensation.max_rate
    if bound is not None and (number := int(np.count_nonzero(np.abs(rates) > bound))):
        said.append(
            f"{number} of {len(rates)} moves of the drive are faster than emit.compensation.max_rate, {bound:.4g} "
            f"{unit}/s, up to which the error bounds of the C hold; move more slowly, or raise it"
        )
    return said


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
    limited_run, outside = model.limited(session.run, asked)
    drives, beyond = model.compensator.answers(limited_run, ends, asked)
    limited = beyond > remarks.ROUNDED * (high - low)
    return [
        (drives[part], _of(record.name, remarks.compensated(outside[part], limited[part])))
        for record, part in zip(records, session.parts, strict=True)
    ]


def _of(name: str, said: Sequence[str]) -> list[str]:
    return [f"{name}: {text}" for text in said]
