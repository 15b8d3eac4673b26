"""Models side by side on records: how far each is from the measured motion, and whether the records tell them apart."""

from __future__ import annotations

import json
import os
import shlex
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hystgen.basics import arguments, display
from hystgen.basics.presented import Presented
from hystgen.basics.problems import EffectsError, FormatError, NotInvertibleError, RecordError, counted, percent
from hystgen.diagnosis.data import preparing
from hystgen.diagnosis.data.items import Item, rms
from hystgen.diagnosis.data.signals import noise_floor
from hystgen.diagnosis.search import acceptance, selection
from hystgen.diagnosis.search.hypothesis import NotFiniteError
from hystgen.identification import quality
from hystgen.identification.fit import visited
from hystgen.model import Model, ModelSource, as_model
from hystgen.records import Source, in_units, read_records, several
from hystgen.records.units import conversion

if TYPE_CHECKING:
    from hystgen.parameters.schema import Units

Array = NDArray[np.float64]

LINE = "straight line"
"""The name of the baseline: output as a linear function of the drive, its slope fitted to these records."""

CORE = "cortex-m4f"
"""The core for which the cost of the C is shown."""

PLAIN = 7
"""Number of columns of the table before the cost of the C."""


@dataclass(frozen=True)
class CostOfC:
    """Cost of the emitted C on a Cortex-M4F: `instructions` of the most expensive sample, bytes of `flash` and of
    `ram`."""

    instructions: int
    flash: int
    ram: int


@dataclass(frozen=True)
class Deviation:
    """A model's deviations from the records: measured minus model (N,) per record, NaN where not compared.

    `effects`: names of its effects; `cost`: of its C, None for the straight line and where `emit` refuses the model;
    `refused`: why it does.
    """

    name: str
    effects: tuple[str, ...]
    errors: tuple[Array, ...] = field(repr=False, compare=False)
    cost: CostOfC | None = None
    refused: str = ""

    @property
    def rms(self) -> float:
        """rms deviation over all records, output units."""
        return rms(list(self.errors))

    @property
    def most(self) -> float:
        """Largest deviation, output units."""
        return max(float(np.nanmax(np.abs(e))) for e in self.errors if np.isfinite(e).any())


@dataclass(frozen=True)
class Compared:
    """A record as it was compared: time (s), drive and measured output (N,)."""

    name: str
    t: Array = field(repr=False, compare=False)
    v: Array = field(repr=False, compare=False)
    y: Array = field(repr=False, compare=False)


