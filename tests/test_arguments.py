"""Wrong arguments of the Python calls: one ValueError or TypeError that names the argument and says what to give."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow
import pytest
from modelfiles import FILES

import hystgen
from hystgen.basics import arguments
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters
from hystgen.records import Record, read_record, read_records

T = np.arange(60.0)
V = np.sin(T / 5.0)
REC = Path(__file__).resolve().parents[1] / "examples" / "stage_recording.csv"
MODEL = Model(parse_parameters(FILES["plain"], "plain.yaml"))
INVERSE = MODEL.inverse()
NO_RECORD = r"a data frame, a dict of arrays .*, a tuple of arrays \(t, v, y\), or a list of these, not "
OF_FILES = "consists of files, not of records in memory"


class Frame:
    """The part of pandas' DataFrame that calls use; iterating over it gives the column names."""

    shape = (60, 3)
    columns = ("t", "v", "y")

    def keys(self) -> list[str]:
        return ["t", "v", "y"]

    def __iter__(self) -> Iterator[str]:
        return iter(self.keys())

    def __getitem__(self, name: str) -> Any:
        return {"t": T, "v": V, "y": V}[name]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Any:
        return np.column_stack([T, V, V])


# A call, the type of its error, and a pattern of the message
SIGNALS: dict[str, tuple[Callable[[], Any], type[Exception], str]] = {
    "two dimensions": (lambda: MODEL.simulate(np.zeros((5, 2))), ValueError, r"v must .*\(N,\), not shape \(5, 2\)"),
    "a column": (lambda: MODEL.simulate(np.zeros((5, 1))), ValueError, r"pass its .ravel\(\)"),
    "two, float32": (lambda: MODEL.simulate(np.zeros((5, 2)), "float32"), ValueError, r"v must .* not shape \(5, 2\)"),
    "two, inverse": (lambda: INVERSE.simulate(np.zeros((5, 2))), ValueError, r"u must .* not shape \(5, 2\)"),
    "two, session": (lambda: MODEL.session().run([[1.0]]), ValueError, r"not shape \(1, 1\)"),
    "ragged": (lambda: MODEL.simulate([[1, 2], [3]]), ValueError, "rows of different lengths"),
    "a file": (lambda: MODEL.simulate("fit.csv"), TypeError, "real numbers .* not 'fit.csv'"),
    "texts": (lambda: MODEL.simulate(["a", "b"]), TypeError, "v must be an array of real numbers"),
    "complex": (lambda: MODEL.simulate(np.zeros(4) * 1j), TypeError, "complex128"),
    "nothing": (lambda: MODEL.simulate(None), TypeError, "not None"),
    "a record": (lambda: MODEL.simulate(Record("a", T, V)), TypeError, "not a Record"),
    "a hole": (lambda: MODEL.simulate([1.0, None]), TypeError, "real numbers"),
    "code that is none": (lambda: MODEL.simulate([0.5], "q15"), ValueError, "integers from -32768 to 32767"),
    "code that is nan": (lambda: MODEL.simulate([np.nan], "q15"), ValueError, "integers from -32768"),
    "arithmetic": (lambda: MODEL.simulate(V, "float16"), ValueError, "'float16' is not one of float32"),
    "engine": (lambda: MODEL.simulate(V, "float32", engine="steam"), ValueError, "'steam' is not one of auto, corners"),
    "operator": (lambda: MODEL.session("sideways"), ValueError, "'sideways' is not one of forward, inverse"),
    "time": (lambda: MODEL.run(V, t=np.zeros((60, 2))), ValueError, r"t must .* not shape \(60, 2\)"),
    "extra": (lambda: MODEL.run(V, extra=[V]), TypeError, "extra must be a mapping of names to arrays"),
}
FILES_AND_MODELS: dict[str, tuple[Callable[[], Any], type[Exception], str]] = {
    "load a number": (lambda: hystgen.load(3), TypeError, "parameter file has to be a path, .* not 3"),
    "load a model": (lambda: hystgen.load(MODEL), TypeError, "has to be a path, .* not a Model"),
    "load a mapping": (lambda: hystgen.load({"hystgen": 1}), TypeError, "not a dict"),
    "effects": (lambda: hystgen.load("a.yaml", "my.py"), TypeError, "list of files or classes, not 'my.py'"),
    "emit option": (lambda: hystgen.emit(MODEL, "o", arithmetics="q15"), TypeError,
                    r"emit\(\) has no option arithmetics; did you mean arithmetic\?"),
    "emit unlike any": (lambda: hystgen.emit(MODEL, "o", colour="red"), TypeError, "its options are operator"),
    "emit value": (lambda: hystgen.emit(MODEL, "o", operator=3), ValueError, "operator 3 is not one of inverse"),
    "emit list": (lambda: hystgen.emit(MODEL, "o", layout=["a"]), ValueError, "is not one of self-contained"),
    "emit a number": (lambda: hystgen.emit(3, "o"), TypeError, "returned by hystgen.load, .* not 3"),
    "emit parameters": (lambda: hystgen.emit(MODEL.parameters, "o"), TypeError, "not a Parameters"),
    "emit nowhere": (lambda: hystgen.emit(MODEL, None), TypeError, "output has to be a path, .* not None"),
    "emit several": (lambda: hystgen.emit([MODEL, 3], "o"), TypeError, "not 3"),
    "differences": (lambda: hystgen.differences(MODEL, "o", arithmetics="q15"), TypeError, "did you mean arithmetic"),
    "verify option": (lambda: hystgen.verify(MODEL, target=["host"]), TypeError, "did you mean targets"),
    "verify targets": (lambda: hystgen.verify(MODEL, targets="host"), TypeError, r"not 'host'; give \['host'\]"),
    "verify compiler": (lambda: hystgen.verify(MODEL, compiler="gcc"), TypeError, r"not 'gcc'; give \['gcc'\]"),
    "verify length": (lambda: hystgen.verify(MODEL, length="5"), TypeError, "length must be a whole number of calls"),
    "verify nothing": (lambda: hystgen.verify(MODEL, length=0), ValueError, "at least 1, not 0"),
    "plan option": (lambda: hystgen.plan(MODEL, maxrate=3), TypeError, "did you mean max_rate"),
    "plan DAC": (lambda: hystgen.plan(MODEL, rate=50, dac_bits=16, dac_range="0,10"), TypeError, "numbers such as"),
    "plan bits": (lambda: hystgen.plan(MODEL, rate=50, dac_bits=12.5, dac_range=(0, 9)), TypeError, "whole number of"),
    "plan coding": (lambda: hystgen.plan(MODEL, rate=50, dac_coding="gray"), ValueError, "is not one of straight"),
    "plan rate": (lambda: hystgen.plan(MODEL, max_rate="3"), TypeError, "max_rate must be a number"),
    "plan a number": (lambda: hystgen.plan(3), TypeError, "or a parameter file, not 3"),
}
RECORDS: dict[str, tuple[Callable[[], Any], type[Exception], str]] = {
    "identify tuples of numbers": (lambda: hystgen.identify([(1, 2, 3)]), TypeError, NO_RECORD),
    "identify a number": (lambda: hystgen.identify(5), TypeError, NO_RECORD),
    "identify nothing": (lambda: hystgen.identify(None), TypeError, NO_RECORD),
    "identify a stream": (lambda: hystgen.identify(REC.open()), TypeError, NO_RECORD),
    "hold out a number": (lambda: hystgen.identify(REC, holdout=3), TypeError, NO_RECORD),
    "diagnose a number": (lambda: hystgen.diagnose(MODEL, 3), TypeError, NO_RECORD),
    "batch of a table": (lambda: hystgen.identify_batch(Frame(), "o"), TypeError, OF_FILES),
    "batch of Arrow": (lambda: hystgen.identify_batch(pyarrow.table({"t": T, "v": V}), "o"), TypeError, OF_FILES),
    "batch of records": (lambda: hystgen.identify_batch(Record("a", T, V, V), "o"), TypeError, OF_FILES),
    "read a number": (lambda: read_record(3), TypeError, NO_RECORD),
    "lengths": (lambda: hystgen.identify(Record("a", T, V[:50], V)), ValueError, "60 samples of t and 50"),
    "length of a column": (lambda: hystgen.identify(Record("a", T, V, V, {"c": V[1:]})), ValueError, "and 59 of c"),
    "a column of v": (lambda: hystgen.identify(Record("a", T, V.reshape(-1, 1), V)), ValueError, "v of a must have"),
    "texts in v": (lambda: hystgen.identify(Record("a", T, ["x"] * 60, V)), TypeError, "v of a must be an array"),
    "no name": (lambda: hystgen.identify(Record(T, V, V)), TypeError, "name must be text"),
}
OPTIONS: dict[str, tuple[dict[str, Any], type[Exception], str]] = {
    "units as a pair": ({"units": ("V", "nm")}, TypeError, r"units must be .* not a tuple; give {'input': 'V'"),
    "units as text": ({"units": "V,nm"}, TypeError, "not 'V,nm'; give {'input'"),
    "units of the drive": ({"units": {"drive": "V"}}, ValueError, "units has no drive; its keys are input, output"),
    "units of a number": ({"units": {"input": 3}}, TypeError, "it contains 3"),
    "name of an option": ({"threshold": 3}, TypeError, r"\(\) has no option threshold; did you mean thresholds\?"),
    "history of one": ({"history": 5}, TypeError, r"history must be a list .* not 5; give a list .* \[100, -100\]"),
    "history as text": ({"history": "100,-100"}, TypeError, "not '100,-100'; give a list"),
    "history of texts": ({"history": ["a"]}, TypeError, "history .* an entry is not a number"),
    "rest": ({"rest": "1"}, TypeError, r"rest must be a number \(seconds\), not '1'"),
    "skip": ({"skip": -2.5}, ValueError, "skip must be a finite nonnegative number .* -2.5"),
    "columns as text": ({"columns": "t=Time"}, TypeError, "columns must be .* not 't=Time'; give {'t': 'Time'"),
    "columns as a list": ({"columns": ["t", "v"]}, TypeError, "columns must be a mapping .* not a list"),
    "sample time": ({"sample_time": "1"}, TypeError, r"sample_time must be a number \(s.*, not '1'"),
    "delimiter": ({"delimiter": 3}, TypeError, "delimiter has to be a character"),
    "model": ({"model": ["pi"]}, ValueError, "model .* is not one of pi, gpi-deadzone"),
    "floor": ({"p0_floor": "0.1"}, TypeError, "p0_floor must be a number"),
    "thresholds": ({"thresholds": np.zeros((2, 2))}, TypeError, "thresholds must be a list of finite numbers"),
    "thresholds by name": ({"thresholds": {1: 2}}, TypeError, "thresholds must be a list .* not a dict"),
}


