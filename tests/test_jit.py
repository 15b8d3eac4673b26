"""Compiled functions: when they run as Python, when they are compiled, and what makes them be compiled again."""

from __future__ import annotations

import subprocess
import sys
import warnings
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from modelfiles import CHAINS, FILES

import hystgen
from hystgen.arithmetic import ARITHMETICS
from hystgen.basics import extras
from hystgen.basics import jit as jitting
from hystgen.basics.jit import Jit, jit, plain
from hystgen.compensator.chain import tables as chain_tables
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters
from hystgen.verification.comparison import expected_records

pytestmark = pytest.mark.thorough

LARGE = 2**70  # too large for a compiled function

FACTOR = 3

EFFECTS = {"loop": ("everything", "soft_dashpot", "bumpy", "dilated"), "corners": ("creeping", "worn")}
"""Models with effects by engine; those of `loop` cover each way in which effects move or bend plays."""


@jit
def tripled(x: Any) -> Any:
    """Three times x."""
    return FACTOR * x


@jit(inline=True)
def sixfold(x: Any) -> Any:
    """Six times x."""
    return tripled(x) + tripled(x)


def test_plain_is_python_all_the_way_down() -> None:
    assert (sixfold(7), tripled(7)) == (42, 21)
    with plain():
        assert sixfold(LARGE) == 6 * LARGE
        with plain():
            assert tripled(LARGE) == 3 * LARGE
        assert tripled(LARGE) == 3 * LARGE
    with pytest.raises((OverflowError, TypeError, ValueError)):
        tripled(LARGE)
    assert tripled.py_func(LARGE) == 3 * LARGE


def test_without_numba_everything_is_python_and_that_is_said_once(monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    monkeypatch.setattr(jitting, "_has_numba", lambda: False)
    monkeypatch.setattr(jitting, "announce", said.append)
    assert (sixfold(LARGE), tripled(LARGE)) == (6 * LARGE, 3 * LARGE)
    (text,) = said
    assert extras.install("fit") in text


@pytest.mark.parametrize("arithmetic", ["float32", "q15"])
def test_without_numba_the_bit_reference_gives_the_same_bits(
    arithmetic: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The model has no effects; `test_emission.py` compiles such models in every arithmetic and engine."""
    same_bits(Model(parse_parameters(FILES["mixed"])).tables(arithmetic, "corners"), arithmetic, monkeypatch)


@pytest.mark.slow(one_in=4)
@pytest.mark.parametrize("engine", EFFECTS)
@pytest.mark.parametrize("arithmetic", ["float32", "q31", "float64", "q15"])
def test_without_numba_effects_give_the_same_bits(
    engine: str, arithmetic: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """For an engine and an arithmetic, all models with effects share the same functions, which are compiled once."""
    for name in EFFECTS[engine]:
        chain = Model(parse_parameters(CHAINS[name])).chain
        same_bits(chain_tables.build(chain, arithmetic, 1e-3, engine=engine).tables, arithmetic, monkeypatch)


def same_bits(tables: Any, arithmetic: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Check that the bit-exact reference gives the same bits compiled and as Python over the records of `verify`, and
    that numpy does not warn."""
    found = []
    monkeypatch.setattr(jitting, "SHORT", 0)
    for has_numba in (True, False):
        monkeypatch.setattr(jitting, "_has_numba", lambda there=has_numba: there)
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            found.append(expected_records(tables, ARITHMETICS[arithmetic].number, True, 100))
    assert len(found[0]) > 10
    for compiled, interpreted in zip(*found, strict=True):
        assert interpreted.answer.tobytes() == compiled.answer.tobytes(), compiled.name
        assert interpreted.status.tobytes() == compiled.status.tobytes(), compiled.name


def test_short_records_are_not_compiled_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first samples of each function and type run as Python; later ones and all of a long record run compiled."""

    def as_python(samples: int, dtype: type[np.generic] = np.float64, function: Jit[..., Any] = tripled) -> bool:
        with jitting.for_samples(function, np.zeros(samples, dtype)):
            return jitting._plain.get()

    monkeypatch.setattr(jitting, "_samples", Counter())
    some = jitting.SHORT // 2
    assert not as_python(jitting.SHORT + 1)
    with jitting.plain():  # inside it, all samples run as Python
        assert as_python(jitting.SHORT + 1)
        assert all(as_python(some) for _ in range(3))
    assert [as_python(some) for _ in range(3)] == [True, True, False]
    assert as_python(some, np.float32)
    assert as_python(some, function=sixfold)


def test_a_factory_makes_functions_of_what_it_is_given() -> None:
    """Each closure is compiled with its own parts and found again in the cache under its own mark."""

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
    """The same text gives the same mark; a different callee or constant gives a different one."""
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