@dataclass(frozen=True, repr=False)
class Comparison(Presented):
    """Models side by side: `line`, the baseline, and `models`, the closest to the records first.

    `noise`: rms of the records' noise; `output_range`: the 100 % of the percentages; both in output units. `notes`:
    what was done to the records. The picture shows the deviations over time, on one scale.
    """

    unit: str
    records: tuple[Compared, ...]
    line: Deviation
    models: tuple[Deviation, ...]
    noise: float
    output_range: float
    notes: tuple[str, ...] = ()
    drive_unit: str = ""

    FILES = ("comparison.json", "report.html", "deviations.svg")

    def __repr__(self) -> str:
        return f"<Comparison of {counted(len(self.models), 'model')} on {counted(len(self.records), 'record')}>"

    def _repr_html_(self) -> str:
        return display.block(repr(self), self.sentence(), self.draw, self.rows())

    def rows(self) -> list[tuple[str, ...]]:
        """The table: a header, the straight line, and the models; columns without any figure are left out."""
        unit = f" [{self.unit}]" if self.unit else ""
        head = (
            "model", "effects", f"rms{unit}", "rms %", f"max{unit}", "max %", "times noise", "instr.", "flash", "RAM"
        )
        found: list[tuple[str, ...]] = [head]
        for each in (self.line, *self.models):
            costs = ("",) * 3 if each.cost is None else tuple(map(str, vars(each.cost).values()))
            whole = 100.0 / self.output_range
            errors = [text for x in (each.rms, each.most) for text in (f"{x:.4g}", f"{whole * x:.3f}")]
            found.append((each.name, ", ".join(each.effects) or "-", *errors, f"{each.rms / self.noise:.3g}", *costs))
        kept = [k for k in range(len(head)) if any(row[k] for row in found[1:])]
        return [tuple(row[k] for k in kept) for row in found]

    def table(self) -> str:
        """The table that the command prints, and the verdict."""
        rows = self.rows()
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        lines = [
            "  ".join(cell.ljust(width) if k < 2 else cell.rjust(width) for k, (cell, width) in
                      enumerate(zip(row, widths, strict=True))).rstrip()
            for row in rows
        ]
        of = ", ".join(each.name for each in self.records)
        below = [
            f"Measured minus model on {of}; noise {self.noise:.3g}{self._u} rms; "
            f"100 % are {self.output_range:.4g}{self._u}."
        ]
        if len(rows[0]) > PLAIN:
            cost = "instructions of the most expensive sample; bytes of flash and of RAM"
            below.append(f"C, estimated for a {CORE}: {cost}.")
        below += [f"{each.name} has no C yet: {each.refused}." for each in self.models if each.refused]
        return "\n".join([*lines, *below, self.sentence()])

    @property
    def _u(self) -> str:
        return f" {self.unit}" if self.unit else ""

    def tie(self, other: Deviation) -> str:
        """Why the records do not tell another model from the closest one; empty if they do."""
        best = self.models[0]
        if not other.rms > (1.0 + acceptance.EQUAL) * best.rms:
            return f"their rms deviations differ by less than {100.0 * acceptance.EQUAL:g} %"
        if acceptance.apart(other.rms, best.rms) < acceptance.FIRST_REMOVES * self.noise:
            return "the difference is within the noise"
        p_value = selection.difference(other.errors, best.errors)
        if p_value > acceptance.P_DIFFERENT:
            return f"the difference may be chance, p = {p_value:.1g}"
        return ""

    @property
    def tied(self) -> tuple[Deviation, ...]:
        """The models that the records do not tell from the closest one."""
        return tuple(each for each in self.models[1:] if self.tie(each))

    def sentence(self) -> str:
        """Which model is closest, which others cannot be told from it, and whether it is of any use."""
        best, tied = self.models[0], self.tied
        noise = acceptance.is_noise(best.rms, self.noise)
        left = f"{best.rms:.4g}{self._u} rms, {percent(best.rms / self.output_range, of='the output range')}"
        left += ", no more than noise" if noise else ""
        if tied:
            names = " and ".join([", ".join([best.name, *(each.name for each in tied[:-1])]), tied[-1].name])
            why = "; ".join(dict.fromkeys(map(self.tie, tied)))
            said = [f"{names} cannot be told apart on these records: {why}"]
            others = [each for each in self.models[1:] if each not in tied]
            if others:
                said.append(f"They are closer than {_listed(others)}")
        elif len(self.models) > 1:
            second = self.models[1]
            said = [f"{best.name} is the closest: {left}; {second.name}, the next, leaves {second.rms / best.rms:.3g} "
                    "times as much"]
        else:
            said = [f"{best.name} leaves {left}"]
        if not best.rms < self.line.rms:
            said.append("No model is closer than a straight line")
        elif tied and noise:
            said.append("They leave no more than noise")
        return " ".join(f"{each}." for each in said)

    def next_step(self) -> tuple[str, str]:
        """What to do with the closest model, and its command; empty if no model is closer than a straight line."""
        best = self.models[0]
        if not best.rms < self.line.rms:
            return "", ""
        file = shlex.quote(best.name if best.name.endswith((".yaml", ".yml")) else "params.yaml")
        first = f"once {best.name} has what its C needs (see above), " if best.refused else ""
        return f"{first}write the compensator as C", f"hystgen emit {file} -o firmware/"

    def content(self) -> dict[str, object]:
        """The comparison as plain data for JSON."""

        def entry(each: Deviation) -> dict[str, object]:
            whole = 100.0 / self.output_range
            ranged = {"rms_percent": whole * each.rms, "max_percent": whole * each.most}
            by_record = {r.name: rms([e]) for r, e in zip(self.records, each.errors, strict=True)}
            cost = None if each.cost is None else dict(vars(each.cost))
            return {
                "name": each.name, "effects": list(each.effects), "rms": each.rms, "max": each.most, **ranged,
                "times_noise": each.rms / self.noise, "records": by_record, "cost": cost,
            }

        tied = [self.models[0].name, *(each.name for each in self.tied)]
        return {
            "hystgen": 1, "unit": self.unit, "noise_floor": self.noise, "output_range": self.output_range,
            "records": [each.name for each in self.records], "straight_line": entry(self.line),
            "models": [entry(each) for each in self.models], "closest": tied, "sentence": self.sentence(),
            "notes": list(self.notes),
        }

    def to_json(self) -> str:
        """The comparison for programs."""
        return json.dumps(_in_digits(self.content()), indent=2, allow_nan=False) + "\n"


