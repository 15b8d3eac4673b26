"""Verification finds the faults that it is meant to find."""

from __future__ import annotations

import json
import os
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from modelfiles import FILES

import hystgen
from hystgen.basics import extras
from hystgen.compensator import tables
from hystgen.compensator.layout import FixedTables
from hystgen.emission import module
from hystgen.front.curve import FORWARD, INVERSE
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters
from hystgen.plays import slots
from hystgen.verification import compilers, host, loading, signals


def model(name: str) -> Model:
    return Model(parse_parameters(FILES[name], f"{name}.yaml"))


@pytest.fixture
def changed_c(monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[[str], str]], None]:
    """Let a test change the emitted `NAME.c` before it is compiled."""
    emitted = module.files

    def change(how: Callable[[str], str]) -> None:
        def files(*arguments: object) -> dict[str, str]:
            texts = emitted(*arguments)  # type: ignore[arg-type]
            changed = {name: how(text) if name.endswith(".c") else text for name, text in texts.items()}
            assert changed != texts
            return changed

        monkeypatch.setattr(module, "files", files)

    return change


def has_fused_multiply_add() -> bool:
    cpu = Path("/proc/cpuinfo")
    return cpu.is_file() and " fma " in cpu.read_text()


@pytest.mark.skipif(not has_fused_multiply_add(), reason="this CPU cannot contract")
@pytest.mark.parametrize("compiler", compilers.NAMES)
def test_contraction_is_found_under_the_default_flags(compiler: str, changed_c: Callable[..., None]) -> None:
    """Without the pragmas of the emitted C, users' default flags would change bits, and the defaults build shows it."""
    changed_c(lambda text: re.sub("(?m)^#pragma.*$", "", text))
    report = hystgen.verify(model("listed"), operator="both", compiler=[compiler], length=3000)
    wrong = {row.build for row in report.rows if row.different}
    assert wrong == {"defaults"}, report.table()


@pytest.mark.parametrize("digit", ["0.4", "0.0119"])
def test_one_changed_table_entry_is_found(digit: str, changed_c: Callable[..., None]) -> None:
    """A change of one number by one unit in the last place is enough."""

    def change(text: str) -> str:
        numbers = re.findall(r"(?<![\w.])\d+\.\d+(?:e[+-]?\d+)?f", text)
        victim = next(number for number in numbers if number.startswith(digit[:3]) and np.float32(number[:-1]) != 0)
        other = str(np.nextafter(np.float32(victim[:-1]), np.float32(np.inf))) + "f"
        return text.replace(victim, other, 1)

    changed_c(change)
    report = hystgen.verify(model("plain"), operator="both", engine="loop", compiler=["gcc"], length=3000)
    assert not report.ok
    assert any(row.different for row in report.rows)


@pytest.mark.thorough(but_one_in=2)
@pytest.mark.parametrize("curve", ["front", "back"])
def test_a_changed_entry_that_a_single_code_reads_is_found(curve: str, changed_c: Callable[..., None]) -> None:
    """Next to a break of a dead zone, a piece of a curve is one code long, which no random record reaches."""
    bent = model("bent")
    numbers = bent.tables("q31", "corners")
    assert isinstance(numbers, FixedTables)
    which = FORWARD if curve == "front" else INVERSE
    pieces = slice(int(numbers.first[which]), int(numbers.first[which] + numbers.pieces[which]))
    single = [int(c[0]) for c in numbers.coefficient[pieces][np.diff(numbers.knot[pieces], append=2**31) == 1]]
    assert len(single) == 4

    def change(text: str) -> str:
        found = re.search(rf"bent_{curve}_coefficient.*?;", text, flags=re.DOTALL)
        if found is None:  # the self-test
            return text
        return text.replace(found[0], re.sub(rf"(?<!\d){single[1]}(?!\d)", str(single[1] + 2**20), found[0]))

    changed_c(change)
    report = hystgen.verify(bent, arithmetic="q31", operator="both", engine="corners", compiler=["gcc"], length=20_000)
    assert {row.operator for row in report.rows if row.different} == {
        "inverse", *(["forward"] if curve == "front" else [])
    }  # fmt: skip


