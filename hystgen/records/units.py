"""Column units: comparison of quantities, and conversion of records to the units of a model.

Lengths, voltages and so on are converted by their SI prefixes, temperatures by scale and zero. The meaning of an
unknown unit is never guessed; it is only compared as text.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hystgen.basics.names import MAX_UNIT
from hystgen.basics.problems import RecordError, printable
from hystgen.records.columns import TIMES, plain
from hystgen.records.record import Array, Record

if TYPE_CHECKING:
    from hystgen.parameters.schema import Units

TEMPERATURE = "temperature"
"""The column that effects expect in degC."""

PREFIXES = {"f": -15, "p": -12, "n": -9, "u": -6, "m": -3, "c": -2, "d": -1, "": 0, "k": 3, "M": 6, "G": 9}
WORDS = {"pico": -12, "nano": -9, "micro": -6, "milli": -3, "centi": -2, "": 0, "kilo": 3, "mega": 6}
"""Prefixes and their powers of ten, for symbols and for whole words."""

_DEGREE = Fraction(math.pi) / 180
_OERSTED = Fraction(1000) / (4 * Fraction(math.pi))

SYMBOLS: dict[str, tuple[str, Fraction]] = {
    **{
        symbol: (symbol, Fraction(1))
        for symbol in ("m", "V", "A", "N", "rad", "T", "Hz", "Pa", "W", "J", "F", "C", "Ohm", "g", "strain", "A/m", "K")
    },
    "deg": ("rad", _DEGREE),
    "\u2126": ("Ohm", Fraction(1)), "\u03a9": ("Ohm", Fraction(1)), "bar": ("Pa", Fraction(10**5)),
    "Oe": ("A/m", _OERSTED),
}
"""Symbols that take a prefix, each with its quantity and its size in the base unit that names the quantity."""

ALONE: dict[str, tuple[str, Fraction]] = {
    "\u00b0": ("rad", _DEGREE), "degree": ("rad", _DEGREE), "degrees": ("rad", _DEGREE),
    "arcmin": ("rad", _DEGREE / 60), "arcsec": ("rad", _DEGREE / 3600), "micron": ("m", Fraction(1, 10**6)),
    "microns": ("m", Fraction(1, 10**6)), "\u00c5": ("m", Fraction(1, 10**10)), "\u212b": ("m", Fraction(1, 10**10)),
    "gauss": ("T", Fraction(1, 10**4)),
    **{unit: ("s", Fraction(factor) / Fraction(divisor)) for unit, (factor, divisor) in TIMES.items()},
}
"""Units that take no prefix; words are in lower case."""

NAMES = {
    "volt": "V", "ampere": "A", "amp": "A", "meter": "m", "metre": "m", "newton": "N", "radian": "rad", "tesla": "T",
    "pascal": "Pa", "hertz": "Hz", "kelvin": "K", "oersted": "Oe",
}
"""Whole words and their symbols, in the singular."""

_ZERO = Fraction("273.15")
TEMPERATURES = {
    **dict.fromkeys(("K", "kelvin"), (Fraction(1), Fraction(0))),
    **dict.fromkeys(("degC", "deg C", "\u00b0C", "\u2103", "celsius", "C"), (Fraction(1), _ZERO)),
    **dict.fromkeys(
        ("degF", "deg F", "\u00b0F", "\u2109", "fahrenheit", "F"), (Fraction(5, 9), _ZERO - Fraction(160, 9))
    ),
}
"""Size in K, and the temperature in K at 0. C and F are temperatures only in a temperature column."""


class Quantity(NamedTuple):
    """A unit's quantity: `kind`, named by its base unit, with the unit's `size` and `zero` in that base unit."""

    kind: str
    size: Fraction
    zero: Fraction = Fraction(0)


def quantity(unit: str, column: str = "") -> Quantity | None:
    """The quantity of a unit in a column; None for an unknown unit."""
    text = plain(unit)
    if text[:1] + text[-1:] in ("[]", "()"):
        text = plain(text[1:-1])
    word = text.casefold() if len(text) > 2 else text
    for spelled in (text, word):
        if spelled in TEMPERATURES and (len(spelled) > 1 or column == TEMPERATURE):
            return Quantity("K", *TEMPERATURES[spelled])
        if spelled in ALONE:
            return Quantity(*ALONE[spelled])
    singular = word.removesuffix("s")
    for name, symbol in NAMES.items():
        if singular.endswith(name) and singular.removesuffix(name) in WORDS:
            kind, size = SYMBOLS[symbol]
            return Quantity(kind, size * Fraction(10) ** WORDS[singular.removesuffix(name)])
    for symbol, (kind, size) in SYMBOLS.items():
        if text.endswith(symbol) and text.removesuffix(symbol) in PREFIXES:
            return Quantity(kind, size * Fraction(10) ** PREFIXES[text.removesuffix(symbol)])
    return None


class Conversion(NamedTuple):
    """Conversion of numbers from one unit to another: `times` the number, then `plus`."""

    times: Fraction
    plus: Fraction = Fraction(0)

    def __call__(self, x: Array) -> Array:
        """The numbers (N,) in the other unit; with a power of ten, each is the double nearest to the exact value."""
        top, bottom = self.times.numerator, self.times.denominator
        found: Array = x / bottom if top == 1 else x * float(top if bottom == 1 else self.times)
        return found + float(self.plus) if self.plus else found

    @property
    def same(self) -> bool:
        """Whether the conversion changes nothing."""
        return self == Conversion(Fraction(1))


def conversion(unit: str, to: str, column: str = "") -> Conversion | None:
    """Conversion from `unit` to `to`; None if their quantities differ, or are not known to be the same.

    If either unit is unknown, they count as the same if their texts match, ignoring case.
    """
    a, b = quantity(unit, column), quantity(to, column)
    if a is not None and b is not None:
        return Conversion(a.size / b.size, (a.zero - b.zero) / b.size) if a.kind == b.kind else None
    return Conversion(Fraction(1)) if plain(unit).casefold() == plain(to).casefold() else None


class UnitGoal(NamedTuple):
    """The target unit for the drive or the displacement of records.

    `unit`: empty if the first record with a unit decides; `whose`: the quantity's name in messages; `named`: given by
    the user, who thereby declares the meaning of an unknown unit; `told`: whether to report that a record decided it.
    """

    unit: str = ""
    whose: str = ""
    named: bool = False
    told: bool = False


QUANTITIES = {"input": "drive", "output": "output"}
"""Keys of a parameter file's `units`, and the quantity each belongs to."""

