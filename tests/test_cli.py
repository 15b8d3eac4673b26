"""The command line as a new user and a CI job see it: exit codes, output streams, and no half-written files."""

from __future__ import annotations

import csv
import hashlib
import io
import json
import math
import os
import re
import shlex
import subprocess
import sys
import time
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import jsonschema
import numpy as np
import pytest
from click.testing import CliRunner
from modelfiles import FILES, head
from ruamel.yaml import YAML

import hystgen
from hystgen import cli, records, verification
from hystgen.compensator import tables
from hystgen.compensator.bounds import error_bounds
from hystgen.emission import module
from hystgen.emission.options import seal
from hystgen.emission.text import literal
from hystgen.verification import compilers, run

R = (0.0, 0.45, 0.9, 1.35, 1.8, 2.25, 2.7)
P = (0.72, 0.6, 0.48, 0.36, 0.24, 0.12, 0.012)
M0 = (0.0, 0.3, 0.1, -0.2, 0.2, 0.5, 0.1)
OFFSET = 1.5
LOW, HIGH = -4.0, 4.0
STAGE = f"""hystgen: 1
name: stage
units: {{input: V, output: um}}
input_range: [{LOW}, {HIGH}]
model:
  pi:
    thresholds: {list(R)}
    weights: {list(P)}
    initial_state: {list(M0)}
  output_offset: {OFFSET}
"""
NO_INVERSE = STAGE.replace("[0.72,", "[0,")
OUTPUTS = ["stage.h", "stage.c", "stage_selftest.h", "stage_selftest.c"]
BROKEN = """hystgen: 1
name: stage
colour: red
input_range: [4, -4]
model:
  pi:
    thresholds: [0, 0.5, 0.5]
    weights: [0.7, -0.6, 0.5]
    weights: [0.7, 0.6, 0.5]
  output_offset: .nan
"""


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every test works in an empty folder with `stage.yaml`."""
    monkeypatch.chdir(tmp_path)
    Path("stage.yaml").write_text(STAGE)


def hyst(*arguments: object, code: int = 0) -> SimpleNamespace:
    """Run a command in this process; it exits with `code` and without a traceback."""
    result = CliRunner().invoke(cli.main, [str(a) for a in arguments])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    # compiling kernels is reported on standard error
    said = "".join(re.findall(r"(?m)^(?!compiling).*\n?", result.stderr))
    out = SimpleNamespace(stdout=result.stdout, stderr=said, lines=result.stdout.splitlines())
    assert result.exit_code == code, f"exit {result.exit_code}\n{out.stdout}\n{out.stderr}"
    assert "Traceback" not in out.stdout + out.stderr
    if code == 2:
        assert out.stderr.strip(), "a refusal says why, on stderr"
    return out


def process(
    *arguments: object, code: int = 0, folder: str | Path = ".", **environment: str
) -> subprocess.CompletedProcess[str]:
    """Run a command as its own process; it exits with `code` and without a traceback."""
    done = subprocess.run(
        [sys.executable, "-m", "hystgen.cli", *map(str, arguments)],
        cwd=folder, env={**os.environ, **environment}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == code, done.stdout + done.stderr
    assert "Traceback" not in done.stdout + done.stderr
    return done


def everything(folder: str | Path = ".") -> dict[str, bytes]:
    """Path and bytes of every file below a folder, hidden ones too; folders have empty bytes."""
    root = Path(folder)
    return {str(p.relative_to(root)): b"" if p.is_dir() else p.read_bytes() for p in sorted(root.rglob("*"))}


def test_the_package_is_a_command_too() -> None:
    for arguments, code, said in ((["--version"], 0, "hystgen, version"), (["emit"], 2, "Usage: hystgen emit")):
        words = [sys.executable, "-m", "hystgen", *arguments]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        assert done.returncode == code
        assert said in done.stdout + done.stderr


def test_a_reader_that_has_had_enough_is_no_error() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    words = [sys.executable, "-m", "hystgen", "diagnose", "--plan", "stage.yaml", "-o", "plan"]
    done = subprocess.run(words, stdout=writing, stderr=subprocess.PIPE, text=True, check=False)
    os.close(writing)
    assert (done.returncode, "rror" in done.stderr) == (1, False), done.stderr
    assert Path("plan").is_dir()


# emit ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("layout", ["self-contained", "single-header", "shared-runtime"])
def test_emit_prints_what_it_writes_and_list_outputs_the_same(layout: str) -> None:
    before = everything()
    listed = hyst("emit", "stage.yaml", "-o", "fw/gen", "--layout", layout, "--list-outputs")
    assert everything() == before, "--list-outputs writes nothing"
    written = hyst("emit", "stage.yaml", "-o", "fw/gen", "--layout", layout)
    assert listed.stdout == written.stdout
    assert sorted(written.lines) == sorted(f"fw/gen/{name}" for name in everything("fw/gen"))
    assert {"fw/gen/stage.h", "fw/gen/stage_selftest.h", "fw/gen/stage_selftest.c"} <= set(written.lines)
    assert ("fw/gen/stage.c" in written.lines) == (layout != "single-header")
    assert written.stderr == ""


def test_emit_takes_the_files_defaults_and_the_command_line_goes_first() -> None:
    Path("stage.yaml").write_text(STAGE + "emit: {operator: forward, arithmetic: float64, engine: loop}\n")
    hyst("emit", "stage.yaml", "-o", "a")
    text = Path("a/stage.h").read_text()
    assert "stage_forward_step" in text
    assert "stage_inverse_step" not in text
    assert "typedef double stage_real_t" in text
    assert f"#define STAGE_N_PLAYS {len(R) - 1}\n" in text
    assert "stage_real_t play[STAGE_N_PLAYS + 1];" in text
    hyst("emit", "stage.yaml", "-o", "b", "--operator", "both", "--arithmetic", "float32", "--engine", "corners")
    text = Path("b/stage.h").read_text()
    assert "stage_forward_step" in text
    assert "stage_inverse_step" in text
    assert "typedef float stage_real_t" in text
    assert "stage_corner_t corner" in text


def test_check_is_silent_when_fresh_and_names_what_is_stale() -> None:
    hyst("emit", "stage.yaml", "-o", "fw")
    fresh = everything()
    checked = hyst("emit", "stage.yaml", "-o", "fw", "--check")
    assert (checked.stdout, checked.stderr) == ("", "up to date: 4 files of 1 model\n")
    assert hyst("emit", "stage.yaml", "-o", "fw", "--check", "--quiet").stderr == ""
    assert "give one of the two" in hyst("emit", "stage.yaml", "--check", "--list-outputs", code=2).stderr
    for name in OUTPUTS:
        path = Path("fw") / name
        good = path.read_bytes()
        middle = len(good) // 2
        for bad in (good[:middle] + bytes([good[middle] ^ 1]) + good[middle + 1 :], good + b"\n", good[:-1], b"", None):
            path.unlink() if bad is None else path.write_bytes(bad)
            before = everything()
            result = hyst("emit", "stage.yaml", "-o", "fw", "--check", code=1)
            assert everything() == before, "--check writes nothing"
            assert f"fw/{name}" in result.stderr
            assert not any(f"fw/{other} " in result.stderr for other in OUTPUTS if other != name)
            path.write_bytes(good)
    hyst("emit", "stage.yaml", "-o", "fw", "--check")
    assert everything() == fresh
    hyst("emit", "stage.yaml", "-o", "fw", "--check", "--arithmetic", "float64", code=1)
    hyst("emit", "stage.yaml", "-o", "fw", "--check", "--operator", "both", code=1)
    Path("stage.yaml").write_text(STAGE.replace("0.012", "0.0121"))
    result = hyst("emit", "stage.yaml", "-o", "fw", "--check", code=1)
    assert all(f"fw/{name}" in result.stderr for name in OUTPUTS)


def commands(said: str) -> list[str]:
    """The commands that a check advises, in order."""
    return re.findall(r"^[^\n]*?: (hystgen emit [^\n;]*)", said.replace("error: ", ""), flags=re.MULTILINE)


def run_command(text: str, code: int = 0) -> SimpleNamespace:
    return hyst(*shlex.split(text)[1:], code=code)


def test_check_of_files_made_with_other_options_advises_no_command_that_replaces_them() -> None:
    """A q15 module is checked without its options: the first command confirms it, the second is said to replace it."""
    hyst("emit", "stage.yaml", "-o", "fw", "--arithmetic", "q15", "--operator", "both", "--layout", "single-header")
    before = everything()
    said = hyst("emit", "stage.yaml", "-o", "fw", "--check", code=1).stderr
    words = "--operator both --arithmetic q15 --layout single-header, not with --operator inverse --arithmetic float32"
    assert f"fw/stage.h was generated with {words}" in said
    assert "parameters" not in said
    assert "edited" not in said
    own, asked = commands(said)
    assert asked == "hystgen emit stage.yaml -o fw"
    assert f"to replace them: {asked}" in said
    assert "up to date" in said
    run_command(own)
    assert everything() == before


@pytest.mark.parametrize("layout", ["self-contained", "shared-runtime"])
def test_check_says_in_what_a_file_differs(layout: str) -> None:
    options = ("--arithmetic", "q15", "--operator", "both", "--layout", layout)
    hyst("emit", "stage.yaml", "-o", "fw", *options)
    fresh = everything("fw")
    path = Path("fw/stage.c")
    good = path.read_text()

    def check(text: str) -> str:
        path.write_bytes(text.encode())
        said = hyst("emit", "stage.yaml", "-o", "fw", *options, "--check", code=1).stderr
        assert said.startswith("error: fw/stage.c ")
        return said.splitlines()[0].removeprefix("error: fw/stage.c ")

    text = re.sub(r" \* Text: .*\n", "", good).replace(f"hystgen {hystgen.__version__};", "hystgen 0.0.1;")
    older = seal(text.replace("return", "return ", 1))
    assert check(good.replace("\n", "\r\n")) == "has line endings other than LF"
    assert check(good.replace("return", "return ", 1)) == "was edited by hand"
    both = good.replace("return", "return ", 1).replace("\n", "\r\n")
    assert check(both) == "was edited by hand and has line endings other than LF"
    assert check(older) == f"was generated by hystgen 0.0.1 (this is {hystgen.__version__})"
    assert check(older + "\n").endswith(f"(this is {hystgen.__version__}) and was edited by hand")
    assert check(text).startswith("was generated by hystgen 0.0.1"), "one that knew no hash of the text"
    assert check("int x;\n") == "has no complete hystgen banner: something else wrote it, or the banner was edited"
    path.write_text(good)
    Path("stage.yaml").write_text(STAGE.replace("0.012", "0.0121"))
    said = hyst("emit", "stage.yaml", "-o", "fw", *options, "--check", code=1).stderr
    assert "error: fw/stage.c was generated from other parameters\n" in said
    assert "runtime" not in said.replace("shared-runtime", "")
    (command,) = commands(said)
    given = options if layout != "self-contained" else options[:4]
    assert command == shlex.join(["hystgen", "emit", "stage.yaml", "-o", "fw", *given])
    Path("stage.yaml").write_text(STAGE)
    run_command(command)
    assert everything("fw") == fresh


def test_check_takes_no_word_of_a_file_into_a_command() -> None:
    hyst("emit", "stage.yaml", "-o", "fw", "--arithmetic", "q15")
    for path in Path("fw").iterdir():
        path.write_text(path.read_text().replace("--arithmetic q15", "--arithmetic q15;reboot --operator $(reboot)"))
    said = hyst("emit", "stage.yaml", "-o", "fw", "--check", code=1).stderr
    assert "reboot" not in said
    assert "edited by hand" in said


def other(name: str, *changes: tuple[str, str]) -> str:
    """Write the parameter file of another model and return its file name."""
    text = STAGE.replace("name: stage", f"name: {name}")
    for old, new in changes:
        text = text.replace(old, new)
    Path(f"{name}.yaml").write_text(text)
    return f"{name}.yaml"


def test_one_command_mends_all_that_is_stale() -> None:
    files = ["stage.yaml", other("second"), other("third")]
    hyst("emit", *files, "-o", "fw", "--operator", "both")
    for name in ("stage", "third"):
        Path(f"{name}.yaml").write_text(Path(f"{name}.yaml").read_text().replace("0.012", "0.0121"))
    said = hyst("emit", *files, "-o", "fw", "--operator", "both", "--check", code=1).stderr
    assert "second" not in said
    (command,) = commands(said)
    assert command == "hystgen emit stage.yaml third.yaml -o fw --operator both"
    run_command(command)
    hyst("emit", *files, "-o", "fw", "--operator", "both", "--check")
    # For files made with other options, one command for all that share them
    hyst("emit", *files[:2], "-o", "fw", "--arithmetic", "q15")
    said = hyst("emit", *files, "-o", "fw", "--operator", "both", "--check", code=1).stderr
    own, asked = commands(said)
    assert own.startswith("hystgen emit stage.yaml second.yaml -o fw --operator inverse --arithmetic q15 ")
    assert asked == "hystgen emit stage.yaml second.yaml -o fw --operator both"
    run_command(asked)
    hyst("emit", *files, "-o", "fw", "--operator", "both", "--check")


def test_check_names_files_of_models_that_are_gone() -> None:
    gone = other("gone")
    hyst("emit", "stage.yaml", gone, "-o", "fw", "--layout", "shared-runtime")
    Path("fw/main.c").write_text('#include "gone.h"  /* Generated by hystgen */\n')
    Path("fw/deeper").mkdir()
    Path("fw/deeper/gone.c").write_bytes(Path("fw/gone.c").read_bytes())
    Path("fw/notes.txt").write_bytes(Path("fw/gone.c").read_bytes())
    Path("fw/gone.h").write_bytes(Path("fw/gone.h").read_bytes().replace(b"\n", b"\r\n"))
    before = everything()
    said = hyst("emit", "stage.yaml", "-o", "fw", "--layout", "shared-runtime", "--check", code=1).stderr
    assert everything() == before
    names = [name.replace("stage", "gone") for name in sorted(OUTPUTS)]
    assert said.splitlines() == [
        *(f"error: fw/{x} belongs to model gone, which is not in any of the given parameter files" for x in names),
        f"to delete what no model writes: rm {' '.join(f'fw/{name}' for name in names)}, or give their parameter files "
        "too",
    ]
    assert len(hystgen.differences("stage.yaml", "fw", layout="shared-runtime")) == len(names)
    for name in names:
        Path("fw", name).unlink()
    hyst("emit", "stage.yaml", "-o", "fw", "--layout", "shared-runtime", "--check")
    # Files of a layout that is no longer used
    hyst("emit", "stage.yaml", "-o", "fw", "--layout", "single-header")
    said = hyst("emit", "stage.yaml", "-o", "fw", "--layout", "single-header", "--check", code=1).stderr
    left = ["hystgen_runtime_f32.c", "hystgen_runtime_f32.h", "stage.c"]
    assert said.splitlines() == [
        *(f"error: fw/{name} is a shared run time that none of the given models uses" for name in left[:2]),
        "error: fw/stage.c belongs to model stage but is not written with these options",
        f"to delete what no model writes: rm {' '.join(f'fw/{name}' for name in left)}",
    ]


def test_several_models_at_once_all_or_none() -> None:
    Path("y.yaml").write_text(STAGE.replace("name: stage", "name: other"))
    both = ("stage.yaml", "y.yaml", "-o", "fw")
    listed = hyst("emit", *both, "--list-outputs")
    hyst("emit", *both, "--check", code=1)
    assert not Path("fw").exists()
    assert hyst("emit", *both).stdout == listed.stdout
    assert sorted(everything("fw")) == sorted([*OUTPUTS, *(name.replace("stage", "other") for name in OUTPUTS)])
    alone = everything("fw")
    hyst("emit", "stage.yaml", "-o", "one")
    assert everything("one").items() <= alone.items()
    hyst("emit", *both, "--check")
    hyst("emit", "stage.yaml", *both, "--check")  # named twice
    hystgen.emit(["stage.yaml", hystgen.load("y.yaml")], "python")
    assert everything("python") == alone
    assert hystgen.differences(["stage.yaml", "y.yaml"], "python") == []
    Path("y.yaml").write_text(NO_INVERSE.replace("name: stage", "name: other"))
    Path("bad.yaml").write_text(BROKEN)
    before = everything()
    result = hyst("emit", "y.yaml", "stage.yaml", "-o", "fw", code=1)
    assert "y.yaml: error: no inverse" in result.stderr
    result = hyst("emit", "bad.yaml", "stage.yaml", "gone.yaml", "-o", "fw", code=2)
    assert "bad.yaml:3:" in result.stderr
    assert "gone.yaml: error: cannot be read" in result.stderr
    Path("y.yaml").write_text(STAGE.replace("name: stage", "name: STAGE"))
    assert "two models are called stage (stage.yaml, y.yaml), so" in hyst("emit", *both, code=2).stderr
    Path("y.yaml").unlink()
    del before["y.yaml"]
    assert everything() == before, "nothing half-written"


def test_files_that_are_the_same_are_not_written_again() -> None:
    hyst("emit", "stage.yaml", "-o", "fw")
    times = {}
    for path in Path("fw").iterdir():
        os.utime(path, (1, 1))
        times[path.name] = (path.stat().st_ino, 1)
    Path("fw/stage.c").write_text("stale")
    hyst("emit", "stage.yaml", "-o", "fw")
    now = {path.name: (path.stat().st_ino, path.stat().st_mtime) for path in Path("fw").iterdir()}
    kept = {name for name in OUTPUTS if now[name] == times[name]}
    assert kept == set(OUTPUTS) - {"stage.c"}


def test_check_of_a_folder_that_is_not_there_names_every_file_and_makes_none() -> None:
    before = everything()
    result = hyst("emit", "stage.yaml", "-o", "fw", "--check", code=1)
    assert all(f"fw/{name}" in result.stderr for name in OUTPUTS)
    assert everything() == before


def test_same_bytes_from_any_folder_in_any_environment(tmp_path: Path) -> None:
    for place in ("one", "two/deeper"):
        Path(place).mkdir(parents=True)
    long = FILES["density"].replace("name: density", "name: stage")  # with tables of several lines
    Path("stage.yaml").write_text(long)
    renamed = tmp_path / "two" / "other name.yaml"
    renamed.write_text("# the same model\n" + long)
    process("emit", "../stage.yaml", "-o", "gen", folder="one", PYTHONHASHSEED="1", LC_ALL="C", TZ="UTC")
    process("emit", renamed, "--operator", "inverse", folder="two/deeper", PYTHONHASHSEED="7", TZ="Asia/Tokyo")
    first, second = everything("one/gen"), everything("two/deeper")
    assert first == second
    assert sorted(first) == sorted(OUTPUTS)
    text = b"".join(first.values())
    assert str(tmp_path).encode() not in text
    assert not re.search(rb"\b20\d\d-\d\d-\d\d\b|\b\d\d:\d\d:\d\d\b", text), "a date or time"


def test_emit_again_changes_nothing_but_what_is_stale() -> None:
    hyst("emit", "stage.yaml", "-o", "fw")
    fresh = everything()
    Path("fw/stage.c").write_text("stale")
    Path("fw/main.c").write_text("the user's own")
    hyst("emit", "stage.yaml", "-o", "fw")
    assert everything() == {**fresh, "fw/main.c": b"the user's own"}


@pytest.mark.parametrize("command", [
    ("emit", "-o", "fw"), ("emit", "-o", "fw", "--check"), ("emit", "-o", "fw", "--list-outputs"), ("verify",),
    ("show",), ("simulate", "-o", "fw.csv", "drive.csv"),
])  # fmt: skip
def test_a_bad_parameter_file_gets_every_problem_at_once(command: Sequence[str]) -> None:
    write("drive.csv", {"t": [0, 1, 2], "v": [0, 1, 2]})
    Path("bad.yaml").write_text(BROKEN)
    before = everything()
    name, *rest = command
    result = hyst(name, "bad.yaml", *rest, code=2)
    assert everything() == before, "nothing half-written"
    assert result.stdout == ""
    lines = result.stderr.splitlines()
    form = re.compile(r"bad\.yaml:(\d+):(\d+): error: ([\w.\[\]]+): [^;]+; .+")
    found = [form.fullmatch(line) for line in lines]
    assert all(found), result.stderr
    places = [(int(m[1]), m[3]) for m in found if m]
    assert places == sorted(places), "in the order of the file"
    where = {4: 14, 7: 26, 8: 20}
    for line, path in ((3, "colour"), (4, "input_range"), (7, "model.pi.thresholds[2]"), (8, "model.pi.weights[1]"),
                       (9, "model.pi.weights"), (10, "model.output_offset")):  # fmt: skip
        assert (line, path) in places, result.stderr
        column = next(int(m[2]) for m in found if m and int(m[1]) == line)
        assert column == where.get(line, column)


def test_a_bad_parameter_file_leaves_what_was_emitted_before() -> None:
    hyst("emit", "stage.yaml", "-o", "fw")
    before = everything("fw")
    Path("stage.yaml").write_text(BROKEN)
    process("emit", "stage.yaml", "-o", "fw", code=2)
    assert everything("fw") == before


def test_a_model_without_inverse_can_only_be_emitted_forward() -> None:
    Path("stage.yaml").write_text(NO_INVERSE)
    before = everything()
    data = {"t": [0.0, 1.0], "u": [0.0, 1.0]}
    write("u.csv", data)
    for command in (
        ("emit", "-o", "fw"), ("emit", "-o", "fw", "--operator", "both"), ("emit", "-o", "fw", "--list-outputs"),
        ("verify",), ("simulate", "u.csv", "--operator", "inverse"),
    ):  # fmt: skip
        result = hyst(command[0], "stage.yaml", *command[1:], code=1)
        assert "p_0" in result.stderr
        assert "stage.yaml" in result.stderr
        assert result.stdout == ""
    Path("u.csv").unlink()
    assert everything() == before, "nothing half-written"
    hyst("emit", "stage.yaml", "-o", "fw", "--operator", "forward")
    assert sorted(everything("fw")) == sorted(OUTPUTS)
    hyst("emit", "stage.yaml", "-o", "fw", "--operator", "forward", "--check")


def bad_files() -> dict[str, bytes]:
    """Files that are not parameter files; each may only cause a message."""
    return {
        "empty.yaml": b"",
        "blank.yaml": b"\n \n# nothing\n",
        "latin1.yaml": STAGE.replace("um", "\xb5m").encode("latin-1"),
        "utf16.yaml": STAGE.encode("utf-16"),
        "binary.yaml": bytes(range(256)) * 4,
        "list.yaml": b"- 1\n- 2\n",
        "text.yaml": b"hello",
        "tabs.yaml": b"hystgen: 1\n\tname: x\n",
        "open.yaml": b"hystgen: [1\n",
        "deep.yaml": b"[" * 5000,
        "large.yaml": STAGE.encode() + b"#" * (1 << 20),
        "csv.yaml": b"t,v,y\n0,0,0\n",
    }


@pytest.mark.parametrize("name", [*bad_files(), "missing.yaml", "folder.yaml", "no/such/folder.yaml"])
def test_files_that_are_no_parameter_file(name: str) -> None:
    for file, content in bad_files().items():
        Path(file).write_bytes(content)
    Path("folder.yaml").mkdir()
    before = everything()
    for command in ("emit", "show"):
        result = hyst(command, name, *(("-o", "fw") if command == "emit" else ()), code=2)
        assert name in result.stderr
        assert "error: " in result.stderr
        assert len(result.stderr) < 1000, "one clear message"
        assert result.stdout == ""
    assert everything() == before


@pytest.mark.parametrize("words", [
    "frobnicate", "emit", "emit stage.yaml --nonsense", "emit stage.yaml other.yaml", "emit stage.yaml -o",
    "emit stage.yaml --operator sideways", "emit stage.yaml --arithmetic float16", "emit stage.yaml --engine steam",
    "emit stage.yaml --layout diagonal",
    "verify", "verify stage.yaml --json", "verify stage.yaml --targets toaster", "verify stage.yaml --targets host,",
    "simulate stage.yaml", "simulate stage.yaml missing.csv", "simulate stage.yaml .",
    "simulate missing.yaml drive.csv",
    "simulate stage.yaml drive.csv --operator both", "simulate stage.yaml drive.csv --operator inverse",
    "simulate stage.yaml drive.csv --history 1,two", "simulate stage.yaml drive.csv --history 1,",
    "simulate stage.yaml drive.csv --history nan", "simulate stage.yaml drive.csv --history 1,inf",
    "simulate stage.yaml drive.csv --rest -1", "simulate stage.yaml drive.csv --rest nan",
    "simulate stage.yaml drive.csv --columns v", "simulate stage.yaml drive.csv --columns v=U",
    "simulate stage.yaml drive.csv --delimiter ;", "simulate stage.yaml drive.csv --sample-time 0",
    "simulate stage.yaml drive.csv -o file/out.csv", "simulate stage.yaml drive.csv other.csv",
    "simulate stage.yaml drive.csv other.csv -o file", "simulate stage.yaml drive.csv missing.csv -o new",
    "identify missing.csv -o new.yaml", "identify drive.csv", "identify stage.yaml -o new.yaml",
    "identify drive.csv -o new/", "identify drive.csv -o new.yaml --units V",
    "identify drive.csv -o new.yaml --units ,", "identify drive.csv -o new.yaml --units V,um,s",
    "show", "show stage.yaml --plot out.pdf", "show stage.yaml --plot no/such/folder/out.png",
    "show stage.yaml --plot .", "schema stage.yaml",
])  # fmt: skip
def test_bad_usage_is_refused_without_a_trace(words: str) -> None:
    for name in ("drive.csv", "other.csv"):
        write(name, {"t": [0.0, 1.0, 2.0], "v": [0.0, 1.0, 2.0]})
    Path("file").write_text("a file")
    before = everything()
    hyst(*words.split(), code=2)
    assert everything() == before, "nothing half-written"


@pytest.mark.parametrize(("words", "said"), [
    ("identify stage.yaml -o new.yaml", "stage.yaml: error: is a parameter file; give a recording"),
    ("identify drive.csv -o new/", "'new/' is a folder; give the file to write, as in new/stage_x.yaml"),
    ("identify drive.csv -o new.yaml --units V", "'V' is not two units; give those of the drive and the output"),
    ("identify drive.csv -o new.yaml --name 2x", 'error: the name "2x" is not a usable C prefix'),
    ("identify drive.csv -o new.yaml --delimiter ;", "csv:1:1: error: has commas between its cells, not semicolons; "),
    ("identify drive.csv -o new.yaml --delimiter tab", "has commas between its cells, not tabs; leave out --"),
    ("identify drive.csv -o new.yaml --columns 1,2", 'column "t" is t already and cannot be v too; name another'),
    ("simulate stage.yaml drive.csv other.csv -o file", "file is a file, and several records need -o with a folder"),
    ("show nowhere.yaml", "cannot be read (No such file or directory); give the path of a parameter file"),
])  # fmt: skip
def test_what_a_stumble_is_answered_with(words: str, said: str) -> None:
    for name in ("drive.csv", "other.csv"):
        write(name, {column: [0.1 * k for k in range(20)] for column in ("t", "v", "y")})
    Path("file").write_text("a file")
    assert said in re.sub(r"\s+", " ", hyst(*words.split(), code=2).stderr)


def test_files_behind_holdout_and_patterns(monkeypatch: pytest.MonkeyPatch) -> None:
    """After --holdout, only the first file of a pattern that the shell expands is held out; in quotes, all are."""
    taken: list[tuple[list[str], list[str]]] = []

    def read(sources: Sequence[str], **_: Any) -> None:
        taken.append(tuple(sources))
        raise ValueError("read")

    monkeypatch.setattr(records, "read_records", read)
    Path("held").mkdir()
    for name in ("a.csv", "held/b.csv", "held/c.csv", "held/d.csv"):
        write(name, {"t": [0.0], "v": [0.0], "y": [0.0]})
    expanded = ["held/b.csv", "held/c.csv", "held/d.csv"]
    err = hyst("identify", "a.csv", "--holdout", *expanded, "-o", "x.yaml", code=2).stderr
    assert err.startswith(
        "warning: held/c.csv and 1 more will be fitted, not held out: --holdout takes one file; put a pattern in "
        "quotes, --holdout 'held/*.csv'\n"
    )
    for words in (["a.csv", "--holdout", "held/*.csv"], ["--holdout", "held/*.csv", "a.csv"]):
        assert "warning" not in hyst("identify", *words, "-o", "x.yaml", code=2).stderr
        assert taken.pop() == ("a.csv", *expanded)
    hyst("identify", "held/[bc].csv", "-o", "x.yaml", code=2)
    assert taken.pop() == ("held/b.csv", "held/c.csv")
    assert "no file matches no*.csv;" in hyst("identify", "a.csv", "no*.csv", "-o", "x.yaml", code=2).stderr


def test_messages_reach_the_shell(installed: str) -> None:
    """Exit codes and output streams of a real process."""
    Path("p0.yaml").write_text(NO_INVERSE)
    done = process("emit", "p0.yaml", "-o", "fw", code=1)
    assert "p_0" in done.stderr
    assert done.stdout == ""
    done = process("emit", "stage.yaml", "-o", "fw")
    assert done.stdout.splitlines() == [f"fw/{name}" for name in OUTPUTS]
    assert done.stderr == ""
    Path("fw/stage.h").unlink()
    assert "fw/stage.h" in process("emit", "stage.yaml", "-o", "fw", "--check", code=1).stderr
    assert process("--version").stdout.split()[-1] == hystgen.__version__
    process("show", code=2)
    code = "import sys\nfrom hystgen import cli\ncli.main(sys.argv[1:], standalone_mode=False)\nprint(*sys.modules)"
    command = [sys.executable, "-c", code, "emit", "stage.yaml", "-o", "fw"]
    loaded = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()[-1].split()
    assert "hystgen.emission.module" in loaded
    assert not {"numba", "scipy", "matplotlib", "pandas", "cffi", "rich"} & set(loaded), "emit starts fast"
    of_effects = [name for name in loaded if name.startswith(("hystgen.effects.", "hystgen.compensator.chain"))]
    assert of_effects == [], "a plain model has no effect"
    assert not {"hystgen.compensator.fixed_tables", "hystgen.emission.fixed", "hystgen.cli.verify"} & set(loaded)
    file = ("--json", "no/such/folder/report.json", "--compiler", installed)
    assert "no/such/folder" in process("verify", "stage.yaml", *file, code=2).stderr


@pytest.mark.parametrize("output", ["file", "file/below"])
def test_a_file_in_place_of_the_output_folder(output: str) -> None:
    Path("file").write_text("not a folder")
    before = everything()
    for more in ((), ("--layout", "single-header")):
        result = hyst("emit", "stage.yaml", "-o", output, *more, code=2)
        assert "file" in result.stderr
        assert result.stdout == ""
    assert everything() == before


def test_the_folder_of_the_c_may_be_in_the_parameter_file() -> None:
    """It is relative to that file; `-o` goes before it; without either it is the current folder."""
    Path("models").mkdir()
    into = "emit: {output: ../fw/x}\n"
    Path("models/x.yaml").write_text(STAGE.replace("name: stage", "name: x") + into)
    Path("models/y.yaml").write_text(STAGE.replace("name: stage", "name: y") + into)
    Path("models/z.yaml").write_text(STAGE.replace("name: stage", "name: x") + "emit: {output: z}\n")
    files = ("models/x.yaml", "models/y.yaml", "models/z.yaml", "stage.yaml")
    names = {one: [name.replace("stage", one) for name in OUTPUTS] for one in ("x", "y", "stage")}
    paths = [
        *(f"fw/x/{name}" for name in names["x"] + names["y"]), *(f"models/z/{name}" for name in names["x"]),
        *names["stage"],
    ]
    assert hyst("emit", *files, "--list-outputs").lines == paths
    assert hyst("emit", *files).lines == paths
    assert all(Path(path).is_file() for path in paths)
    assert hyst("emit", *files, "--check").stdout == ""
    assert Path("fw/x/x.c").read_bytes() == Path("models/z/x.c").read_bytes(), "the folder changes no byte"
    with Path("fw/x/y.c").open("a") as file:
        file.write("int more;\n")
    Path("models/z/x.h").unlink()
    said = hyst("emit", *files, "--check", code=1).stderr
    assert [line for line in said.splitlines() if line.startswith("error: ")] == [
        "error: fw/x/y.c was edited by hand", "error: models/z/x.h is missing",
    ]  # fmt: skip
    (command,) = commands(said)
    assert command == "hystgen emit models/y.yaml models/z.yaml"
    run_command(command)
    hyst("emit", *files, "--check")
    assert hyst("emit", "models/x.yaml", "-o", "elsewhere").lines == [f"elsewhere/{name}" for name in names["x"]]
    # A model that lost its emit.output, though it is given
    last = Path("models/y.yaml").read_text()
    Path("models/y.yaml").write_text(last.replace(into, ""))
    said = hyst("emit", *files[:2], "--check", code=1).stderr
    assert "fw/x/y.c belongs to model y, whose C goes to ./: see emit.output in models/y.yaml" in said
    Path("models/y.yaml").write_text(last)
    # A file of one folder is left over there, though its model is given for another
    Path("models/z.yaml").unlink()
    said = hyst("emit", *files[:1], "--check", code=1).stderr
    assert "fw/x/y.c belongs to model y, which is not in any of the given parameter files" in said
    assert "rm fw/x/y.c fw/x/y.h" in said
    Path("models/y.yaml").write_text(STAGE.replace("name: stage", "name: X") + into)
    assert "two models are called x (models/x.yaml, models/y.yaml), so" in hyst("emit", *files[:2], code=2).stderr


def test_parameter_files_may_be_a_pattern() -> None:
    """For callers without a shell, such as pre-commit."""
    other("second")
    assert hyst("emit", "s*.yaml", "-o", "fw").lines == [
        f"fw/{name.replace('stage', one)}" for one in ("second", "stage") for name in OUTPUTS
    ]
    hyst("emit", "s*.yaml", "-o", "fw", "--check")
    assert "error: no file matches t*.yaml; correct the pattern" in hyst("emit", "t*.yaml", "--check", code=2).stderr
    assert "error: no file matches t*.yaml" in hyst("verify", "t*.yaml", code=2).stderr


def test_quiet_prints_what_is_wrong_and_nothing_else() -> None:
    for arguments in (["-o", "fw"], ["-o", "fw", "--check"]):
        result = hyst("emit", "stage.yaml", "--quiet", *arguments)
        assert (result.stdout, result.stderr) == ("", "")
    Path("fw/stage.c").unlink()
    assert "fw/stage.c is missing" in hyst("emit", "stage.yaml", "-q", "-o", "fw", "--check", code=1).stderr
    assert hyst("emit", "stage.yaml", "-q", "--list-outputs").lines == OUTPUTS


def cases(path: str = "r.xml") -> dict[str, ElementTree.Element]:
    """The test cases of a JUnit file by name."""
    return {case.get("name") or "": case for case in ElementTree.parse(path).getroot().iter("testcase")}


def test_check_reports_as_junit() -> None:
    """A case per file, with its hash; a suite for files that no model writes; sums that agree."""
    second, how = other("second"), ("-o", "fw", "--check", "--junit", "r.xml")
    hyst("emit", "stage.yaml", second, "-o", "fw")
    hyst("emit", "stage.yaml", second, *how)
    root = ElementTree.parse("r.xml").getroot()
    assert [root.get(key) for key in ("tests", "failures", "errors")] == ["8", "0", "0"]
    assert float(root.get("time", "")) > 0.0
    for name, case in cases().items():
        digest = hashlib.sha256(Path(name).read_bytes()).hexdigest()
        assert [(p.get("name"), p.get("value")) for p in case.iter("property")] == [("sha256", digest)]
    suite = root[0]
    about = {p.get("name"): p.get("value") for p in suite.findall("properties/property")}
    parameters = re.search(r"Parameters: sha256 (\w+)", Path("fw/stage.c").read_text())
    assert parameters
    assert about == {"hystgen": hystgen.__version__, "sha256 parameters": parameters[1]}
    Path("fw/stage.c").unlink()
    said = hyst("emit", "stage.yaml", *how, code=1).stderr
    failed = {name: case.find("failure") for name, case in cases().items()}
    assert {name for name, failure in failed.items() if failure is not None} == {
        "fw/stage.c", *(f"fw/{name.replace('stage', 'second')}" for name in OUTPUTS)
    }  # fmt: skip
    assert all(f"error: {failure.get('message')}\n" in said for failure in failed.values() if failure is not None)
    root = ElementTree.parse("r.xml").getroot()
    assert [root.get(key) for key in ("tests", "failures", "errors")] == ["8", "5", "0"]


def test_junit_is_refused_where_it_cannot_be_written() -> None:
    hyst("emit", "stage.yaml", "-o", "fw")
    before = everything()
    for how, said in (
        (["--junit", "r.xml"], "add --check"), (["--check", "--junit", "stage.yaml"], "is an input"),
        (["--check", "--junit", "no/r.xml"], "no/r.xml"),
    ):  # fmt: skip
        assert said in hyst("emit", "stage.yaml", "-o", "fw", *how, code=2).stderr
        assert everything() == before
    Path("bad.yaml").write_text(BROKEN)
    hyst("emit", "stage.yaml", "bad.yaml", "-o", "fw", "--check", "--junit", "r.xml", code=2)
    assert not Path("r.xml").exists(), "nothing was checked"


def test_thirty_models_are_checked_in_ten_seconds() -> None:
    """Half of them with creep and a front; counted in processor time, since other tests run beside this one."""
    front = "  memoryless: {kind: tanh, ascending: {a0: 6.0, a1: 0.2, a2: 0.0, a3: 0.0}}\n"
    creep = "  effects: [{name: creep, time_constants: [0.1, 1.0], weights: [0.02, 0.01]}]\n"
    for k in range(30):
        text = STAGE.replace("name: stage", f"name: axis_{k}").replace("1.5", f"1.{k}")
        more = f"{front}{creep}sample_time: 1.0e-4\n" if k % 2 else ""
        Path(f"axis_{k}.yaml").write_text(f"{text}{more}emit: {{output: fw}}\n")
    assert len(hyst("emit", "axis_*.yaml").lines) == 30 * len(OUTPUTS)
    begun = time.process_time()
    hyst("emit", "axis_*.yaml", "--check")
    assert time.process_time() - begun < 10.0


def test_a_folder_in_place_of_an_output_file_stops_all_of_them() -> None:
    for name in OUTPUTS:
        folder = Path(f"fw_{name}")
        hyst("emit", "stage.yaml", "-o", folder)
        (folder / name).unlink()
        (folder / name / "kept").mkdir(parents=True)
        before = everything(folder)
        result = hyst("emit", "stage.yaml", "-o", folder, "--arithmetic", "float64", code=2)
        assert str(folder / name) in result.stderr
        assert everything(folder) == before, "nothing half-written"


def test_a_projected_start_memory_is_reported_on_stderr() -> None:
    Path("listed.yaml").write_text(FILES["listed"])
    result = hyst("emit", "listed.yaml", "-o", "fw")
    assert "initial_state" in result.stderr
    assert sorted(result.lines) == sorted(f"fw/{name}" for name in everything("fw"))
    assert "initial_state" not in hyst("emit", "stage.yaml", "-o", "fw").stderr


# verify --------------------------------------------------------------------------------------------------


@pytest.fixture
def installed() -> str:
    """Name of a compiler installed on this machine: gcc if there is one."""
    found = compilers.available()
    assert found, "no C compiler"
    return found[0].name


@pytest.fixture
def _few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Use verification records so short that the reference is not compiled."""
    monkeypatch.setattr(verification, "verify", partial(verification.verify, length=50))


