"""The samples that an emitted self-test runs, and their answers from the bit-exact reference."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hystgen.compensator import converter, reference
from hystgen.compensator.layout import FixedTables, Tables
from hystgen.emission.chain import SETTINGS, settings
from hystgen.emission.compensator import EmittedModel
from hystgen.emission.text import literal
from hystgen.plays import slots

if TYPE_CHECKING:
    from hystgen.compensator.chain.layout import ChainTables

CALLS = {slots.OP_STEP: "s", slots.OP_COMMIT: "c", slots.OP_RESET: "r"}
"""Letters for the calls that every model has."""

LETTERS = {
    "push": "p", "settle": "q", "set_offset": "o", "set_temperature": "t", "set_gain": "g", "set_travel": "d",
}
"""Letters for the settings that models with effects have; capitals for columns, as many as there are letters."""

LETTERED = 26

WIDE = ("set_travel",)
"""Settings with more bits than a code, too many for fixed-point samples."""

SHARE = 0.125
"""[fraction of its span] Amount by which samples change a setting: small enough to keep references within reach."""


def _fractions(length: int) -> list[float]:
    """A decaying swing, then a fixed pseudo-random walk, as fractions of the range (0 .. 1)."""
    points = [0.5, 1.0, 0.0]
    points += [0.5 + 0.5 * (-0.86) ** k for k in range(1, 20)]
    points += [1.05, 1.0, 1.0, -0.05, 0.5]
    seed = 12345
    while len(points) < length // 3:
        seed = (seed * 1103515245 + 12345) % 2**31
        points.append((seed >> 12) / 2**19)
    path = []
    for a, b in itertools.pairwise(points):
        path += [a + (b - a) * part / 3 for part in range(3)]
    return path


@dataclass(frozen=True)
class Operator:
    """The test of an operator: its settings with their letters, and its samples in C."""

    name: str
    settings: list[tuple[str, str, str]]
    samples: list[str]


def operators(one: EmittedModel) -> list[Operator]:
    """The tests of a model's operators."""
    wide = WIDE if one.family.arithmetic.travels > 1 else ()
    found = []
    columns = min(len(one.columns), LETTERED)
    for name in one.options.operators:
        calls = set(one.calls.get(name, ())).difference(wide)
        own = list(settings(calls, columns)) if calls else []
        lettered = [(_letter(code, call), call, more) for code, call, more in own]
        found.append(Operator(name, lettered, _samples(one, name == "inverse", own)))
    return found


def _letter(code: int, call: str) -> str:
    """The letter for a setting, by its code and its name in C."""
    return LETTERS[call] if call in LETTERS else chr(ord("A") + code - SETTINGS[call])


CODES = 60
"""[samples] Steps from code to code: about as many of each kind, slow and fast, as of ordinary steps."""


def codes(one: EmittedModel) -> list[tuple[str, str]]:
    """Codes of references and, for an inverse with converters, the codes of drives that they should give."""
    conversion = one.conversion
    if conversion is None:
        return []
    line, numbers = conversion.reference, one.numbers.tables
    low, high = (float(end) for end in numbers.limits.output[0])
    ends = sorted((end - float(line.zero)) / float(line.step) for end in (low, high))
    given = np.rint([ends[0] + part * (ends[1] - ends[0]) for part in _fractions(3 * CODES)[:: 3]]).astype(np.int64)
    given = np.clip(given, line.least - 1, line.most + 1)  # codes beyond the converter's are limited
    sent, _ = converter.steps(numbers, conversion, given, compiled=False)
    return [(literal(a), literal(b)) for a, b in zip(given, sent, strict=True)]


SHARES = ((0.5, -0.5), (2.0, 2.0), (2.0, -2.0))
"""[fraction of the band for the rms] Errors of even and odd samples: inside, a mean outside, a mean square outside."""


@dataclass(frozen=True)
class Window:
    """A window of the watch: what is expected, what even and odd samples measure, and the answers; as written in C."""

    expected: str
    even: str
    odd: str
    status: int
    mean: str
    mean_square: str