def _listed(models: Sequence[Deviation]) -> str:
    names = [each.name for each in models]
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _in_digits(value: object) -> object:
    """The value with floating-point numbers rounded to eight digits, so that the same input gives the same text."""
    if isinstance(value, Mapping):
        return {key: _in_digits(each) for key, each in value.items()}
    if isinstance(value, list):
        return list(map(_in_digits, value))
    return float(f"{value:.8g}") if isinstance(value, float) else value


@arguments.checked
def compare(
    models: ModelSource | Iterable[ModelSource],
    holdout: Source | Iterable[Source],
    *,
    names: Sequence[str] = (),
    history: Sequence[float] | None = None,
    rest: float = 0.0,
    skip: float = 0.0,
    columns: dict[str, str] | None = None,
    sample_time: float | None = None,
    delimiter: str | None = None,
    progress: bool = False,
) -> Comparison:
    """Models side by side on records that took no part in their fits.

    `models`: models, parameter files, or results that have a model; `holdout`: measured records, as for `diagnose`, and
    in the units of the first model, to which everything is converted. The only quantities fitted are those that no
    model can know: the offset of each record and, without `history`, its start state. The straight line, the baseline,
    has one slope for all records. `names`: of the models, by default their paths or their own names; `history`, `rest`,
    `skip`: as for `diagnose`.

    Raises RecordError, ParameterError, EffectsError, IdentificationError for too few samples, ValueError, TypeError.
    """
    sources: list[ModelSource] = [models] if _single(models) else list(models)  # type: ignore[list-item, arg-type]
    if not sources:
        raise ValueError("there is no model to compare")
    loaded = [as_model(each) for each in sources]
    given = several(holdout)
    if not given:
        raise ValueError("there is no record to compare the models on")
    arguments.number("rest", rest, "seconds", 0.0)
    arguments.number("skip", skip, "seconds", 0.0)
    read = read_records(given, columns, sample_time, delimiter, progress=progress, points=True)
    named = arguments.words("names", names, "plain") or _names(sources, loaded)
    if len(named) != len(loaded):
        raise ValueError(f"{counted(len(loaded), 'model')} need as many names, not {len(named)}")
    units = loaded[0].parameters.units
    for name, model in zip(named, loaded, strict=True):
        _check_units(name, model.parameters.units, named[0], units)
    read = in_units(read, units, sources=given)
    before = None if history is None else visited(history)
    items, notes = preparing.to_judge(read, before, rest, skip)
    compared = [item for item in items if item.known.any()]
    if not compared:
        raise RecordError([f"{read[0].name}: error: no sample can be compared; give --history, or another record"])
    rows = []
    for name, model in zip(named, loaded, strict=True):
        theirs = model.parameters.units
        drive, output = _factor(units.input, theirs.input, "v"), _factor(units.output, theirs.output, "y")
        own = [_scaled(item, drive, output) for item in compared]
        rows.append(_deviation(name, model, own, 1.0 / output))
        notes += [note for item in own if (note := _outside(name, model, item))]
    line = Deviation(LINE, (), tuple(_off_line(compared)))
    notes = [*(f"{record.name}: {note}" for record in read for note in record.notes), *notes]
    return Comparison(
        units.output, tuple(Compared(item.name, item.run.t, item.run.v, item.y) for item in compared), line,
        tuple(sorted(rows, key=lambda each: each.rms)), noise_floor(compared).rms,
        max(float(np.ptp(item.y[item.known])) for item in compared), tuple(dict.fromkeys(notes)),
        units.input,
    )