@pytest.fixture
def _short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Use short verification records."""
    monkeypatch.setattr(verification, "verify", partial(verification.verify, length=LENGTH))


LENGTH = 2000


def report(path: str = "r.json") -> dict[str, Any]:
    """A report read as strict JSON, without NaN and Infinity."""

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is not JSON")

    found: dict[str, Any] = json.loads(Path(path).read_text(), parse_constant=refuse)
    return found


@pytest.mark.thorough
def test_verify_as_a_ci_job_runs_it(installed: str) -> None:
    Path("linear.yaml").write_text(FILES["linear"])
    done = process("verify", "linear.yaml", "--compiler", installed, "--json", "r.json", "--junit", "r.xml")
    table = done.stdout.splitlines()
    assert "compiler" in table[0]
    rows = report()["rows"]
    assert len(table) == 1 + len(rows)
    for line, row in zip(table[1:], rows, strict=True):
        assert "bits equal" in line
        assert row["target"] == "host"
        assert row["compiler"] == installed
        assert row["operator"] == "inverse"
        assert (row["ok"], row["different"], row["max_ulp"]) == (True, 0, 0)
        assert row["samples"] >= 1_000_000, "the command compares many samples"
    assert len({row["build"] for row in rows}) == 2, "strict flags, and the compiler's own defaults"
    assert report()["ok"] is True
    suite = ElementTree.parse("r.xml").getroot()
    assert suite.get("failures") == "0"
    assert suite.get("tests") == str(len(rows)) == str(len(suite.findall("testcase")))
    assert not suite.findall(".//failure")
    assert sum(float(case.get("time", "")) for case in suite.iter("testcase")) == pytest.approx(
        float(suite.get("time", "")), abs=1e-3 * len(rows)
    )


@pytest.mark.usefixtures("_few")
def test_verify_reports_version_and_hashes_of_what_emit_writes(installed: str) -> None:
    """Also where effects are left out, of which the banner has the hash of all parameters."""
    later = "  effects: [{name: drift, shape: linear, rate: 0.1}]\nsample_time: 1.0e-4\n"
    Path("part.yaml").write_text(STAGE.replace("name: stage", "name: part") + later)
    for path, options in (("stage.yaml", ["--layout", "single-header"]), ("part.yaml", ["--allow-partial"])):
        begun = time.perf_counter()
        hyst("verify", path, "--compiler", installed, *options, "--junit", "r.xml", "--json", "r.json")
        took = time.perf_counter() - begun
        written = hyst("emit", path, "-o", "fw", *options).lines
        digests = {Path(file).name: hashlib.sha256(Path(file).read_bytes()).hexdigest() for file in written}
        said = report()
        assert said["version"] == hystgen.__version__
        assert said["sha256"].items() >= digests.items()
        assert f"sha256 {said['sha256']['parameters']}" in Path(written[0]).read_text()
        suite = ElementTree.parse("r.xml").getroot()
        about = {p.get("name"): p.get("value") for p in suite.findall("properties/property")}
        assert about == {
            "hystgen": hystgen.__version__, **{f"sha256 {name}": value for name, value in said["sha256"].items()}
        }  # fmt: skip
        assert 0.0 < float(suite.get("time", "")) < took


@pytest.mark.usefixtures("_few")
def test_verify_quietly_shows_only_models_that_fail(installed: str, monkeypatch: pytest.MonkeyPatch) -> None:
    second, how = other("second"), ("--compiler", installed, "--quiet")
    result = hyst("verify", "stage.yaml", second, *how)
    assert (result.stdout, result.stderr) == ("", "")
    sabotage(monkeypatch, "inverse", up)
    monkeypatch.setattr(module, "files", partial(_only_stage, module.files, right=_RIGHT))
    monkeypatch.setattr(verification, "verify", partial(verification.verify, length=LENGTH))
    result = hyst("verify", second, "stage.yaml", *how, code=1)
    assert result.stderr == "verification failed\n"
    assert "differ" in result.stdout
    assert "second" not in result.stdout


@pytest.mark.usefixtures("_few")
def test_verify_compares_what_it_is_asked_for(installed: str) -> None:
    result = hyst("verify", "stage.yaml", "--compiler", installed, "--operator", "both", "--arithmetic", "float64",
                  "--engine", "loop", "--layout", "single-header", "--json", "r.json")  # fmt: skip
    said = report()
    assert (said["name"], said["arithmetic"], said["engine"]) == ("stage", "float64", "loop")
    assert said["layout"] == "single-header"
    assert {row["operator"] for row in said["rows"]} == {"forward", "inverse"}
    assert result.stdout.count("bits equal") == len(said["rows"]) == 4
    assert sorted(everything()) == ["r.json", "stage.yaml"], "the C is not left behind"


@pytest.mark.usefixtures("_short")
def test_a_compiler_that_is_not_installed_fails_and_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compilers, "find", lambda _: None)
    Path("linear.yaml").write_text(FILES["linear"])
    for arguments, named in ((("--compiler", "clang"), "clang"), ((), "compiler")):
        result = hyst("verify", "linear.yaml", *arguments, "--json", "r.json", "--junit", "r.xml", code=2)
        assert named in result.stdout
        assert re.search("install(ed)?[ :]", result.stdout)
        assert "verification failed" not in result.stderr
        assert report()["ok"] is False
        assert all(row["missing"] for row in report()["rows"])
        suite = ElementTree.parse("r.xml").getroot()
        assert int(suite.get("errors", 0)) == len(suite.findall("testcase")) == len(suite.findall(".//error")) > 0
        assert suite.get("failures") == "0"


@pytest.mark.usefixtures("_few")
def test_a_compiler_that_does_not_exist_fails_and_is_named(installed: str) -> None:
    Path("linear.yaml").write_text(FILES["linear"])
    result = hyst("verify", "linear.yaml", "--compiler", "no-such-cc", "--compiler", installed, code=2)
    assert "no-such-cc is not installed; install it, or name another compiler: gcc, clang, zig" in result.stdout
    assert result.stdout.count("bits equal") == 2


@pytest.mark.usefixtures("_short")
def test_a_missing_tool_does_not_hide_a_wrong_bit(installed: str, monkeypatch: pytest.MonkeyPatch) -> None:
    sabotage(monkeypatch, "inverse", up)
    result = hyst("verify", "stage.yaml", "--compiler", "no-such-cc", "--compiler", installed, code=1)
    assert "verification failed" in result.stderr


@pytest.mark.usefixtures("_short")
def test_several_models_are_verified_in_one_report(installed: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two of them have the same name, and one of them is wrong."""
    Path("linear.yaml").write_text(FILES["linear"])
    Path("other").mkdir()
    Path("other/linear.yaml").write_text(FILES["linear"].replace("[2]", "[3]"))
    files = ("stage.yaml", "linear.yaml", "other/linear.yaml")
    how = ("--compiler", installed, "--json", "r.json", "--junit", "r.xml")
    result = hyst("verify", *files, "stage.yaml", *how)  # one named twice
    *tables, summary = result.lines
    assert sum("bits equal" in line for line in tables) == 6
    assert summary == "bits equal in 3 of 3 models"
    assert [line.split(":")[0] for line in result.stdout.splitlines() if ": " in line] == list(files)
    said = report()
    assert (said["hystgen"], said["ok"], [one["file"] for one in said["reports"]]) == (1, True, list(files))
    assert [one["name"] for one in said["reports"]] == ["stage", "linear", "linear"]
    assert all(row["ok"] for one in said["reports"] for row in one["rows"])
    root = ElementTree.parse("r.xml").getroot()
    assert (root.tag, root.get("tests"), root.get("failures"), root.get("errors")) == ("testsuites", "6", "0", "0")
    names = {(case.get("classname"), case.get("name")) for case in root.iter("testcase")}
    assert len(names) == 6, "no test case hides another"
    sabotage(monkeypatch, "inverse", up)
    monkeypatch.setattr(module, "files", partial(_only_stage, module.files, right=_RIGHT))
    result = hyst("verify", "linear.yaml", "stage.yaml", *how, code=1)
    assert [one["ok"] for one in report()["reports"]] == [True, False]
    assert result.lines[-1] == "bits equal in 1 of 2 models; wrong in stage"
    result = hyst("verify", "linear.yaml", "other/linear.yaml", "--compiler", "no-such-cc", code=2)
    assert result.lines[-1] == "bits equal in 0 of 2 models; could not run all of linear.yaml, other/linear.yaml"


