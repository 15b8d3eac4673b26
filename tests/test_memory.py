"""Records from arrays and tables in memory give the same model as a file of the same samples, or one clear message."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas
import polars
import pyarrow
import pytest

import hystgen
from hystgen.records import Record, read_record, read_records

FILE = Path(__file__).resolve().parents[1] / "examples" / "stage_recording.csv"
PLAYS = {"thresholds": 4}


@cache
def record() -> Record:
    return read_record(FILE)


def columns(step: int = 1) -> dict[str, Any]:
    """Columns of the record: every sample, or one in `step`, which shortens a search."""
    return {"t": record().t[::step], "v": record().v[::step], "y": record().y[::step]}  # type: ignore[index]


WAYS: dict[str, Callable[[], Any]] = {
    "dict": columns,
    "dict of lists": lambda: {name: x.tolist() for name, x in columns().items()},
    "columns of shape (N, 1)": lambda: {name: x.reshape(-1, 1) for name, x in columns().items()},
    "pandas": lambda: pandas.DataFrame(columns()),
    "pandas, nullable": lambda: pandas.DataFrame(columns()).convert_dtypes(),
    "pandas, time as index": lambda: pandas.DataFrame(columns()).set_index("t"),
    "pandas, durations": lambda: pandas.DataFrame(columns()).assign(
        t=pandas.to_timedelta(np.round(1e9 * record().t).astype(int), unit="ns")
    ),
    "polars": lambda: polars.DataFrame(columns()),
    "Arrow": lambda: pyarrow.table(columns()),
    "tuple": lambda: tuple(columns().values()),
    "array": lambda: np.column_stack(list(columns().values())),
    "list of one": lambda: [columns()],
    "names and units": lambda: polars.DataFrame(dict(zip(("t [ms]", "Drive (V)", "Weg [um]"),
                                                         (1e3 * record().t, record().v, record().y), strict=True))),
}  # fmt: skip


@pytest.mark.parametrize("way", WAYS)
def test_the_same_record_as_from_a_file(way: str) -> None:
    (read,) = read_records(WAYS[way]())
    assert read.name == "record"
    np.testing.assert_allclose(read.t, record().t, rtol=0.0, atol=1e-9)  # s
    assert np.array_equal(read.v, record().v)
    assert read.y is not None
    assert np.array_equal(read.y, record().y)
    assert read.v.flags.writeable
    assert not np.shares_memory(read.v, record().v)


def test_all_of_the_calls_take_them() -> None:
    fit = hystgen.identify(record(), **PLAYS)
    table = hystgen.identify(pandas.DataFrame(columns()), holdout=[columns(), columns()], **PLAYS)
    assert table.parameters.model == fit.parameters.model
    assert [used.name for used in table.used] == ["record 1", "record 2", "record 3"]
    found = hystgen.diagnose(fit, polars.DataFrame(columns()).head(2000), holdout=columns(6))
    assert found.model.parameters is found.parameters


def test_units_names_missing_values_and_further_columns_are_as_in_a_file() -> None:
    t = np.arange(200.0)
    frame = polars.DataFrame({
        "Zeit": t, "U [V]": np.sin(t), "Weg [nm]": [None, *np.cos(t[1:])], "temperature": t + 20.0,
        "remark": ["a"] * 200,
    })  # fmt: skip
    (read,) = read_records(frame)
    assert read.units == {"v": "V", "y": "nm"}
    assert len(read) == 199
    assert read.extra["temperature"][0] == 21.0
    assert any("1 sample" in note for note in read.notes)
    assert any("remark" in note for note in read.notes)
    named = read_record({"a": t, "b": np.sin(t), "c": np.cos(t)}, columns={"t": "a", "v": "b", "y": "c"})
    assert np.array_equal(named.v, np.sin(t))
    timeless = read_record((np.sin(t), np.cos(t)), sample_time=0.5)
    assert timeless.t[1] == 0.5


T, V = np.arange(60.0), np.sin(np.arange(60.0))
REFUSED: dict[str, tuple[Any, type[Exception], str]] = {
    "other names": ({"a": T, "b": V, "c": V}, ValueError, "columns={'v': 'COLUMN', 'y': 'COLUMN'}"),
    "no time": ({"v": V, "y": V}, ValueError, "record: error: .* give sample_time$"),
    "two arrays": ((V, V), ValueError, r"give sample_time, or \(t, v, y\)"),
    "five columns": (np.zeros((60, 5)), ValueError, r"shape \(60, 5\); give columns t, v and y"),
    "one array": (V, ValueError, r"shape \(60,\); give columns t, v and y"),
    "a list of arrays": ([T, V, V], ValueError, r"record 1 is an array of shape \(60,\)"),
    "lengths": ({"t": T, "v": V[1:], "y": V}, ValueError, "v has 59, y has 60"),
    "texts": ({"t": T, "v": ["x"] * 60, "y": V}, ValueError, '"v" is not a column of numbers'),
    "two dimensions": ({"t": T, "v": np.zeros((60, 2)), "y": V}, ValueError, '"v" is not a column of numbers'),
    "complex": ({"t": T, "v": V * 1j, "y": V}, ValueError, '"v" is not a column of numbers'),
    "nothing": ({}, ValueError, 'no columns? .*"v" and "y" among none'),
    "an empty table": (pandas.DataFrame(), ValueError, "among none"),
    "one name": (pandas.DataFrame(np.zeros((60, 3)), columns=["t", "v", "v"]), ValueError, "different names"),
    "a drive at rest": ({"t": T, "v": 0 * T, "y": V}, ValueError, "a fit needs a drive that moves"),
    "a number in a list": ([columns, 3], TypeError, "with .* in it"),
    "texts alone": (("a", "b", 3), TypeError, "with 3 in it"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_a_record_says_what_to_give(case: str) -> None:
    source, error, words = REFUSED[case]
    with pytest.raises(error, match=words) as caught:
        hystgen.identify(source)
    assert "--" not in str(caught.value), "options of the command line"


def test_pictures_and_short_forms(tmp_path: Path) -> None:
    fit = hystgen.identify(columns(), name="stage_x", units={"input": "V", "output": "um"}, **PLAYS)
    assert re.fullmatch(r"<Fit stage_x: 4 plays, held out rms 0\.\d+ um \(0\.\d+ %\)>", repr(fit))
    assert repr(fit.model) == "<Model stage_x: 4 plays, 0 to 100 V, invertible>"
    assert repr(fit.model.inverse()) == f"<InverseModel of {fit.model!r}>"
    assert repr(record()) == "<Record stage_recording.csv: 5872 samples, 0 to 2.9355 s; t, v, y>"
    report = hystgen.verify(fit, length=100)
    assert re.fullmatch("<Report stage_x: float32, corners, self-contained; bits equal in [0-9]+ builds>", repr(report))
    for result, panels in ((fit, 5), (fit.model, 3)):  # one of the five is the scale of colours
        assert len(result.plot().axes) == panels
        for name in ("a.png", "a.svg"):
            result.plot(tmp_path / name)
            assert (tmp_path / name).stat().st_size > 5000
        page = result._repr_html_()
        assert page.startswith(f"<p>{repr(result).strip('<>')}</p>")
        assert page.count("<svg") == 1
    assert "bits equal" in report._repr_html_()
    with pytest.raises(ValueError, match=r"a plot is a \.png or \.svg file"):
        fit.plot(tmp_path / "a.pdf")
    with pytest.raises(TypeError, match="path has to be a path"):
        fit.model.plot(3)
    found = hystgen.diagnose(fit, columns(6))
    assert repr(found).startswith(f"<Diagnosis stage_x: {found.verdict}")
    assert found.sentence() in found._repr_html_().replace("&#x27;", "'").replace("&gt;", ">").replace("&lt;", "<")
    assert len(found.plot().axes) == 1
    assert len(found.plot("against", tmp_path / "b.svg").axes) > 3
    with pytest.raises(ValueError, match="which 'loop' is not one of gap, overlay"):
        found.plot("loop")


def test_a_notebook_without_matplotlib_shows_the_text(monkeypatch: pytest.MonkeyPatch) -> None:
    from hystgen.basics import drawing

    def missing() -> None:
        raise ImportError

    monkeypatch.setattr(drawing, "_import", missing)
    fit = hystgen.identify(columns(), **PLAYS)
    assert "<svg" not in fit._repr_html_()
    assert "held out" in fit._repr_html_()
    with pytest.raises(ValueError, match="plots need matplotlib; install it with"):
        fit.plot()


def test_the_package_is_typed() -> None:
    assert (Path(hystgen.__file__).parent / "py.typed").is_file()
