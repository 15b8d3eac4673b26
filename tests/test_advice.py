"""Every option that a message about a file names is run on the file that provoked it, and then the file is read.

The last test finds the messages in the source, so that none is left out.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import instrument_files as made
import numpy as np
import pytest
import scipy.io
from instrument_files import STEP, N, T, V, Y

from hystgen import records
from hystgen.records import Record, RecordError, parse_columns, read_records
from hystgen.records.told import time_without_unit


class Case(NamedTuple):
    """A file, the options that provoke a message, and what a user puts in place of the words in its advice."""

    write: Callable[[Path], object]
    file: str = "a.csv"
    options: dict[str, Any] = {}  # noqa: RUF012
    answers: dict[str, str] = {}  # noqa: RUF012
    which: int = 0
    time: bool = True
    columns: bool = True


def text(names: tuple[str, ...] = ("t", "v", "y"), *columns: Any, above: str = "") -> Callable[[Path], object]:
    return lambda path: path.write_text(above + made.csv_text(names, columns or (T, V, Y)))


def bare(*columns: Any, above: str = "") -> Callable[[Path], object]:
    return lambda path: path.write_text(above + made.csv_text((), columns or (T, V, Y)).split("\n", 1)[1])


def npz(**arrays: Any) -> Callable[[Path], object]:
    return lambda path: np.savez(path, **arrays)


def linked(path: Path) -> None:
    with h5py.File(path.with_name("other.h5"), "w") as other:
        other["v"] = V
    with h5py.File(path, "w") as file:
        file["t"], file["y"], file["read_back"] = T, Y, V
        file["v"] = h5py.ExternalLink("other.h5", "v")


def two_groups(path: Path) -> None:
    with h5py.File(path, "w") as file:
        for name, x in (("run1/t", T), ("run1/v", V), ("run1/y", Y), ("run2/v", V + 1)):
            file[name] = x


def two_rates(path: Path) -> None:
    scipy.io.savemat(path, {"v": V, "y": Y, "fs": 1 / STEP, "dt": 2 * STEP})


def one_channel(path: Path) -> None:
    path.write_text(made.channel(V))
    path.with_name("MEASURED").write_text(made.channel(Y))


def bare_channels(path: Path) -> None:
    path.write_text("".join(f"{t:.6f},{x:.6f}\n" for t, x in zip(T, V, strict=True)))
    path.with_name("b.csv").write_text("".join(f"{t:.6f},{x:.6f}\n" for t, x in zip(T, Y, strict=True)))


HIDDEN = ("t\x1b", "a\x07", "b\x08")
SECONDS = {"SECONDS": str(STEP)}

CASES: dict[str, Case] = {
    "two names": Case(text(), options={"columns": {"v": "t"}}, answers={"COLUMN": "v"}),
    "one channel": Case(one_channel, "C1.csv"),
    "no names": Case(text(("t", "a", "b")), answers={"v=COLUMN": "v=a", "y=COLUMN": "y=b"}),
    "no names, example": Case(text(("t", "a", "b")), which=1),
    "one name": Case(text(("t", "v", "b", "c"), T, V, Y, Y), answers={"COLUMN": "b"}),
    "names that cannot be typed": Case(made.control_names, which=1),
    "names with marks": Case(text(("t", '"a,1"', '"b=2"')), which=1),
    "several": Case(two_groups, "a.h5"),
    "no numbers": Case(npz(t=T, v=np.array(["x"] * N), y=Y, w=V), "a.npz", answers={"COLUMN": "w"}),
    "outside": Case(linked, "a.h5", answers={"COLUMN": "read_back"}),
    "no time": Case(text(("v", "y", "load"), V, Y, V), answers=SECONDS),
    "no time, but a name": Case(text(("Time state", "v", "y"), T, V, Y), time=False),
    "a name by mistake": Case(text(("t", "Drive", "y")), options={"columns": {"v": "Drve"}}),
    "a name by mistake, another word": Case(text(("t", "Current", "Pos")), options={"columns": {"v": "Curent"}}),
    "no such name": Case(text(("t", "a", "b")), options={"columns": {"v": "zz", "y": "b"}}, answers={"COLUMN": "a"}),
    "delimiter": Case(text(), options={"delimiter": ";"}),
    "cells above": Case(bare(above="Time,Drive\n")),
    "no header": Case(bare()),
    "no header, two columns": Case(bare(V, Y), answers=SECONDS),
    "no header, one channel": Case(bare_channels, "a.csv+b.csv"),
    "two rates": Case(two_rates, "a.mat", answers=SECONDS),
    "matrix": Case(made.npy, "a.npy"),
    "matrix of two": Case(npz(data=np.column_stack([V, Y])), "a.npz", answers=SECONDS),
    "matrix with a rate": Case(made.matrix_with_rate("fs"), "a.h5"),
    "milliseconds": Case(text(("Time", "v", "y"), np.round(1.7e12 + 1e3 * T).astype(int), V, Y)),
    "milliseconds that may be seconds": Case(text(("Zeit", "v", "y"), 1e3 * T, V, Y), time=False),
    "samples counted": Case(text(("t", "v", "y"), np.arange(N), V, Y), answers=SECONDS, columns=False),
    "days": Case(made.days(45678.5, 2.0)),
    "days or seconds": Case(made.days(45678.5, 2.0), which=1),
    "points": Case(text(("v", "y"), V, Y), answers=SECONDS),
    "few digits": Case(text(("t", "v", "y"), np.floor(T * 100) / 100, V, Y)),
}

OPTIONS = re.compile(
    r'--columns "(?P<quoted>[^"]+)"|--columns (?P<bare>[^\s,;]+(?:,[^\s,;]+)*)|(?P<delimiter>leave out --delimiter)'
    r"|--join (?P<join>\S+ \S+)"
)
STEPS = re.compile(r"--sample-time(?: \(here about (?P<about>[\d.e-]+)\)| (?P<word>SECONDS))?")


def provoked(case: Case, folder: Path) -> tuple[str, str]:
    """The path of a case's file, and the message about it: a problem, or a note where the file is read."""
    path = folder / case.file.split("+")[0]
    case.write(path)
    source = "+".join(str(folder / each) for each in case.file.split("+"))
    try:
        (record,) = read_records([source], points=True, **case.options)
    except RecordError as error:
        (problem, *_) = error.problems
        assert not _ or "first line has numbers" in problem  # one for each file of two
        return source, problem
    return source, "; ".join([*record.notes, time_without_unit([record], None)])


