"""Helpers for testing the numbers in `hystgen.diagnosis.search.acceptance`: the rows of its table, and their texts.

A row names the numbers that decide it and lists the answers of its function in cases just on either side of each.
`tests/test_acceptance.py` holds the rows; `docs/thresholds.csv` lists them by number.
"""

from __future__ import annotations

import ast
import csv
import inspect
import io
import itertools
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from hystgen.diagnosis.search import acceptance

ROOT = Path(__file__).parent.parent
TABLE = ROOT / "docs" / "thresholds.csv"
HEAD = ("number", "value", "unit", "decides")


@dataclass(frozen=True)
class Row:
    """A function, its answer in each case, and the numbers that change an answer when doubled or halved."""

    name: str
    numbers: tuple[str, ...]
    cases: tuple[tuple[tuple[Any, ...], Any], ...]
    function: Callable[..., Any]

    def answer(self, given: tuple[Any, ...]) -> Any:
        """The function's answer in a case; it may take `monkeypatch` too."""
        with pytest.MonkeyPatch.context() as patch:
            named = {"monkeypatch": patch} if "monkeypatch" in inspect.signature(self.function).parameters else {}
            return self.function(*given, **named)

    def holds(self) -> bool:
        """Whether all answers are as listed; an error is another answer."""
        try:
            return all(self.answer(given) == expected for given, expected in self.cases)
        except Exception:
            return False


ROWS: list[Row] = []


def row(name: str, numbers: str, cases: Mapping[Any, Any], function: Callable[..., Any]) -> None:
    """Add a row; `cases` maps the argument of the function, or a tuple of arguments, to its answer."""
    listed = ((key if isinstance(key, tuple) else (key,), answer) for key, answer in cases.items())
    ROWS.append(Row(name, tuple(numbers.split()), tuple(listed), function))


def decides(numbers: str, cases: Mapping[Any, Any]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Make a function a row under its own name."""

    def register(function: Callable[..., Any]) -> Callable[..., Any]:
        row(function.__name__, numbers, cases, function)
        return function

    return register


def also(test: Callable[..., None], numbers: str) -> None:
    """Make a test of another file a row that holds if all its cases pass."""

    def passes(monkeypatch: pytest.MonkeyPatch) -> bool:
        lists = [mark.args for mark in getattr(test, "pytestmark", []) if mark.name == "parametrize"]
        fixtures = {"monkeypatch": monkeypatch} if "monkeypatch" in inspect.signature(test).parameters else {}
        for case in itertools.product(*(values for _, values in lists)):
            named: dict[str, Any] = {}
            for (names, _), values in zip(lists, case, strict=True):
                named |= {names: values} if isinstance(names, str) else dict(zip(names, values, strict=True))
            test(**named, **fixtures)
        return True

    row(test.__name__, numbers, {(): True}, passes)


def rows(number: str) -> list[Row]:
    """Rows that a number decides."""
    return [each for each in ROWS if number in each.numbers]


def names() -> list[str]:
    """Names of all numbers, in their order."""
    found = vars(acceptance).items()
    return [name for name, value in found if name.isupper() and isinstance(value, int | float | tuple)]


def changed(value: Any, factor: float) -> Any:
    """A number, or each of several, times a factor; whole numbers stay whole and at least one."""
    if isinstance(value, tuple):
        return tuple(changed(each, factor) for each in value)
    return max(1, round(value * factor)) if isinstance(value, int) else value * factor


def texts() -> Iterator[tuple[list[str], str]]:
    """Names of numbers that are assigned together, and the text below them."""
    for each, text in itertools.pairwise(ast.parse(Path(acceptance.__file__).read_text(encoding="utf-8")).body):
        if isinstance(each, ast.Assign) and isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant):
            targets = [name.id for name in ast.walk(each.targets[0]) if isinstance(name, ast.Name)]
            yield targets, " ".join(str(text.value.value).split())


def unit(name: str) -> str:
    """The unit at the start of the text below a number; if several numbers share the text, that of this one."""
    together, text = next(each for each in texts() if name in each[0])
    units = [part.partition("]")[0].removeprefix("[") for part in text.split(", [")]
    return units[together.index(name) if len(units) == len(together) else 0]


def table() -> str:
    """All numbers in their order, and the rows that they decide."""
    text = io.StringIO()
    written = csv.writer(text, lineterminator="\n")
    written.writerow(HEAD)
    for name in names():
        decided = "; ".join(each.name.removeprefix("test_").replace("_", " ") for each in rows(name))
        written.writerow([name, getattr(acceptance, name), unit(name), decided])
    return text.getvalue()