_RIGHT = module.files


def _only_stage(wrong: Callable[..., dict[str, str]], *arguments: Any, right: Any) -> dict[str, str]:
    made: dict[str, str] = (wrong if arguments[0].compensator.names.name == "stage" else right)(*arguments)
    return made


def test_one_model_that_is_refused_stops_all_before_any_runs() -> None:
    Path("flat.yaml").write_text(NO_INVERSE)
    Path("bad.yaml").write_text(BROKEN)
    before = everything()
    result = hyst("verify", "stage.yaml", "flat.yaml", "--json", "r.json", code=1)
    assert "flat.yaml: error: no inverse" in result.stderr
    assert "verifying" not in result.stderr
    result = hyst("verify", "stage.yaml", "bad.yaml", "gone.yaml", "--json", "r.json", code=2)
    assert "bad.yaml:3:" in result.stderr
    assert "gone.yaml: error: cannot be read" in result.stderr
    assert everything() == before


@pytest.mark.usefixtures("_few")
@pytest.mark.parametrize(
    ("weights", "effect", "more"),
    [
        ("[0.0, 0.02, 0.01]", "name: creep, time_constants: [0.1], weights: [0.02]", ""),
        ("[0.1, 0.02, 0.01]", "name: lag, time_constant: 0.1", "emit: {compensation: {noise_gain: 1.0e-3}}\n"),
    ],
)
def test_verify_takes_the_forward_operators_that_emit_writes(
    weights: str, effect: str, more: str, installed: str
) -> None:
    """Models without an inverse, or with one that is too noisy, can still emit and verify the forward operator."""
    Path("m.yaml").write_text(
        "hystgen: 1\nname: m\nsample_time: 1.0e-3\ninput_range: [0.0, 100.0]\nmodel:\n"
        f"  pi: {{thresholds: [0, 5, 10], weights: {weights}}}\n  effects:\n    - {{{effect}}}\n{more}"
    )
    for command in (("emit", "m.yaml", "-o", "fw"), ("verify", "m.yaml", "--compiler", installed)):
        hyst(*command, code=1)
        hyst(*command, "--operator", "forward")