def test_the_reports_say_what_failed(changed_c: Callable[..., None]) -> None:
    usual = "plain_above(m->next, x) : plain_above(x, m->next)"
    changed_c(lambda text: text.replace(usual, usual.replace("next", "cap")))
    report = hystgen.verify(model("plain"), compiler=["gcc"], length=3000)
    data = json.loads(report.to_json())
    assert data["ok"] is False
    assert [row["ok"] for row in data["rows"]].count(False) >= 2
    suite = ElementTree.fromstring(report.to_junit())
    assert int(suite.attrib["failures"]) == len(suite.findall(".//failure")) >= 2
    assert "differ" in report.table()


def test_c_that_does_not_compile_is_a_failure(changed_c: Callable[..., None]) -> None:
    changed_c(lambda text: text + "\nint unused_argument(int x) { return 0; }\n")
    report = hystgen.verify(model("plain"), compiler=["gcc"], length=1000)
    assert [row.ok for row in report.rows] == [False, False]
    assert "unused" in report.table()


def test_a_compiler_that_is_asked_for_and_missing_is_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compilers, "find", lambda _: None)
    report = hystgen.verify(model("plain"), compiler=["gcc"], length=1000)
    assert not report.ok
    assert "gcc is not installed" in report.table()


def test_a_compiler_may_be_a_command_of_several_words(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Distributors set CC='ccache gcc'; only the first word has to be installed."""
    launcher = tmp_path / "ccache"
    launcher.write_text(f'#!/bin/sh\necho "$@" >> "{tmp_path}/calls"\nexec "$@"\n')
    launcher.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    commands = ["ccache gcc", "gcc '-DNAME=a b'"]
    report = hystgen.verify(model("plain"), compiler=commands, length=1000)
    assert report.ok, report.table()
    assert [row.compiler for row in report.rows] == [commands[0], commands[0], commands[1], commands[1]]
    calls = (tmp_path / "calls").read_text().splitlines()
    assert len(calls) == 2
    assert all(call.startswith("gcc -shared ") for call in calls)
    report = hystgen.verify(model("plain"), compiler=["no-ccache gcc"], length=1000)
    assert "no-ccache is not installed" in report.table()


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ("gcc 'a", "the compiler \"gcc 'a\" is not a command: No closing quotation; correct it"),
        (" ", "a compiler is given as a command; write gcc, clang, zig or another"),
    ],
)
def test_what_is_no_command_is_refused(command: str, message: str) -> None:
    with pytest.raises(ValueError, match=re.escape(message)):
        hystgen.verify(model("plain"), compiler=[command], length=1000)


def test_a_compiler_that_cannot_be_started_is_a_failure(tmp_path: Path) -> None:
    broken = tmp_path / "cc"
    broken.write_text("#!/nowhere/sh\n")
    broken.chmod(0o755)
    report = hystgen.verify(model("plain"), compiler=[str(broken)], length=1000)
    assert not report.ok
    assert "cannot be started: No such file or directory" in report.table()


def test_compilers_keep_their_temporary_files_where_the_output_goes(tmp_path: Path) -> None:
    script = tmp_path / "cc"
    script.write_text('#!/bin/sh\necho "$TMPDIR" >&2\nexit 1\n')
    script.chmod(0o755)
    with pytest.raises(compilers.CompileError, match=f"failed:\n{tmp_path}/build$"):
        compilers.Compiler("cc", (str(script),)).run(["-o", tmp_path / "build" / "a.o"])


def test_where_temporary_files_may_not_be_executed_a_library_is_loaded_from_elsewhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a TMPDIR that is mounted noexec, the loader fails with these words."""
    blocked, free = tmp_path / "tmp", tmp_path / "run"
    blocked.mkdir()
    free.mkdir()
    asked: list[str] = []

    def loader(path: str) -> str:
        asked.append(path)
        if path.startswith(str(blocked)):
            raise OSError(f"cannot load library '{path}': failed to map segment from shared object.  Additionally, ..")
        return Path(path).read_text()

    library = blocked / "a.so"
    library.write_text("code")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(free))
    assert loading.load(library, loader) == "code"
    assert all(Path(path).is_relative_to(place) for path, place in zip(asked, (blocked, free), strict=True))
    assert list(free.iterdir()) == []
    monkeypatch.setattr(loading, "_elsewhere", lambda: iter([blocked]))
    with pytest.raises(loading.LoadError) as caught:
        loading.load(library, loader)
    assert str(caught.value) == (
        f"the compiled library cannot be loaded: cannot load library '{library}': failed to map segment from shared "
        f"object; if {blocked} is on a file system mounted noexec, set TMPDIR to a folder where programs may run"
    )


