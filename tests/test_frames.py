"""`simulate` with series and frames of pandas, polars and xarray, and results as tables in notebooks."""

from __future__ import annotations

import subprocess
import sys
import warnings
from collections.abc import Callable
from html.parser import HTMLParser
from typing import Any

import numpy as np
import pandas as pd
import polars as pl
import pytest
import xarray as xr
from plain_stage import MODEL, NOISE, drive, stage

import hystgen
from hystgen import tracking
from hystgen.basics import display
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters
from hystgen.records import Record

T = 0.01
PLAIN = Model(parse_parameters(MODEL))
CREEP = Model(parse_parameters(MODEL.replace(
    "0.01]}}", "0.01]}, effects: [{name: creep, time_constants: [0.4, 1.2, 3.6, 10.8], weights: [0.02, 0.02, 0.02, "
    "0.02]}]}",
)))
V = np.array(drive(3, 400))
Y = np.array(stage(V.tolist(), 0.0, 0.0, 3))
TIME = np.arange(len(V), dtype=np.float64) * T
STAMPS = pd.date_range("2026-03-29", periods=len(V), freq="10ms", tz="Europe/Berlin")


def close(found: Any, noise: float = 6.0 * NOISE) -> None:
    assert np.max(np.abs(np.asarray(found) - Y)) < noise


def test_pandas() -> None:
    for given in (pd.Series(V, index=STAMPS, name="drive"), pd.DataFrame({"v": V, "y": Y}, index=STAMPS)):
        found = PLAIN.simulate(given)
        assert isinstance(found, pd.Series)
        assert found.name == "y"
        assert found.index is STAMPS or found.index.equals(STAMPS)
        close(found)
    rows = pd.MultiIndex.from_arrays([["a"] * 200 + ["b"] * 200, list(range(200)) * 2])
    assert PLAIN.simulate(pd.DataFrame({"v": V}, index=rows)).index.equals(rows)  # type: ignore[attr-defined]


def test_polars_and_xarray_and_mappings() -> None:
    for given in (pl.Series("drive", V), pl.DataFrame({"t": TIME, "v": V})):
        found = PLAIN.simulate(given)
        assert isinstance(found, pl.Series)
        assert found.name == "y"
        close(found)
    array = PLAIN.simulate(xr.DataArray(V, dims="time", coords={"time": TIME}, attrs={"units": "V"}))
    assert isinstance(array, xr.DataArray)
    assert (array.name, array.dims, array.attrs) == ("y", ("time",), {})
    assert np.array_equal(array.coords["time"], TIME)
    close(array)
    plain = PLAIN.simulate({"v": V})
    assert type(plain) is np.ndarray
    close(plain)


def test_time_comes_with_a_frame_or_an_index() -> None:
    """Every other sample, from arrays with their times and from objects that bring the times along."""
    v, t = V[::2], TIME[::2]
    expected = CREEP.simulate(v, t=t)
    assert np.max(np.abs(expected - CREEP.simulate(v))) > 1e-3, "sample_time alone would be wrong"
    given: list[Any] = [
        pd.DataFrame({"t": t, "v": v}), pd.DataFrame({"Time [ms]": 1e3 * t, "Drive [V]": v}),
        pl.DataFrame({"t": t, "v": v}), pl.DataFrame({"t": STAMPS[::2].tz_localize(None).to_numpy(), "v": v}),
        pd.DataFrame({"v": v}, index=STAMPS[::2]), pd.Series(v, index=STAMPS[::2]),
        pd.Series(v, index=pd.to_timedelta(t, unit="s")),
        xr.DataArray(v, dims="time", coords={"time": STAMPS[::2].tz_localize(None)}),
    ]
    for each in given:
        assert np.max(np.abs(np.asarray(CREEP.simulate(each)) - expected)) < 1e-9
    assert np.array_equal(CREEP.simulate(given[0], t=TIME[: len(v)]), CREEP.simulate(v, t=TIME[: len(v)]))
    drives = CREEP.inverse().simulate(pd.DataFrame({"t": t, "u": expected}))
    assert isinstance(drives, pd.Series)
    assert drives.name == "v"
    assert np.max(np.abs(drives.to_numpy() - v)) < 1e-6


def told(call: Callable[[], Any]) -> tuple[Any, list[str]]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = call()
    assert {each.filename for each in caught} <= {__file__}, "they name the user's line"
    return found, [str(each.message) for each in caught]


