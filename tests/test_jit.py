"""Compiled functions: when they run as Python, when they are compiled, and what makes them be compiled again."""

from __future__ import annotations

import contextlib
import subprocess
import sys
import warnings
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from modelfiles import CHAINS, FILES
from numpy.typing import NDArray

import hystgen
from hystgen.arithmetic import ARITHMETICS
from hystgen.basics import extras
from hystgen.basics import jit as jitting
from hystgen.basics.jit import Jit, jit, plain
from hystgen.basics.structures import Real, Struct, TwoReals
from hystgen.compensator import reference
from hystgen.compensator.chain import tables as chain_tables
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters
from hystgen.plays.slots import Range
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


@pytest.mark.slow(one_in=8)
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


class Place(Struct):
    """A structure with a structure and a row of numbers in it."""

    width: Real
    ends: Range
    both: TwoReals


class Held(NamedTuple):
    """What a named tuple can hold."""

    number: Any
    row: Any
    place: Place
    others: tuple[Any, ...]
    count: int


@jit
def raised(ends: Range, j: int, x: Any) -> Any:
    """Raise both ends. Returns their sum."""
    ends.low[j] += x
    ends.high[j] += x
    return ends.low[j] + ends.high[j]


@jit
def mixed(t: Held, s: Held, x: Any) -> Any:
    """Read and write every kind of field."""
    for j in range(len(t.number)):
        s.number[j] = t.number[j] + x
        s.row[j, 1] = t.row[j, t.row.shape[1] - 1] - x
        s.place.both[j, 1 - j] = raised(s.place.ends, j, t.place.width[j]) + t.number.dtype.type(0.1)
    s.others[0].number[1] = s.count
    part = s.number[1:2]
    part[0] = part[0] + len(part)
    return raised(s.others[1].ends, 1, 2.5) + len(s.others[0].row)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_compiled_functions_read_and_write_the_arrays_of_named_tuples(dtype: type[np.floating[Any]]) -> None:
    def held(seed: int, others: tuple[Any, ...], columns: int) -> Held:
        some = np.random.default_rng(seed).normal(size=(4, 30)).astype(dtype)
        places = Place.of([(a, (b, c), (d, e)) for a, b, c, d, e in some[:2, :5]], dtype)
        return Held(some[0, 5:9:2], some[1:, 10 : 10 + columns].copy(), places, others, seed)

    found = []
    for context in (contextlib.nullcontext(), plain()):
        inner = held(2, (), 2)
        t, s = held(3, (), 3), held(4, (inner, inner.place), 2)
        with context:
            answer = mixed(t, s, dtype(0.3))
        found.append([answer, *(x.tobytes() for x in (s.number, s.row, s.place, inner.number, inner.row, inner.place))])
    assert found[0] == found[1]


def test_numbers_that_are_no_integers_are_refused_outside_of_arrays() -> None:
    with pytest.raises(TypeError):
        mixed(Held(1.5, (), (), (), 0), Held(1, (), (), (), 0), 1)  # type: ignore[arg-type]


def test_short_records_are_not_compiled_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first samples of each function and type run as Python; later ones and all of a long record run compiled, and
    so do all after them and before them, if it is known that they follow."""

    def as_python(
        samples: int, dtype: type[np.generic] = np.float64, function: Jit[..., Any] = tripled, following: int = 0
    ) -> bool:
        with jitting.for_samples(function, np.zeros(samples, dtype), following):
            return jitting._plain.get()

    monkeypatch.setattr(jitting, "_samples", Counter())
    some = jitting.SHORT // 2
    with jitting.plain():  # inside it, all samples run as Python
        assert as_python(jitting.SHORT + 1)
        assert all(as_python(some) for _ in range(3))
    assert [as_python(some) for _ in range(3)] == [True, True, False]
    assert as_python(some, np.float32, following=some)
    assert not as_python(some, np.float32, following=1)
    assert [as_python(each, function=sixfold) for each in (some, jitting.SHORT, 1)] == [True, False, False]


def test_a_suite_runs_as_python_as_a_whole_or_not_at_all(monkeypatch: pytest.MonkeyPatch) -> None:
    """A function that is to be compiled for the last of many records is compiled for the first, and stays compiled."""
    tables, length, ran = Model(parse_parameters(FILES["plain"])).tables("float64", "corners"), 50, []
    mine, choose = reference.operations(tables, True).run, jitting.for_samples

    def chosen(function: Jit[..., Any], x: NDArray[Any], following: int = 0) -> Any:
        context = choose(function, x, following)
        ran.append((function, isinstance(context, contextlib.nullcontext)))
        return context

    monkeypatch.setattr(jitting, "for_samples", chosen)
    monkeypatch.setattr(jitting, "_has_numba", lambda: False)  # it is the choice that counts here
    compiled, records = [], expected_records(tables, np.dtype(np.float64), True, length)
    assert len(records) > 10
    for less in (0, 1):
        monkeypatch.setattr(jitting, "SHORT", length * len(records) - less)
        monkeypatch.setattr(jitting, "_samples", Counter())
        ran.clear()
        expected_records(tables, np.dtype(np.float64), True, length)
        compiled.append([how for function, how in ran if function is mine])
        assert len(compiled[-1]) == len(records)
    assert [set(each) for each in compiled] == [{False}, {True}]


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