KEYS = {"v": "input", "y": "output", "u": "output"}
"""Columns and their keys in a parameter file's `units`."""


def wanted(
    model: Units | None, file: tuple[str, Mapping[str, str]], named: tuple[str, Mapping[str, str]]
) -> dict[str, UnitGoal]:
    """Target units for `input` and `output`: the user's, else the file's, else the model's."""
    found: dict[str, UnitGoal] = {}
    for key, quantity in QUANTITIES.items():
        if model is not None:
            found[key] = UnitGoal(getattr(model, key), f"the model's {quantity}", told=True)
        for of, units, by_user in ((f"in {file[0]}", file[1], False), (f"of {named[0]}", named[1], True)):
            if units.get(key):
                found[key] = UnitGoal(units[key], f"the {quantity} {of}", by_user)
    return found


def converted(
    records: Sequence[Record], goals: Mapping[str, UnitGoal], need: Sequence[str], sources: Sequence[object],
    option: str,
) -> list[Record]:
    """The records in the units of `goals`; see `hystgen.records.in_units`."""
    taken = dict(goals)
    problems: list[str] = []
    found = []
    for k, record in enumerate(records):
        source = sources[k] if k < len(sources) else None
        place = os.fspath(source) if isinstance(source, str | os.PathLike) else record.name
        columns, units, notes = {}, dict(record.units), []
        for column, numbers in record.columns().items():
            own = record.units.get(column, "")
            key = KEYS[column] if column in KEYS and column in need else ""
            if not own or len(own) > MAX_UNIT or not own.isprintable() or not (key or column == TEMPERATURE):
                continue
            goal = taken.get(key, UnitGoal()) if key else UnitGoal("degC", "a temperature", named=True)
            if not goal.unit:
                said = f"{goal.whose} has no unit; it was assumed to be in {own}, as column {column} is"
                notes += [said] if goal.told and said not in record.notes else []
                taken[key] = UnitGoal(own, f"column {column} of {printable(record.name)}")
                continue
            how = conversion(own, goal.unit, column)
            if how is None and goal.named and (not key or quantity(own) is None):
                notes.append(f"{_named(column, own)} was taken as {goal.unit}, the unit of {goal.whose}")
            elif how is None:
                problems.append(f"{place}: error: {_apart(column, own, goal, option)}")
            elif not how.same:
                columns[column] = how(numbers)
                times = np.format_float_positional(float(how.times), 6, fractional=False, trim="-")
                equal = "" if how.plus else f": 1 {own} is {times} {goal.unit}"
                notes.append(f"{_named(column, own)} was converted to {goal.unit}{equal}")
            units[column] = goal.unit
        found.append(_with(record, columns, units, notes))
    if problems:
        raise RecordError(problems)
    return found


def _named(column: str, unit: str) -> str:
    return f"column {column} [{printable(unit)}]"


def _apart(column: str, own: str, goal: UnitGoal, option: str) -> str:
    """The message saying that a column cannot be converted to the target unit, and advice."""
    said = f"column {column} is in {own} and {goal.whose} in {goal.unit}"
    strange = [unit for unit in (own, goal.unit) if quantity(unit, column) is None]
    if not strange:
        return f"{said}, which are different quantities; choose another column, or correct the unit after its name"
    more = f", or name the units with {option}" if option else ""
    return (
        f'{said}, and "{strange[0]}" is not a known unit; convert the column and write the same unit, or none, after '
        f"its name{more}"
    )


def _with(record: Record, columns: Mapping[str, Array], units: Mapping[str, str], notes: Sequence[str]) -> Record:
    """The record with some of its columns, units and notes replaced."""
    if not columns and not notes and units == record.units:
        return record
    extra = {name: columns.get(name, values) for name, values in record.extra.items()}
    v, y = columns.get("v", record.v), record.y if record.y is None else columns.get("y", record.y)
    return replace(record, v=v, y=y, extra=extra, units=dict(units), notes=(*record.notes, *notes))