def windows(one: EmittedModel) -> list[Window]:
    """Windows of a watch over the model's error, each from init."""
    watch, kind = one.watch, one.family.arithmetic.number
    if watch is None:
        return []
    low, high = (float(end) for end in one.numbers.tables.limits.output[0])
    middle = reference.nearest(one.numbers.tables, np.array([(low + high) / 2.0]))[0]
    band = watch.band.rms / float(one.numbers.lsb[1] if one.numbers.lsb else 1)
    found = []
    for errors in SHARES:
        measured = float(middle) + np.array(errors) * band
        if kind.kind == "i":
            measured = np.clip(np.rint(measured), np.iinfo(kind).min, np.iinfo(kind).max)
        even, odd = (kind.type(each) for each in measured)
        values = np.resize(np.array([even, odd]), watch.band.window)
        answer = watch.update(np.full(len(values), middle).astype(kind), values)
        status, mean, square = (each[-1] for each in answer)
        found.append(Window(literal(kind.type(middle)), literal(even), literal(odd), int(status), literal(mean),
                            literal(square)))
    return found


def _setting(t: ChainTables, code: int, call: str, turn: int) -> float:
    """An argument for a setting, in fixed point before rounding to a code. Every third argument exceeds the limits, if
    there are any."""
    from hystgen.compensator.chain.fixed_tables import setting_codes
    from hystgen.compensator.chain.parts import PARTS

    _, one = setting_codes(t)
    drive_low, drive_high, low, high = (float(end) for end in (*t.limits.drive[0], *t.limits.output[0]))
    way = (1.0, -1.0, 50.0)[turn % 3] * SHARE
    if call == "settle":
        return drive_low + (0.5 + way) * (drive_high - drive_low)
    if call == "set_offset":
        return way * (high - low)
    if call in ("set_temperature", "set_influence"):
        columns, entry = t.columns, code - SETTINGS[call] if call == "set_influence" else -1
        j = columns.entry.tolist().index(entry)
        far = 40.0 if call == "set_temperature" else columns.highest[j] - columns.lowest[j]
        return float(columns.unit[j] * (columns.middle[j] + far * way))
    if call == "set_gain":
        return one * (1.0 + way)
    if call == "set_travel":
        return abs(way) * next(part.longest(t.of(part.name)) for part in PARTS if part.longest)
    return low + (0.5 + way) * (high - low)


def _samples(one: EmittedModel, inverse: bool, own: Sequence[tuple[int, str, str]]) -> list[str]:
    """Calls, each with its letter and argument, and the expected answer and status."""
    numbers, between = one.numbers.tables, one.form.between
    low, high = numbers.limits.output[0] if inverse else numbers.limits.drive[0]
    drive_low, drive_high = numbers.limits.drive.low[0], numbers.limits.drive.high[0]
    calls, arguments = [], []
    for i, part in enumerate(_fractions(180)):
        calls.append(slots.OP_STEP)
        arguments.append(between(low, high, part))
        if inverse and i % 23 == 22:
            calls.append(slots.OP_COMMIT)
            arguments.append(between(drive_low, drive_high, 0.3 + i / 1000.0))
        if i == 120:
            calls.append(slots.OP_RESET)
            arguments.append(between(low, high, 0.25))
        if own and not isinstance(numbers, Tables | FixedTables) and i % 11 == 5:
            code, call, _ = own[i // 11 % len(own)]
            calls.append(code)
            argument = _setting(numbers, code, call, i // 11 // len(own))
            arguments.append(argument)
    x = reference.nearest(numbers, np.array(arguments))
    op = np.array(calls, dtype=np.uint8)
    op[:-1:2] |= slots.OP_UNREAD  # so that bits have to persist until they are read
    answers, status = reference.answers(numbers, inverse, op, x, compiled=False)
    status[op >= slots.OP_UNREAD] = slots.OP_UNREAD
    letters = {**CALLS, **{code: _letter(code, call) for code, call, _ in own}}
    return [
        f"{{'{letters[c]}', {literal(a)}, {literal(y)}, {s}u}}"
        for c, a, y, s in zip(calls, x, answers, status, strict=True)
    ]
