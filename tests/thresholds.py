"""The table of cases on either side of the numbers of `hystgen.diagnosis.search.acceptance`.

    @decides("LINE_SHARE", {0.055: True, 0.024: False})
    def share_of_a_line(share): ..

is a row: the function answers as listed for a case just below the number and one just above. `tests/test_acceptance.py`
holds the rows. `docs/thresholds.csv` lists them.
"""

from __future__ import annotations

import ast
import csv
import functools
import inspect
import io
import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from hystgen.diagnosis.search import acceptance

ROOT = Path(__file__).parent.parent
TABLE = ROOT / "docs" / "thresholds.csv"
HEAD = ("number", "value", "unit", "decides")

ROWS: list[Row] = []
OTHERS: list[Row] = []
"""Tests of other files."""


@dataclass(frozen=True)
class Row:
    """A function, what it answers in each case, and the numbers whose double and half change an answer."""

    numbers: tuple[str, ...]
    function: Callable[..., Any]
    cases: tuple[tuple[tuple[Any, ...], Any], ...]

    @property
    def name(self) -> str:
        """That of the function."""
        return self.function.__name__

    def answer(self, given: tuple[Any, ...]) -> Any:
        """What the function answers in a case."""
        with pytest.MonkeyPatch.context() as patch:
            named = {"monkeypatch": patch} if "monkeypatch" in inspect.signature(self.function).parameters else {}
            return self.function(*given, **named)

    def holds(self) -> bool:
        """Whether it answers as listed in all cases; an error is another answer."""
        try:
            return all(self.answer(given) == expected for given, expected in self.cases)
        except Exception:
            return False


def decides(*given: str | dict[Any, Any], gives: Any = None) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Make a function a row: names of numbers, and its answers by what it is given, or the one without anything."""
    *numbers, answers = given if isinstance(given[-1], dict) else (*given, {(): gives})
    assert isinstance(answers, dict)
    cases = tuple((key if isinstance(key, tuple) else (key,), answer) for key, answer in answers.items())

    def register(function: Callable[..., Any]) -> Callable[..., Any]:
        ROWS.append(Row(tuple(map(str, numbers)), function, cases))
        return function

    return register


def also(test: Callable[..., None], *numbers: str) -> None:
    """Make a test of another file a row, with all its cases."""

    @functools.wraps(test, updated=())
    def passes(monkeypatch: pytest.MonkeyPatch) -> bool:
        lists = [mark.args for mark in getattr(test, "pytestmark", []) if mark.name == "parametrize"]
        fixtures = {"monkeypatch": monkeypatch} if "monkeypatch" in inspect.signature(test).parameters else {}
        for case in itertools.product(*(values for _, values in lists)):
            named: dict[str, Any] = {}
            for (names, _), values in zip(lists, case, strict=True):
                named |= {names: values} if isinstance(names, str) else dict(zip(names, values, strict=True))
            test(**named, **fixtures)
        return True

    del passes.__wrapped__  # whose parameters are the test's own
    OTHERS.append(Row(numbers, passes, (((), True),)))


def rows(number: str) -> list[Row]:
    """Those that a number decides."""
    return [row for row in ROWS + OTHERS if number in row.numbers]


def names() -> list[str]:
    """All numbers, in their order."""
    found = vars(acceptance).items()
    return [name for name, value in found if name.isupper() and isinstance(value, int | float | tuple)]


def changed(value: Any, factor: float) -> Any:
    """A number, or each of several, times a factor; whole numbers stay whole and at least one."""
    if isinstance(value, tuple):
        return tuple(changed(each, factor) for each in value)
    return max(1, round(value * factor)) if isinstance(value, int) else value * factor


def texts() -> Iterator[tuple[list[str], str]]:
    """Numbers that are assigned together, and the text below them."""
    for each, text in itertools.pairwise(ast.parse(Path(acceptance.__file__).read_text(encoding="utf-8")).body):
        if isinstance(each, ast.Assign) and isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant):
            targets = each.targets[0].elts if isinstance(each.targets[0], ast.Tuple) else each.targets
            words = " ".join(str(text.value.value).split())
            yield [target.id for target in targets if isinstance(target, ast.Name)], words


def documented() -> dict[str, str]:
    """The text below each number."""
    return {name: text for together, text in texts() for name in together}


def unit(name: str) -> str:
    """The unit that stands before the text below a number; of several numbers with a text in common its own."""
    together, text = next(each for each in texts() if name in each[0])
    units = [part.partition("]")[0].removeprefix("[") for part in text.split(", [")]
    return units[together.index(name) if len(units) == len(together) else 0]


def read_inside() -> set[str]:
    """Numbers that the functions of the module itself read."""
    body = ast.parse(Path(acceptance.__file__).read_text(encoding="utf-8")).body
    functions = [each for each in body if isinstance(each, ast.FunctionDef)]
    used = (node.id for function in functions for node in ast.walk(function) if isinstance(node, ast.Name))
    return {name for name in used if name.isupper()}


def table() -> str:
    """All numbers in their order, and the rows that they decide."""
    text = io.StringIO()
    written = csv.writer(text, lineterminator="\n")
    written.writerow(HEAD)
    for name in names():
        decided = "; ".join(row.name.removeprefix("test_").replace("_", " ") for row in rows(name))
        written.writerow([name, getattr(acceptance, name), unit(name), decided])
    return text.getvalue()