def advised(case: Case, source: str, said: str) -> list[Record]:
    """The record, read with the options that the message names."""
    found = list(OPTIONS.finditer(said))
    options: dict[str, Any] = dict(case.options)
    if found and case.columns:
        match = found[min(case.which, len(found) - 1)]
        columns = match["quoted"] or match["bare"]
        if match["join"]:
            folder = Path(source).parent
            source = f"{source}+{folder / match['join'].split()[1]}"
        elif match["delimiter"]:
            del options["delimiter"]
        else:
            for word, answer in case.answers.items():
                columns = columns.replace(word, answer)
            options["columns"] = {**options.get("columns", {}), **parse_columns(columns)}
    if (step := STEPS.search(said)) and case.time:
        options["sample_time"] = float(step["about"] or case.answers["SECONDS"])
    return read_records([source], points=True, **options)


@pytest.mark.parametrize("name", CASES)
def test_the_advice_works(tmp_path: Path, name: str) -> None:
    case = CASES[name]
    source, said = provoked(case, tmp_path)
    assert re.search("--(columns|sample-time|delimiter|join)", said), said
    (record,) = advised(case, source, said)
    assert len(record) == N
    np.testing.assert_allclose(record.v, V, rtol=0, atol=1e-6)
    assert record.y is not None
    np.testing.assert_allclose(record.y, Y, rtol=0, atol=1e-6)
    assert record.timed
    step = {"days": 2.0, "days or seconds": 2.0 / 86400.0}.get(name, STEP)
    assert record.sample_time == pytest.approx(step, rel=1e-3)


def test_names_are_shown_with_the_numbers_that_select_them(tmp_path: Path) -> None:
    _, said = provoked(CASES["names that cannot be typed"], tmp_path)
    assert r"among t\x1b (#1), a\x07 (#2), b\x08 (#3); " in said
    assert said.endswith('for example --columns "v=#2,y=#3"')


def test_every_advice_is_tried(tmp_path: Path) -> None:
    """Each piece of text in the source of the readers that names an option is in a message of a case above."""
    said = []
    for name, case in CASES.items():
        (tmp_path / name).mkdir()
        said.append(provoked(case, tmp_path / name)[1])
    pieces = set()
    for path in Path(records.__file__).parent.glob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        docs = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
        patterns = {id(arg) for node in ast.walk(tree) if isinstance(node, ast.Call) for arg in node.args
                    if isinstance(node.func, ast.Attribute) and node.func.attr in ("compile", "sub")}  # fmt: skip
        for node in ast.walk(tree):
            text_ = getattr(node, "value", None) if isinstance(node, ast.Constant) else None
            if isinstance(text_, str) and id(node) not in docs | patterns and re.search(r"--[a-z]", text_):
                pieces.add(text_)
    assert len(pieces) > 15
    assert [piece for piece in sorted(pieces) if not any(piece in each for each in said)] == []
