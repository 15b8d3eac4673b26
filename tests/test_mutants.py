"""The records of `verify` find faults that are planted in the templates and the run time."""

from __future__ import annotations

import contextlib
import functools
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mutants
import pytest
from mutants import Mutant

import hystgen
from hystgen.arithmetic import ARITHMETICS
from hystgen.basics import jit
from hystgen.emission import runtime
from hystgen.emission.calls import emit_options
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters
from hystgen.verification import comparison, compilers, host
from hystgen.verification import run as verification
from hystgen.verification import sources as verified
from hystgen.verification.report import Report

pytestmark = pytest.mark.thorough

BUILD = (("quick", ["-std=c99", "-O0", "-ffp-contract=off"]),)
"""The build that is fastest to compile and run."""

LENGTH = 20_000
"""Calls in each record, a fifth of the default of `verify`."""

FEW = 500
"""Calls in each record of a model with effects, before it takes `LENGTH`: most mutants show in these, which the
reference in plain Python passes in 1 s, while it takes 4 to 11 s to compile the functions of such a model."""

SOURCES = {name: runtime.data_folder(name) for name in ("templates", "c_runtime", "hystgen/effects")}
"""Folders from which C is emitted, by their place in the checkout."""


@functools.cache
def expected(name: str, arithmetic: str, engine: str, inverse: bool, length: int) -> list[comparison.Expected]:
    """The records with the answers of the reference, which no mutant changes."""
    numbers = model(name).tables(arithmetic, engine)
    with jit.plain() if length == FEW else contextlib.nullcontext():
        return comparison.expected_records(numbers, ARITHMETICS[arithmetic].number, inverse, length)


@functools.cache
def model(name: str) -> Model:
    return Model(parse_parameters(mutants.MODELS[name], f"{name}.yaml"))


@pytest.fixture
def sources(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A copy of templates and run time from which everything is emitted."""
    for name, folder in SOURCES.items():
        shutil.copytree(folder, tmp_path / name, ignore=shutil.ignore_patterns("*.py", "__pycache__"))
    monkeypatch.setattr(runtime, "data_folder", lambda name: tmp_path / name)
    forget()
    yield tmp_path
    monkeypatch.undo()
    forget()


def forget() -> None:
    """Clear the caches of what has been read from the sources."""
    runtime.environment.cache_clear()
    runtime._read.cache_clear()
    runtime._pieces_of.cache_clear()


def verify(name: str, arithmetic: str, engine: str, length: int = LENGTH) -> Report:
    """`verify` on the host, with one build."""

    def records(_numbers: Any, _real: Any, inverse: bool, asked: int) -> list[comparison.Expected]:
        assert asked == length
        return expected(name, arithmetic, engine, inverse, length)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(host, "BUILDS", BUILD)
        patch.setattr(verification, "expected_records", records)
        return hystgen.verify(
            model(name), operator="both", arithmetic=arithmetic, engine=engine, compiler=["gcc"], length=length
        )


@functools.cache
def stands(name: str, arithmetic: str, engine: str, length: int) -> None:
    """Check that a model passes without a mutant."""
    report = verify(name, arithmetic, engine, length)
    assert report.ok, report.table()


def apply(mutant: Mutant, folder: Path) -> None:
    path = folder / mutant.file
    text = path.read_text()
    assert text.count(mutant.old) == mutant.count, mutant.what
    path.write_text(text.replace(mutant.old, mutant.new))


def finds(mutant: Mutant, folder: Path) -> None:
    """Check that the model passes as it stands and differs from the reference with the mutant."""
    case = mutant.model, mutant.arithmetic, mutant.engine
    text = (folder / mutant.file).read_text()
    for length in (FEW, LENGTH) if model(mutant.model).effects else (LENGTH,):
        (folder / mutant.file).write_text(text)
        forget()
        stands(*case, length)
        apply(mutant, folder)
        forget()
        report = verify(*case, length)
        if any(row.different for row in report.rows):
            return
    pytest.fail(report.table())


def test_every_mutant_changes_its_file(sources: Path) -> None:
    """Also those that only a run of everything emits and compiles."""
    for mutant in (*mutants.KILLED, *mutants.OF_EFFECTS, *mutants.EQUIVALENT):
        assert (sources / mutant.file).read_text().count(mutant.old) == mutant.count, mutant.what


@pytest.mark.slow(one_in=3)
@pytest.mark.parametrize("mutant", mutants.KILLED, ids=lambda mutant: mutant.what)
def test_verify_finds_a_mutant(mutant: Mutant, sources: Path) -> None:
    finds(mutant, sources)


@pytest.mark.slow(one_in=12)
@pytest.mark.parametrize("mutant", mutants.OF_EFFECTS, ids=lambda mutant: mutant.what)
def test_verify_finds_a_mutant_of_effects(mutant: Mutant, sources: Path) -> None:
    finds(mutant, sources)


@pytest.mark.slow(one_in=3)
@pytest.mark.parametrize("mutant", mutants.EQUIVALENT, ids=lambda m: f"{m.what}, {m.model}, {m.arithmetic}")
def test_an_equivalent_mutant_changes_nothing(mutant: Mutant, sources: Path) -> None:
    apply(mutant, sources)
    forget()
    report = verify(mutant.model, mutant.arithmetic, mutant.engine)
    assert report.ok, report.table()


ADDED = re.compile(r"(\*?[\w>-]*(?:status|bits)) \|= ([^;]+);")
"""Statements that add status bits."""


@pytest.mark.slow(one_in=3)
@pytest.mark.parametrize(("name", "arithmetic", "engine", "alone"), mutants.STICKY)
def test_verify_sees_that_status_bits_stay(
    name: str, arithmetic: str, engine: str, alone: set[tuple[str, str]], tmp_path: Path
) -> None:
    """Each place that adds status bits is made to drop bits not read yet; all places but `alone` are found. There is
    one build, in which a number chooses the place."""
    one = model(name)
    written = verified.write(tmp_path, one, emit_options(one, "both", arithmetic, engine))
    (path,) = written.module
    text, places = path.read_text(), []

    def dropped(found: re.Match[str]) -> str:
        function = re.findall(r"^\w[^;{}()]*\b(\w+)\([^;{}]*\{$", text[: found.start()], flags=re.M)[-1]
        places.append((function.removeprefix(f"{name}_"), " ".join(found[0].split()).replace(name.upper(), "HYSTGEN")))
        return f"{found[1]} = (chosen == {len(places)} ? 0u : {found[1]}) | ({found[2]});"

    path.write_text("extern int chosen;\nint chosen;\n" + ADDED.sub(dropped, text))
    gcc = compilers.find("gcc")
    assert gcc is not None
    gcc.shared_library(written.all, tmp_path / "all.so", BUILD[0][1])
    library = host._Library(tmp_path / "all.so", written, ARITHMETICS[arithmetic].number)
    library._ffi.cdef("extern int chosen;")
    case = name, arithmetic, engine
    records = [(op, each) for op in written.operators for each in expected(*case, op == "inverse", LENGTH)]
    kept = []
    for place in range(len(places) + 1):
        library._lib.chosen = place
        if not any(comparison.compare(functools.partial(library.run, op), [each]).different for op, each in records):
            kept.append(place)
    assert kept[0] == 0, "nothing dropped"
    found = {places[place - 1] for place in kept[1:]}
    assert found == alone, found ^ alone