def test_missing_values_and_units_and_limits_are_told() -> None:
    held = V[:50].copy()
    held[20:22] = held[19]
    for missing in (
        pd.Series(np.where(np.isin(np.arange(50), (20, 21)), np.nan, V[:50])),
        pd.Series(V[:50]).astype("Float64").where(~np.isin(np.arange(50), (20, 21))),
        pl.Series("v", [None if k in (20, 21) else x for k, x in enumerate(V[:50].tolist())]),
    ):
        found, said = told(lambda given=missing: PLAIN.simulate(given))  # type: ignore[misc]
        assert said == ["2 of 50 samples are not finite; the answer before them was held"]
        assert np.array_equal(np.asarray(found), PLAIN.simulate(held))
    found, said = told(lambda: PLAIN.simulate(pd.DataFrame({"Drive [kV]": V / 1e3})))
    assert said == ["column v [kV] was converted to V: 1 kV is 1000 V"]
    close(found)
    found, said = told(lambda: PLAIN.inverse().simulate(pd.Series([1.0, 1e3, np.nan, 2.0])))
    assert said == [
        "1 of 4 references lies outside the output range and was limited",
        "1 of 4 samples is not finite; the answer before it was held",
    ]
    assert found.max() == 100.0
    codes = PLAIN.simulate(pd.DataFrame({"v": [0, 1000, 2000]}), arithmetic="q15")
    assert np.array_equal(codes, PLAIN.simulate([0, 1000, 2000], arithmetic="q15"))


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (pl.LazyFrame({"v": V}), r"v is a LazyFrame, which has no values yet; pass its \.collect\(\)$"),
        (pd.DataFrame({("run1", "v"): V}), r"several levels \(MultiIndex\); pass one group .*, as in frame\['run1'\]$"),
        (xr.Dataset({"v": ("t", V)}), r"v is a Dataset of xarray; pass its \.to_dataframe\(\)"),
        (xr.DataArray(np.zeros((2, 3)), dims=("x", "t")), r"v is a DataArray over \(x, t\); select along all of them"),
        (pd.Series(["a", "b"]), "v must be an array of real numbers"),
        (pd.DataFrame({"a": V, "b": V}), 'there is no column "v" among a, b; rename the columns to v and t, or pass'),
        (pl.DataFrame({"Voltage (V)": V, "Drive (V)": V}), '2 columns may be meant by "v": Voltage'),
    ],
)
def test_what_is_no_signal(given: Any, said: str) -> None:
    with pytest.raises((TypeError, ValueError), match=said) as caught:
        PLAIN.simulate(given)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("given", [pl.LazyFrame({"v": V}), pd.DataFrame({("a", "v"): V}), xr.Dataset({"v": ("t", V)})])
def test_what_is_no_record(given: Any) -> None:
    with pytest.raises(TypeError, match=r"^a record (is|has) .*; pass "):
        hystgen.identify(given)


def test_what_the_advice_says_works() -> None:
    close(PLAIN.simulate(pl.LazyFrame({"v": V}).collect()))
    close(PLAIN.simulate(pd.DataFrame({("run1", "v"): V})["run1"]))
    dataset = xr.Dataset({"v": ("t", V)}, coords={"t": TIME})
    close(PLAIN.simulate(dataset.to_dataframe().reset_index()))
    close(PLAIN.simulate(dataset["v"]))
    frame = pd.DataFrame({"a": V, "b": TIME})
    close(PLAIN.simulate(frame.rename(columns={"a": "v", "b": "t"})))
    close(PLAIN.simulate(frame["a"], t=frame["b"]))


def test_none_of_these_packages_is_imported() -> None:
    code = (
        "import sys, hystgen; m = hystgen.load(sys.argv[1]); m.simulate([1.0, 2.0]); m.simulate({'v': [1.0, 2.0]}); "
        "print(*({'pandas', 'polars', 'xarray'} & set(sys.modules)))"
    )
    run = subprocess.run(
        [sys.executable, "-c", code, "examples/note/example_1.yaml"], capture_output=True, text=True, check=True
    )
    assert run.stdout.strip() == ""


class Cells(HTMLParser):
    """The cells of the tables of a page, row by row."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.rows: list[list[str]] = []
        self._inside = False
        self.feed(page)

    def handle_starttag(self, tag: str, _attrs: object) -> None:
        if tag == "tr":
            self.rows.append([])
        self._inside = tag in ("td", "th")

    def handle_data(self, data: str) -> None:
        if self._inside:
            self.rows[-1].append(data)

    def handle_endtag(self, _tag: str) -> None:
        self._inside = False


def test_a_table() -> None:
    rows = [("name", "rms", "share"), ("a<b", "0.1", "3 %"), ("c", "-", "")]
    page = display.block("<One result>", "below", rows=rows)
    assert [*map(tuple, Cells(page).rows)] == [rows[0], rows[1], ("c", "-")]
    assert page.startswith("<p>One result</p><table>")
    assert page.count("text-align: right") == 6
    assert "below" in page.partition("</table>")[2]


def test_results_are_tables() -> None:
    t = TIME
    found = tracking.track(CREEP, [Record("one.csv", t, V.astype(np.float64), Y)])
    rows = Cells(found._repr_html_()).rows
    assert rows[0] == ["record", "compensator", "rms %", "max %"]
    assert [row[1] for row in rows[1:]] == ["straight line", "plays alone", "whole model"]
    assert rows[3][2] == f"{found.records[0].rms('whole model'):.3f}"
    fit = hystgen.identify({"t": t, "v": V, "y": Y}, thresholds=[0.0, 5.0, 12.0, 25.0], history=[0.0])
    rows = Cells(fit._repr_html_()).rows
    assert rows[0][:2] == ["part", "model"]
    assert [row[4] for row in rows[1:]] == [f"{row.rms:.4g}" for row in fit.rows]
