"""The records of `verify` find faults that are put in the templates and the run time."""

from __future__ import annotations

import functools
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import mutants
import pytest
from mutants import Mutant

import hystgen
from hystgen.arithmetic import ARITHMETICS
from hystgen.emission import module, runtime
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters
from hystgen.verification import comparison, host
from hystgen.verification import run as verification
from hystgen.verification.report import Report

pytestmark = pytest.mark.thorough

LENGTH = 20_000
"""Calls of each record, a fifth of what `verify` takes by default."""

SOURCES = {name: runtime.data_folder(name) for name in ("templates", "c_runtime")}


@functools.cache
def expected(name: str, arithmetic: str, engine: str, inverse: bool) -> list[comparison.Expected]:
    """The records with the answers of the reference, which no mutant changes."""
    numbers = model(name).tables(arithmetic, engine)
    return comparison.expected_records(numbers, ARITHMETICS[arithmetic].number, inverse, LENGTH)


@functools.cache
def model(name: str) -> Model:
    return Model(parse_parameters(mutants.MODELS[name], f"{name}.yaml"))


@pytest.fixture
def sources(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A copy of templates and run time that everything is emitted from."""
    for name, folder in SOURCES.items():
        shutil.copytree(folder, tmp_path / name)
    monkeypatch.setattr(runtime, "data_folder", lambda name: tmp_path / name)
    forget()
    yield tmp_path
    monkeypatch.undo()
    forget()


def forget() -> None:
    """What has been read of the sources."""
    module._environment.cache_clear()
    runtime._read.cache_clear()


@pytest.fixture
def verify(monkeypatch: pytest.MonkeyPatch) -> Callable[[Mutant], Report]:
    """`verify` on the host, with one build, of the model in which a mutant shows."""
    monkeypatch.setattr(host, "BUILDS", host.BUILDS[:1])

    def run(mutant: Mutant) -> Report:
        def records(_numbers: Any, _real: Any, inverse: bool, length: int) -> list[comparison.Expected]:
            assert length == LENGTH
            return expected(mutant.model, mutant.arithmetic, mutant.engine, inverse)

        monkeypatch.setattr(verification, "expected_records", records)
        return hystgen.verify(
            model(mutant.model), operator="both", arithmetic=mutant.arithmetic, engine=mutant.engine,
            compiler=["gcc"], length=LENGTH,
        )  # fmt: skip

    return run


def apply(mutant: Mutant, folder: Path) -> None:
    path = folder / mutant.file
    text = path.read_text()
    assert text.count(mutant.old) == mutant.count, mutant.what
    path.write_text(text.replace(mutant.old, mutant.new))


@pytest.mark.parametrize("mutant", mutants.KILLED, ids=lambda mutant: mutant.what)
def test_verify_finds_a_mutant(mutant: Mutant, sources: Path, verify: Callable[[Mutant], Report]) -> None:
    report = verify(mutant)
    assert report.ok, report.table()
    apply(mutant, sources)
    forget()
    report = verify(mutant)
    assert not report.ok
    assert any(row.different for row in report.rows), report.table()


@pytest.mark.parametrize("mutant", mutants.EQUIVALENT, ids=lambda m: f"{m.what}, {m.model}, {m.arithmetic}")
def test_an_equivalent_mutant_changes_nothing(
    mutant: Mutant, sources: Path, verify: Callable[[Mutant], Report]
) -> None:
    apply(mutant, sources)
    forget()
    report = verify(mutant)
    assert report.ok, report.table()