def refused(call: Callable[[], Any], error: type[Exception], words: str) -> None:
    """Expect a one-line error of this type, raised by the package itself and not by a library below it."""
    with pytest.raises(error, match=words) as caught:
        call()
    assert "\n" not in str(caught.value)
    last = traceback.extract_tb(caught.value.__traceback__)[-1].filename
    assert Path(last).is_relative_to(Path(hystgen.__file__).parent), last


@pytest.mark.parametrize("case", [SIGNALS, FILES_AND_MODELS, RECORDS], ids=["signals", "files", "records"])
def test_wrong_arguments(case: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for call, error, words in case.values():
        refused(call, error, words)
    assert not list(tmp_path.iterdir()), "nothing half-written"


@pytest.mark.parametrize("name", OPTIONS)
def test_wrong_options_of_a_fit(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`identify` and `identify_batch` refuse them before anything is fitted."""
    monkeypatch.chdir(tmp_path)
    options, error, words = OPTIONS[name]
    refused(lambda: hystgen.identify(REC, **options), error, words)
    if not {"columns", "sample_time", "delimiter"} & options.keys():  # in a batch these fail one unit only
        refused(lambda: hystgen.identify_batch(REC, "o", **options), error, words)
    assert not list(tmp_path.iterdir())


def test_wrong_options_of_a_diagnosis_and_a_batch(tmp_path: Path) -> None:
    for options, error, words in (
        ({"hold": REC}, TypeError, "did you mean holdout"), ({"history": 3}, TypeError, "history must be a list"),
        ({"rest": "a"}, TypeError, "rest must be a number"), ({"effects": ["my.py"]}, TypeError, "be classes"),
    ):  # fmt: skip
        refused(lambda options=options: hystgen.diagnose(MODEL, REC, **options), error, words)
    for options, error, words in (
        ({"jobs": "2"}, TypeError, "jobs must be a whole number"), ({"jobs": 0}, ValueError, "at least 1"),
        ({"emission": {"arithmetics": "q15"}}, TypeError, "did you mean arithmetic"),
    ):  # fmt: skip
        refused(lambda options=options: hystgen.identify_batch(REC, tmp_path / "o", **options), error, words)
    refused(lambda: hystgen.report_fit(3, REC, tmp_path / "r"), TypeError, "a result of hystgen.identify")
    assert not list(tmp_path.iterdir())


@pytest.mark.thorough
def test_what_was_right_stays_so() -> None:
    """Lists, integers, single numbers, generators of paths and NumPy scalars are accepted."""
    exact = MODEL.simulate(V)
    for given in (list(V), tuple(V), V.astype(object), V[::-1][::-1]):
        assert np.array_equal(MODEL.simulate(given), exact)
    assert MODEL.simulate(1).shape == (1,)
    assert np.array_equal(MODEL.simulate(np.arange(3)), MODEL.simulate([0.0, 1.0, 2.0]))
    assert np.array_equal(MODEL.simulate([True, False]), MODEL.simulate([1.0, 0.0]))
    assert np.array_equal(MODEL.simulate([1, 2], "q15"), MODEL.simulate([1.0, 2.0], "q15"))
    assert read_records(path for path in [REC])[0].name == REC.name
    fit = hystgen.identify([str(REC)], thresholds=np.int64(3), skip=np.int32(0), rest=0, history=None)
    assert len(fit.parameters.model.pi.weights) == 4


def test_kinds() -> None:
    assert arguments.kind(np.zeros((2, 3))) == "an array of shape (2, 3)"
    assert arguments.kind({}) == "a dict"
    assert len(arguments.kind("x" * 1000)) < 70