def test_a_library_that_loads_nowhere_is_a_failed_row(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object) -> None:
        raise loading.LoadError("the compiled library cannot be loaded")

    monkeypatch.setattr(host, "load", refused)
    report = hystgen.verify(model("plain"), compiler=["gcc"], length=1000)
    assert [row.error for row in report.rows] == ["the compiled library cannot be loaded"] * 2


def test_no_compiler_at_all_is_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compilers, "available", list)
    report = hystgen.verify(model("plain"), length=1000)
    assert not report.ok
    assert extras.install("zig") in report.table()


@pytest.mark.parametrize("inverse", [False, True])
@pytest.mark.parametrize("arithmetic", ["float32", "float64"])
def test_the_records_are_what_they_are_called(arithmetic: str, inverse: bool) -> None:
    numbers = tables.build(model("listed").cascade, arithmetic)
    real = numbers.threshold.dtype.type
    records = {
        name: (op, x.astype(real)) for name, op, x in signals.suite(numbers, np.dtype(real), inverse, 100_000)
    }
    assert all(len(op) == len(x) == 100_000 for op, x in records.values())
    low, high = numbers.limits.output[0] if inverse else numbers.limits.drive[0]

    def reversals(name: str) -> int:
        moves = np.diff(records[name][1])
        moves = moves[moves != 0]
        return int(np.count_nonzero(moves[1:] * np.sign(moves[:-1]) < 0))

    sines = records["sines of many sizes"][1]
    assert reversals("sines of many sizes") > 500
    sizes = np.ptp(sines.reshape(50, -1), axis=1)
    assert sizes.max() / sizes.min() > 1e4
    assert reversals("nested loops") > 1000
    assert reversals("random walk") > 10_000
    assert np.mean(np.diff(records["steps"][1]) == 0) > 0.6
    assert np.mean(np.diff(records["plateaus"][1]) == 0) > 0.5
    outside = records["beyond the range"][1]
    assert np.mean(outside > high) > 0.05
    assert np.mean(outside < low) > 0.05
    tiny = np.abs(records["denormals"][1])
    assert np.mean((tiny > 0) & (tiny < np.finfo(real).tiny)) > 0.5
    onto = records["onto the plays"][1]
    levels = numbers.start_level if inverse else numbers.threshold
    moves = np.abs(np.diff(onto.astype(float)))
    known = np.min(np.abs(moves[:, None] - 2.0 * levels.astype(float)), axis=1) < 1e-5 * (high - low)
    assert np.mean(known) > 0.9  # repeated, changed in the last bits, or moved just as far as a play needs
    assert np.mean(moves == 0) > 0.2
    assert np.mean(moves > 0.01 * (high - low)) > 0.2
    odd = records["NaN, infinities, extremes"][1]
    assert np.isnan(odd).any()
    assert np.isposinf(odd).any()
    assert np.isneginf(odd).any()
    called = {int(call) for op, _ in records.values() for call in np.unique(op & slots.OP_CALL)}
    expected = {slots.OP_STEP, slots.OP_RESET, slots.OP_INIT}
    assert called == (expected | {slots.OP_COMMIT} if inverse else expected)