def sabotage(monkeypatch: pytest.MonkeyPatch, operator: str, change: Callable[[np.float32], np.float32]) -> None:
    """From now on emit C with a changed gain of the last play."""
    right = module.files

    def wrong(*arguments: Any) -> dict[str, str]:
        made = right(*arguments)
        table = re.search(rf"stage_{operator}_segment\[\d+\] = \{{\n(.*\n)+?\}};", made["stage.c"])
        assert table, "no segments"
        last = r"(\{\S+ \S+ )(\S+)f(, \S+\},\s+\{[^{}]+\}\n\};)"  # except that of a play that never follows
        found = re.search(last, table[0])
        assert found, table[0]
        changed = found[1] + literal(change(np.float32(found[2]))) + found[3]
        return {**made, "stage.c": made["stage.c"].replace(found[0], changed)}

    monkeypatch.setattr(module, "files", wrong)


def up(x: np.float32) -> np.float32:
    """The next larger number."""
    return np.nextafter(x, np.float32(np.inf))


@pytest.mark.usefixtures("_short")
def test_one_wrong_bit_in_a_table_fails_and_the_first_wrong_sample_is_named(
    installed: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    sabotage(monkeypatch, "inverse", up)
    result = hyst("verify", "stage.yaml", "--compiler", installed, "--json", "r.json", "--junit", "r.xml", code=1)
    rows = [row for row in report()["rows"] if row["operator"] == "inverse"]
    assert len(rows) == 2
    assert all(not row["ok"] and row["different"] > 0 and row["max_ulp"] >= 1 for row in rows)
    suite = ElementTree.parse("r.xml").getroot()
    assert int(suite.get("failures", 0)) == len(suite.findall(".//failure")) >= 2
    assert "bits equal" not in result.stdout

    # The first sample at which the bit-exact reference itself answers differently with that number
    model = hystgen.load("stage.yaml")
    numbers, other = (tables.build(model.cascade, "float32", "corners") for _ in range(2))
    other.inverse.gain[-2] = up(other.inverse.gain[-2])  # the last one belongs to a play that never follows
    real = np.dtype(np.float32)
    for expected, found in zip(*(run.expected_records(x, real, True, LENGTH) for x in (numbers, other)), strict=True):
        bits = (expected.answer.view(np.uint32) != found.answer.view(np.uint32)) | (expected.status != found.status)
        if bits.any():
            first = int(np.argmax(bits))
            break
    assert first > 1, "not the first sample of all, which would be named too easily"
    said = result.stdout + result.stderr
    assert expected.name in said
    assert re.search(rf"\b{first}\b", said), f"sample {first} of {expected.name!r} is not named in\n{said}"


@pytest.mark.usefixtures("_short")
def test_answers_that_are_no_numbers_fail_and_the_report_is_still_json(
    installed: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    sabotage(monkeypatch, "forward", lambda _: np.finfo(np.float32).max)
    how = ("--compiler", installed, "--operator", "forward", "--json", "r.json", "--junit", "r.xml")
    hyst("verify", "stage.yaml", *how, code=1)
    assert not any(row["ok"] for row in report()["rows"])
    assert ElementTree.parse("r.xml").findall(".//failure")


# simulate ------------------------------------------------------------------------------------------------


class Plays:
    """The textbook model: the weighted sum of plays (3)."""

    def __init__(self, r: Sequence[float] = R, p: Sequence[float] = P, s: Sequence[float] = M0) -> None:
        self.r, self.p, self.s = r, p, [s[1], *s[1:]]

    def at(self, v: float) -> list[float]:
        return [max(v - r, min(v + r, s)) for r, s in zip(self.r, self.s, strict=True)]

    def output(self, s: Sequence[float]) -> float:
        return math.fsum(p * x for p, x in zip(self.p, s, strict=True)) + OFFSET

    def see(self, v: float) -> float:
        self.s = self.at(v)
        return self.output(self.s)

    def drive_for(self, u: float, low: float = LOW, high: float = HIGH) -> float:
        """The drive in [low, high] whose output is nearest to u, by bisection: the output rises with the drive."""
        a, b = low, high
        for _ in range(80):
            middle = (a + b) / 2
            a, b = (middle, b) if self.output(self.at(middle)) < u else (a, middle)
        self.see(b)
        return b


def reachable() -> tuple[float, float]:
    """Extremes of the output, reached by going straight from the start to either end of the range."""
    return Plays().see(LOW), Plays().see(HIGH)


def write(path: str, columns: dict[str, Iterable[float]], delimiter: str = ",") -> None:
    """Write a data file without the package."""
    rows = zip(*columns.values(), strict=True)
    lines = [delimiter.join(columns), *(delimiter.join(repr(float(x)) for x in row) for row in rows)]
    Path(path).write_text("\n".join(lines) + "\n")


def table(text: str) -> dict[str, list[float]]:
    """Columns of a CSV text, whose rows must be complete and whose cells must be numbers."""
    names, *rows = csv.reader(io.StringIO(text))
    assert len(set(names)) == len(names)
    assert all(len(row) == len(names) for row in rows)
    return {name: [float(row[k]) for row in rows] for k, name in enumerate(names)}


def swing(seed: int, count: int = 150, reach: float = HIGH) -> list[float]:
    """Drive samples between random turning points, exact in float32."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-reach, reach, count // 10 + 1)
    path = np.interp(np.linspace(0, len(points) - 1, count), np.arange(len(points)), points)
    return [float(x) for x in path.astype(np.float32)]


def close(found: Sequence[float], expected: Sequence[float], tolerance: float) -> None:
    assert len(found) == len(expected)
    assert max(abs(a - b) for a, b in zip(found, expected, strict=True)) <= tolerance


def test_simulate_adds_y_and_keeps_what_was_measured() -> None:
    v = swing(1)
    t = [k * 1e-3 for k in range(len(v))]
    measured = [float(k) for k in range(len(v))]
    warm = [20 + x / 7 for x in v]
    write("drive.csv", {"t": t, "v": v, "y": measured, "temperature": warm})
    result = hyst("simulate", "stage.yaml", "drive.csv")
    assert result.stderr == ""
    found = table(result.stdout)
    assert set(found) == {"t", "v", "y", "y_measured", "temperature"}
    assert (found["t"], found["v"], found["y_measured"], found["temperature"]) == (t, v, measured, warm)
    plays = Plays()
    close(found["y"], [plays.see(x) for x in v], 1e-13)
    assert np.array(found["y"]).tobytes() == hystgen.load("stage.yaml").simulate(v).tobytes()

    again = hyst("simulate", "stage.yaml", "drive.csv", "-o", "out.csv")
    assert again.lines == ["out.csv"]
    assert Path("out.csv").read_text() == result.stdout


def test_simulate_without_y_makes_no_measured_column() -> None:
    v = swing(2)
    write("drive.csv", {"t": range(len(v)), "v": v})
    assert set(table(hyst("simulate", "stage.yaml", "drive.csv").stdout)) == {"t", "v", "y"}


def test_simulate_loses_no_column_when_y_measured_is_there_already() -> None:
    columns = {"t": [0.0, 1.0, 2.0], "v": [0.0, 1.0, 2.0], "y": [7.0, 8.0, 9.0], "y_measured": [4.0, 5.0, 6.0]}
    write("drive.csv", columns)
    result = CliRunner().invoke(cli.main, ["simulate", "stage.yaml", "drive.csv"])
    if result.exit_code == 2:
        assert "y_measured" in result.stderr
    else:
        assert result.exit_code == 0
        kept = table(result.stdout).values()
        assert all(column in kept for column in columns.values())


def test_simulate_reads_other_names_delimiters_and_formats() -> None:
    v = swing(3)
    plays = Plays()
    y = [plays.see(x) for x in v]
    write("drive.txt", {"U": v, "Pos": range(len(v))}, delimiter=";")
    naming = ("--columns", "v=U,y=Pos", "--delimiter", ";", "--sample-time", 0.5)
    result = hyst("simulate", "stage.yaml", "drive.txt", *naming)
    found = table(result.stdout)
    assert found["v"] == v
    assert found["y_measured"] == list(range(len(v)))
    assert found["t"] == [0.5 * k for k in range(len(v))]
    close(found["y"], y, 1e-13)
    np.savez("drive.npz", t=np.arange(len(v)) * 0.5, v=np.array(v))
    Path("made").mkdir()
    assert hyst("simulate", "stage.yaml", "drive.npz", "-o", "made").lines == ["made/drive.csv"]
    close(table(Path("made/drive.csv").read_text())["y"], y, 1e-13)


def test_simulate_several_files_are_one_session() -> None:
    parts = {"first": swing(4, reach=1.5), "second": swing(5, reach=1.0), "third": swing(6, reach=2.0)}
    for name, v in parts.items():
        write(f"{name}.csv", {"t": range(len(v)), "v": v})
    files = [f"{name}.csv" for name in parts]
    result = hyst("simulate", "stage.yaml", *files, "-o", "out", "--history", "-4,2", "--rest", "6.4")
    assert result.lines == [f"out/{file}" for file in files]
    assert sorted(everything("out")) == sorted(files)
    plays, cold = Plays(), Plays()
    plays.see(-4.0)
    plays.see(2.0)
    for name, v in parts.items():
        found = table(Path(f"out/{name}.csv").read_text())
        close(found["y"], [plays.see(x) for x in v], 1e-13)
        if name == "second":
            alone = [cold.see(x) for x in v]
            assert max(abs(a - b) for a, b in zip(found["y"], alone, strict=True)) > 0.01, "memory makes a difference"
    one = hyst("simulate", "stage.yaml", "first.csv", "--history", "-4,2").stdout
    assert one == Path("out/first.csv").read_text()
    assert one != hyst("simulate", "stage.yaml", "first.csv").stdout

    Path("back").mkdir()
    hyst("simulate", "stage.yaml", *reversed(files), "-o", "back")
    plays = Plays()
    for name, v in reversed(parts.items()):
        close(table(Path(f"back/{name}.csv").read_text())["y"], [plays.see(x) for x in v], 1e-13)


def test_simulate_never_writes_over_a_record() -> None:
    for folder in ("a", "b"):
        Path(folder).mkdir()
        write(f"{folder}/drive.csv", {"t": [0.0, 1.0], "v": [0.0, 1.0]})
    write("a/other.csv", {"t": [0.0, 1.0], "v": [0.0, 1.0]})
    before = everything()
    for arguments in (
        ("a/drive.csv", "-o", "a/drive.csv"), ("a/drive.csv", "-o", "a"), ("a/drive.csv", "a/other.csv", "-o", "a"),
        ("a/drive.csv", "b/drive.csv", "-o", "new"),
    ):  # fmt: skip
        hyst("simulate", "stage.yaml", *arguments, code=2)
        assert everything() == before, arguments


def test_simulate_into_a_folder_that_is_named_as_one() -> None:
    write("drive.csv", {"t": [0.0, 1.0], "v": [0.0, 1.0]})
    hyst("simulate", "stage.yaml", "drive.csv", "-o", "made/")
    assert Path("made/drive.csv").is_file()


def test_simulate_forward_outside_the_range_warns_and_is_not_clamped() -> None:
    v = [1.5 * x for x in swing(7)]
    outside = sum(not LOW <= x <= HIGH for x in v)
    assert outside > 10
    write("drive.csv", {"t": range(len(v)), "v": v})
    result = hyst("simulate", "stage.yaml", "drive.csv")
    plays = Plays()
    close(table(result.stdout)["y"], [plays.see(x) for x in v], 1e-12)
    assert "drive.csv" in result.stderr
    assert re.search(rf"\b{outside}\b.*\b{len(v)}\b", result.stderr)
    assert "input_range" in result.stderr
    bits = hyst("simulate", "stage.yaml", "drive.csv", "--arithmetic", "float64")
    plays = Plays()
    close(table(bits.stdout)["y"], [plays.see(min(max(x, LOW), HIGH)) for x in v], 1e-12)


def test_simulate_inverse_reads_u_writes_v_and_counts_what_it_clamps() -> None:
    low, high = reachable()
    u = [x * 4 + OFFSET for x in swing(8)]
    outside = sum(not low <= x <= high for x in u)
    assert outside > 10
    write("reference.csv", {"t": range(len(u)), "u": u, "v": range(len(u)), "y": u})
    result = hyst("simulate", "stage.yaml", "reference.csv", "--operator", "inverse")
    found = table(result.stdout)
    assert set(found) == {"t", "u", "v", "v_measured", "y"}
    assert found["u"] == found["y"] == u
    assert found["v_measured"] == list(range(len(u)))
    plays = Plays()
    close(found["v"], [plays.drive_for(min(max(x, low), high)) for x in u], 1e-11)
    assert all(LOW <= x <= HIGH for x in found["v"])
    assert re.search(rf"\b{outside} of {len(u)} references\b", result.stderr), result.stderr
    # and these drives give the outputs asked for
    plays = Plays()
    close([plays.see(x) for x in found["v"]], [min(max(x, low), high) for x in u], 1e-11)


def test_simulate_inverse_counts_the_drives_that_the_range_limits() -> None:
    """One play never returns to its start, so outputs near the top can be reached only once."""
    r, p, s, ends = (0.0, 3.0), (1.0, 0.5), (0.0, 2.5), (-2.0, 2.0)
    Path("once.yaml").write_text(
        f"hystgen: 1\nname: once\ninput_range: {list(ends)}\nmodel:\n"
        f"  pi: {{thresholds: {list(r)}, weights: {list(p)}, initial_state: {list(s)}}}\n  output_offset: {OFFSET}\n"
    )
    u = [OFFSET + x for x in (3.2, -1.4, 3.2, 3.1, 2.0, 3.2)]
    write("u.csv", {"t": range(len(u)), "u": u})
    result = hyst("simulate", "once.yaml", "u.csv", "--operator", "inverse")
    plays = Plays(r, p, s)
    drives = [plays.drive_for(x, *ends) for x in u]
    assert [d == 2.0 for d in drives] == [False, False, True, True, False, True]
    close(table(result.stdout)["v"], drives, 1e-12)
    assert re.search(r"\b3 of 6 drives\b", result.stderr), result.stderr
    assert "references" not in result.stderr


@pytest.mark.thorough
def test_simulate_inverse_after_history_takes_the_branch_of_its_own_move() -> None:
    """After moves up to 3 and down to 2, a slightly lower reference takes the falling branch, though both would do."""
    shifts = {"ascending": 0.2, "descending": 0.5}
    envelope = "".join(f"    {k}: {{a0: 6, a1: 0.4, a2: 0.1, a3: {a3}}}\n" for k, a3 in shifts.items())
    Path("two.yaml").write_text(STAGE + "  memoryless:\n    kind: tanh\n" + envelope)

    def front(v: float, branch: str) -> float:
        return 6 * math.tanh(0.4 * v + 0.1) + shifts[branch]

    def back(w: float, branch: str) -> float:
        return (math.atanh((w - shifts[branch]) / 6) - 0.1) / 0.4

    plays = Plays()
    plays.see(front(3, "ascending"))
    level = plays.see(front(2, "descending"))
    u = [level - 0.05, level - 0.1, level + 0.2, level + 0.15]
    write("u.csv", {"t": range(len(u)), "u": u})
    result = hyst("simulate", "two.yaml", "u.csv", "--operator", "inverse", "--history", "3,2")
    branches = ("descending", "descending", "ascending", "descending")
    expected = [back(plays.drive_for(x, -7, 7), branch) for x, branch in zip(u, branches, strict=True)]
    assert expected[1] < expected[0] < 2 < expected[2]
    assert front(expected[0], "descending") > front(2, "ascending"), "in the gap"
    close(table(result.stdout)["v"], expected, 1e-11)


@pytest.mark.parametrize("engine", ["corners", "loop"])
@pytest.mark.parametrize("operator", ["forward", "inverse"])
def test_simulate_in_float32_is_the_bit_reference(operator: str, engine: str) -> None:
    v = swing(9, 400)
    plays = Plays()
    low, high = (np.float32(x) for x in reachable())
    u = [float(min(max(np.float32(plays.see(x)), low), high)) for x in v]
    column, answer, samples = ("v", "y", v) if operator == "forward" else ("u", "v", u)
    write("record.csv", {"t": range(len(v)), column: samples})
    how = ("--operator", operator, "--arithmetic", "float32", "--engine", engine)
    result = hyst("simulate", "stage.yaml", "record.csv", *how)
    found = table(result.stdout)
    assert found[column] == samples, "the input column is not rounded"
    model = hystgen.load("stage.yaml")
    bits = (model if operator == "forward" else model.inverse()).simulate(samples, arithmetic="float32", engine=engine)
    assert bits.dtype == np.float32
    assert np.array(found[answer], dtype=np.float32).tobytes() == bits.tobytes()
    written = [row[answer] for row in csv.DictReader(io.StringIO(result.stdout))]
    assert written == [str(x) for x in bits], "the shortest digits that give the float back"
    hyst("emit", "stage.yaml", "-o", "fw", "--operator", "both", "--engine", engine)
    macro = re.search(rf"STAGE_{operator.upper()}_MAX_ERROR (\S+)f\b", Path("fw/stage.h").read_text())
    assert macro
    plays = Plays()
    exact = [plays.see(x) for x in v] if operator == "forward" else [plays.drive_for(x) for x in u]
    close([float(x) for x in bits], exact, float(macro[1]))


@pytest.mark.parametrize(("operator", "missing"), [("forward", "v"), ("inverse", "u")])
def test_simulate_names_the_missing_column_and_those_there(operator: str, missing: str) -> None:
    write("record.csv", {"t": [0.0, 1.0], "Steuerung": [0.0, 1.0], "Weg": [0.0, 1.0]})
    result = hyst("simulate", "stage.yaml", "record.csv", "--operator", operator, code=2)
    assert result.stdout == ""
    assert "record.csv" in result.stderr
    assert f'"{missing}"' in result.stderr
    assert all(name in result.stderr for name in ("t", "Steuerung", "Weg"))


def test_simulate_reports_repairs_on_stderr_only() -> None:
    lines = ["t,v,note", *(f"{k},{math.sin(k)},text" for k in range(40))]
    lines[7] = "6,,text"
    Path("drive.csv").write_text("\n".join(lines) + "\n")
    result = hyst("simulate", "stage.yaml", "drive.csv")
    found = table(result.stdout)
    assert found["t"] == [float(k) for k in range(40) if k != 6]
    assert re.search(r"\b1 sample\b", result.stderr)
    assert "note" in result.stderr


# show ----------------------------------------------------------------------------------------------------


def test_show_prints_ranges_width_and_slopes() -> None:
    result = hyst("show", "stage.yaml")
    low, high = reachable()
    text = result.stdout
    assert f"{low:.6g} to {high:.6g} um" in text
    assert f"{LOW:.6g} to {HIGH:.6g} V" in text
    width = 2 * sum(p * r for p, r in zip(P, R, strict=True)) / sum(P)
    assert re.search(rf"width\s+{re.escape(f'{width:.6g}')}\b", text)
    ratio = sum(P) / P[0]
    assert re.search(rf"slope ratio\s+{re.escape(f'{ratio:.6g}')}\b", text)
    assert re.search(r"inverse\s+exists", text)
    assert result.stderr == ""


def test_show_says_why_there_is_no_inverse() -> None:
    Path("p0.yaml").write_text(NO_INVERSE)
    text = hyst("show", "p0.yaml").stdout
    assert not re.search(r"inverse\s+exists", text)
    assert "p_0 > 0" in text
    Path("flat.yaml").write_text(FILES["bent"].replace("-1.1, -1.1]", "-1.1, -4.0]"))
    text = hyst("show", "flat.yaml").stdout
    assert not re.search(r"inverse\s+exists", text)
    assert "between 1 and 3" in text, "the dead-zone piece that falls"


def test_show_rounds_no_bound_down() -> None:
    """Bounds are rounded up, by at most a unit of the third digit."""
    for n in range(1, 9):
        Path("dense.yaml").write_text(
            "hystgen: 1\nname: dense\ninput_range: [0, 10]\nmodel:\n  pi:\n"
            f"    density: {{formula: 0.8*exp(-0.3*r), p0: 0.7, r_max: 10, n: {n}}}\n"
        )
        model = hystgen.load("dense.yaml")
        exact = [model.parameters.model.pi.density_error, model.parameters.model.pi.density_output_error]
        for arithmetic in ("float32", "float64"):
            bounds = error_bounds(model.cascade, arithmetic, model.engine(arithmetic=arithmetic))
            exact += [bounds.forward, bounds.rounding]
        lines = [line for line in hyst("show", "dense.yaml").lines if line.startswith(("density", "error, float"))]
        shown = [float(x) for line in lines for x in re.findall(r"(?:within|forward|inverse) ([\d.e+-]+)", line)]
        assert len(shown) == len(exact)
        assert all(e <= s <= 1.01 * e for e, s in zip(exact, shown, strict=True)), (exact, shown)


@pytest.mark.parametrize(("p0", "warned"), [(2e-6, False), (1e-6, True), (1e-9, True)])
def test_show_warns_of_a_hard_inverse(p0: float, warned: bool) -> None:
    """The ratio of the slopes, (p_0 + 1.812) / p_0, exceeds 1e6 from the second case on."""
    Path("stage.yaml").write_text(STAGE.replace("[0.72,", f"[{p0!r},"))
    result = hyst("show", "stage.yaml")
    assert ("slope ratio" in result.stderr) == warned, result.stderr
    assert f"{(p0 + sum(P[1:])) / p0:.6g}" in result.stdout


@pytest.mark.parametrize(
    ("p0", "arithmetic", "advice"),
    [
        (3e-4, "q15", "use q31, raise p_0"),
        (3e-4, "q31", ""),
        (3e-2, "q15", ""),
        (1e-5, "float32", "use float64, raise p_0"),
    ],
)
def test_show_warns_of_a_wide_error_of_the_inverse(p0: float, arithmetic: str, advice: str) -> None:
    """A shown error above a twentieth of the drive's range is wide: at worst, rounding is divided by p_0."""
    Path("wide.yaml").write_text(
        "hystgen: 1\nname: wide\ninput_range: [0, 150]\nunits: {input: V, output: um}\nmodel:\n  pi:\n"
        f"    thresholds: [0, 10, 20, 40, 60]\n    weights: [{p0!r}, 0.3, 0.2, 0.1, 0.1]\n"
        f"emit: {{arithmetic: {arithmetic}}}\n"
    )
    result = hyst("show", "wide.yaml")
    (line,) = (line for line in result.lines if line.startswith(f"error, {arithmetic}"))
    shown = float(re.findall(r"inverse ([\d.e+-]+)", line)[0])
    assert (shown > 0.05 * 150.0) == bool(advice)
    off = f"the inverse in {arithmetic} may be off by {shown:g} V, {100 * shown / 150:.0f} % of the drive's range"
    assert result.stderr == (f"warning: {off}: {advice} or narrow input_range\n" if advice else "")


@pytest.mark.parametrize(
    ("drive", "pi", "said"),
    [
        ("[1.0, 1.00000001]", "{thresholds: [0, 1.0e-9], weights: [0.5, 0.1]}", "3:14: error: input_range: this range"),
        ("[0, 1.0e+30]", "{thresholds: [0, 1.0e+29], weights: [1.0e-9, 1.0e+20]}", "5:7: error: model.pi: sums of"),
    ],
)
def test_numbers_that_float32_cannot_hold_are_refused_where_they_stand(drive: str, pi: str, said: str) -> None:
    Path("far.yaml").write_text(f"hystgen: 1\nname: far\ninput_range: {drive}\nmodel:\n  pi: {pi}\n")
    before = sorted(os.listdir())
    result = hyst("emit", "far.yaml", "--arithmetic", "float32", code=2)
    assert result.stderr.startswith(f"far.yaml:{said}"), result.stderr
    assert len(result.stderr.splitlines()) == 1
    assert sorted(os.listdir()) == before
    hyst("emit", "far.yaml", "--arithmetic", "float64")


@pytest.mark.parametrize("name", ["stage", "p0"])
def test_show_draws_png_and_svg(name: str) -> None:
    Path("p0.yaml").write_text(NO_INVERSE)
    for file in ("out.png", "out.svg"):
        assert hyst("show", f"{name}.yaml", "--plot", file).lines[-1] == file
    assert Path("out.png").read_bytes().startswith(b"\x89PNG\r\n\x1a\n")
    assert ElementTree.parse("out.svg").getroot().tag == "{http://www.w3.org/2000/svg}svg"
    assert sorted(everything()) == ["out.png", "out.svg", "p0.yaml", "stage.yaml"]


def test_plots_of_other_kinds_are_refused_by_name() -> None:
    result = hyst("show", "stage.yaml", "--plot", "out.pdf", code=2)
    assert "out.pdf" in result.stderr
    assert ".png" in result.stderr
    assert ".svg" in result.stderr


def test_plots_without_matplotlib_say_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert "pip install" in hyst("show", "stage.yaml", "--plot", "out.png", code=2).stderr
    assert hyst("show", "stage.yaml").stdout


# schema and help -----------------------------------------------------------------------------------------


def test_schema_accepts_good_files_and_refuses_unknown_keys() -> None:
    result = hyst("schema")
    assert result.stderr == ""
    schema = json.loads(result.stdout)
    jsonschema.Draft202012Validator.check_schema(schema)
    validator = jsonschema.Draft202012Validator(schema)
    yaml = YAML(typ="safe", pure=True)
    examples = Path(__file__).parent.parent / "examples"
    texts = [*FILES.values(), STAGE, *(path.read_text() for path in examples.glob("*.yaml"))]
    for text in texts:
        assert not list(validator.iter_errors(yaml.load(text))), text
    assert schema["examples"]
    for example in schema["examples"]:
        assert not list(validator.iter_errors(example))

    data = yaml.load(FILES["curved"] + "emit: {engine: loop}\n")
    places = [data, data["units"], data["model"], data["model"]["pi"], data["model"]["memoryless"],
              data["model"]["memoryless"]["ascending"], data["emit"]]  # fmt: skip
    for place in places:
        place["colour"] = "red"
        assert not validator.is_valid(data), place
        del place["colour"]
    assert validator.is_valid(data)
    for key in ("hystgen", "name", "input_range", "model"):
        assert not validator.is_valid({k: value for k, value in data.items() if k != key}), key
    for broken in ({"name": "no good"}, {"input_range": [1]}, {"hystgen": 2}, {"model": {}}, {"sample_time": -1}):
        assert not validator.is_valid({**data, **broken}), broken
    bad = yaml.load(head("bad") + "\n  pi: {thresholds: [0, 1], weights: [1, -1]}\n")
    assert not validator.is_valid(bad)


@pytest.mark.parametrize("name", cli.COMMANDS)
def test_help_has_an_example(name: str) -> None:
    text = hyst(name, "--help").stdout
    assert re.search(rf"Example: hystgen {name}\b", " ".join(text.split()))
    assert hyst(name, "-h").stdout == text


def test_help_lists_the_commands() -> None:
    text = hyst("--help").stdout
    for name in ("emit", "verify", "simulate", "identify", "show", "schema"):
        assert re.search(rf"^\s+{name}\s+\S", text, re.MULTILINE), name