def _single(models: object) -> bool:
    return isinstance(models, str | os.PathLike | Model) or hasattr(models, "model")


def _names(sources: Sequence[object], models: Sequence[Model]) -> Sequence[str]:
    """A name for each model: its path, or else its own; with a number if names repeat."""
    found = [
        os.fspath(source) if isinstance(source, str | os.PathLike) else model.name
        for source, model in zip(sources, models, strict=True)
    ]
    counts, seen = Counter(found), Counter[str]()
    for k, name in enumerate(found):
        if counts[name] > 1:
            seen[name] += 1
            found[k] = f"{name} ({seen[name]})"
    return found


def _check_units(name: str, own: Units, first: str, units: Units) -> None:
    """Raise ValueError if a model's units are of other quantities than those of the first model."""
    for key, column, what in (("input", "v", "drive"), ("output", "y", "output")):
        one, other = getattr(own, key), getattr(units, key)
        if one and other and conversion(one, other, column) is None:
            raise ValueError(
                f"{name} has its {what} in {one} and {first} in {other}, which are different quantities; compare "
                "models of one actuator, or correct the units in the parameter file"
            )


def _factor(unit: str, to: str, column: str) -> float:
    """The factor from one unit to another of the same quantity; 1 if either is not given."""
    how = conversion(unit, to, column) if unit and to else None
    return 1.0 if how is None else float(how.times)


def _scaled(item: Item, drive: float, output: float) -> Item:
    """An item in new units; the old ones are `drive` and `output` times as large."""
    if drive == output == 1.0:
        return item

    def driven(values: tuple[float, ...] | None) -> tuple[float, ...] | None:
        return None if values is None else tuple(drive * v for v in values)

    return replace(
        item, run=replace(item.run, v=drive * item.run.v), y=output * item.y, history=driven(item.history),
        output_range=output * item.output_range, turns=driven(item.turns),
        session=None if item.session is None else replace(item.session, v=drive * item.session.v),
    )


def _deviation(name: str, model: Model, items: Sequence[Item], factor: float) -> Deviation:
    """The deviations of a model from the items, times `factor`. Raises EffectsError, naming the model."""
    try:
        model.chain.require_columns([item.run for item in items])
        timed = all(each.timed for each in items)
        untimed = [effect.name for effect in model.effects if effect.needs_time and not timed]
        if untimed:
            raise EffectsError(f"{untimed[0]} needs time, and not every record has one; give --sample-time")
        fitted = selection.as_given(model.cascade, model.effects)
        errors = tuple(factor * error for error in fitted.errors(items))
    except EffectsError as error:
        raise EffectsError(f"{name}: {error}") from None
    except NotFiniteError:
        raise EffectsError(f"{name}: an effect gives no finite output on these records") from None
    names = tuple(dict.fromkeys(effect.name for effect in model.effects))
    return Deviation(name, names, errors, *_cost(model))


def _cost(model: Model) -> tuple[CostOfC | None, str]:
    """Cost of the C that `emit` would write; None with the reason if it refuses the model."""
    from hystgen.emission import calls, module

    try:
        operator = "forward" if model.cascade.inverse_problems() else None
        options = calls.emit_options(model, operator=operator)
        found = module.of(model, options).cost
    except (FormatError, EffectsError, NotInvertibleError) as failure:
        return None, str(failure)
    which, ram = found.memory.instances[0]
    return CostOfC(found.dearest[which][CORE].instructions, found.code[CORE] + found.memory.tables, ram), ""


def _outside(name: str, model: Model, item: Item) -> str:
    said = quality.outside(item.name, item.run.v, model.cascade.input_range)
    return said and f"{name}: {said}"


def _off_line(items: Sequence[Item]) -> list[Array]:
    """Deviations from a straight line with one slope for all items and an offset for each."""
    centred = [(item.run.v - np.mean(item.run.v[item.known]), item.y - np.mean(item.y[item.known])) for item in items]
    over = sum(float(v[item.known] @ y[item.known]) for item, (v, y) in zip(items, centred, strict=True))
    under = sum(float(v[item.known] @ v[item.known]) for item, (v, _) in zip(items, centred, strict=True))
    return [y - (over / under if under else 0.0) * v for v, y in centred]
