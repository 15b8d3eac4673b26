"""Compiled functions: what runs, when it is compiled, and what makes it be compiled anew."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import hystgen
from hystgen.basics.jit import Jit, jit, plain

pytestmark = pytest.mark.thorough

LARGE = 2**70  # no number of a compiled function

FACTOR = 3


@jit
def tripled(x: Any) -> Any:
    """Three times x."""
    return FACTOR * x


@jit(inline=True)
def sixfold(x: Any) -> Any:
    """Six times x."""
    return tripled(x) + tripled(x)


def test_plain_is_python_all_the_way_down() -> None:
    assert sixfold(7) == 42
    with plain():
        assert sixfold(LARGE) == 6 * LARGE
        with plain():
            assert tripled(LARGE) == 3 * LARGE
        assert tripled(LARGE) == 3 * LARGE
    with pytest.raises((OverflowError, TypeError, ValueError)):
        tripled(LARGE)
    assert tripled.py_func(LARGE) == 3 * LARGE


def test_a_factory_makes_functions_of_what_it_is_given() -> None:
    """Closures are compiled each with its own parts, and found again under its own name in the cache."""

    def twice(step: Callable[[Any], Any]) -> Jit[[Any], Any]:
        @jit
        def run(x: Any) -> Any:
            return step(step(x))

        return run

    assert (twice(tripled)(2), twice(sixfold)(2)) == (18, 72)
    assert twice(tripled).mark != twice(sixfold).mark
    assert twice(tripled).mark == twice(tripled).mark


MODULE = """
from hystgen.basics.jit import jit

FACTOR = {factor}

@jit
def inner(x):
    return {inner}

@jit
def outer(x):
    return inner(x) + FACTOR
"""


def test_the_mark_is_of_everything_that_takes_part(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same text gives the same mark; another callee or constant another one."""
    monkeypatch.syspath_prepend(tmp_path)
    marks = {}
    for name, factor, inner in (("a", 1, "x + x"), ("b", 1, "x + x"), ("c", 2, "x + x"), ("d", 1, "x * x")):
        (tmp_path / f"made_{name}.py").write_text(MODULE.format(factor=factor, inner=inner))
        marks[name] = __import__(f"made_{name}").outer.mark
    assert marks["a"] == marks["b"]
    assert len({marks["a"], marks["c"], marks["d"]}) == 3


def test_numba_is_imported_with_the_first_call() -> None:
    code = (
        "import sys; from hystgen.compensator import reference; from hystgen.plays import operators; "
        "assert 'numba' not in sys.modules; operators.play([0.0, 1.0], 0.5); assert 'numba' in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=Path(hystgen.__file__).parents[1])
