"""The report of an identification: the page agrees with the data put in, and a browser shows it correctly."""

from __future__ import annotations

import base64
import html
import json
import platform
import re
import stat
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from recordings import brute_output, brute_plays, noisy, wander, write_csv
from scipy.stats import binned_statistic

import hystgen
from hystgen.basics import drawing, extras
from hystgen.basics.problems import percent
from hystgen.diagnosis.findings.kinds import times_noise
from hystgen.identification import Fit, Used, prepared
from hystgen.records import Record
from hystgen.report import fit_figures
from hystgen.report import identification as pages
from hystgen.report.fit_figures import Shown

Array = NDArray[np.float64]
Run = Callable[..., tuple[int, str, str]]

THRESHOLDS = (0.0, 2.0, 5.0, 10.0, 20.0, 35.0)
WEIGHTS = (0.6, 0.1, 0.1, 0.08, 0.06, 0.05)
NOISE = 0.09
UNITS = {"v": "V", "y": "um"}
FILES = {"report.html"} | {
    f"{name}.{kind}"
    for name in ("loop", "time", "residual", "spectrum", "loading", "weights")
    for kind in ("svg", "png")
}

OUTLIERS, SPIKES = (415, 777, 1013, 2105, 2106), (610, 1910, 1911)
CUT, CONTINUED, SKIP = 1200, 1500, 20
"""Samples from CUT to CONTINUED are missing, which makes a gap."""


def bent(v: Array) -> Array:
    return np.asarray(np.interp(v, [0, 20, 40, 60, 80, 100], [0, 22, 43, 62, 81, 100]))


def made(name: str, seed: int, front: Callable[[Array], Array] = bent, weights: tuple[float, ...] = WEIGHTS) -> Record:
    v = wander(seed)
    y = noisy(brute_output(front(v), THRESHOLDS, weights, 0.0), NOISE, seed + 100)
    return Record(name, np.arange(len(v)) * 0.001, v, y, sample_time=0.001, units=UNITS)


def spoilt() -> Record:
    """A record with outliers, spikes of the drive and a gap, at known places of the whole record."""
    whole = made("spoilt.csv", 4)
    assert whole.y is not None
    v, y = whole.v.copy(), whole.y.copy()
    y[list(OUTLIERS)] += 30.0 * np.array([1.0, -1.0, 1.0, -1.0, -1.0])
    v[list(SPIKES)] = 170.0
    keep = np.r_[0:CUT, CONTINUED : len(v)]
    return Record("spoilt.csv", whole.t[keep], v[keep], y[keep], sample_time=0.001, units=UNITS)


def place(samples: tuple[int, ...]) -> list[int]:
    """Indices of samples of the whole record in the record with a gap."""
    return [k if k < CUT else k - (CONTINUED - CUT) for k in samples]


@dataclass
class Page(HTMLParser):
    """Content of the page: tags with attributes, text by section, rows of the tables."""

    text: str
    tags: list[tuple[str, dict[str, str]]] = field(default_factory=list)
    sections: dict[str, str] = field(default_factory=dict)
    tables: dict[str, list[list[str]]] = field(default_factory=dict)
    declared: str = ""

    def __post_init__(self) -> None:
        super().__init__()
        self._open: list[str] = []
        self._title = "lead"
        self.feed(self.text)
        self.close()
        assert self._open == []

    def handle_decl(self, decl: str) -> None:
        self.declared = decl

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, {key: value or "" for key, value in attrs}))
        if tag not in ("meta", "link", "img", "source", "br"):
            self._open.append(tag)
        if tag == "h2":
            self._title = ""
        if tag == "tr":
            self.tables.setdefault(self._title, []).append([])
        if tag in ("td", "th"):
            self.tables[self._title][-1].append("")

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag, "well nested"

    def handle_data(self, data: str) -> None:
        if "h2" in self._open:
            self._title += data
            self.sections[self._title] = ""
        elif "main" in self._open or "header" in self._open:
            self.sections[self._title] = self.sections.get(self._title, "") + data
        if self._open and self._open[-1] in ("td", "th"):
            self.tables[self._title][-1][-1] += data


def table(page: Page, section: str) -> list[dict[str, str]]:
    head, *rows = page.tables[section]
    return [dict(zip(head, row, strict=True)) for row in rows]


@pytest.fixture(scope="module")
def fitted() -> tuple[Fit, Record, Record]:
    first, other = spoilt(), made("other.csv", 7)
    return hystgen.identify(first, model="gpi-deadzone", holdout=other, skip=1e-3 * SKIP, name="axis"), first, other


@pytest.fixture(scope="module")
def folder(fitted: tuple[Fit, Record, Record], tmp_path_factory: pytest.TempPathFactory) -> Path:
    fit, first, other = fitted
    found = tmp_path_factory.mktemp("report") / "out"
    assert hystgen.report_fit(fit, first, found, other) == found / "report.html"
    return found


@pytest.fixture(scope="module")
def page(folder: Path) -> Page:
    return Page((folder / "report.html").read_text(encoding="utf-8"))


class TestMasks:
    def test_are_what_was_spoilt(self, fitted: tuple[Fit, Record, Record]) -> None:
        first, other = fitted[0].used
        assert (first.name, first.held_out, other.name, other.held_out) == ("spoilt.csv", False, "other.csv", True)
        assert first.bridged.tolist() == place(SPIKES)
        assert first.gaps.tolist() == [CUT]
        assert first.parts == ((0, CUT), (CUT, first.samples))
        known = [k for k in place(OUTLIERS) if k not in first.ignored]
        assert first.outliers.tolist() == known
        assert len(known) >= 3
        assert first.skipped.tolist() == [*range(SKIP)], "at the start of the record, not behind the gap"
        assert [start is None for start in first.starts] == [True, False], "most of the second part needs one"
        assert CUT not in first.ignored
        assert other.skipped.tolist() == [*range(SKIP)]
        for name in ("outliers", "bridged", "gaps", "left_out"):
            assert getattr(other, name).tolist() == []

    def test_give_the_table_of_the_fit(self, fitted: tuple[Fit, Record, Record]) -> None:
        fit, *records = fitted
        for row, record, used in zip(fit.rows, records, fit.used, strict=True):
            error = (record.y - fit.along(record, used))[used.compared]
            assert row.samples == len(error)
            assert row.samples + row.ignored + len(used.skipped) + len(used.outliers) == len(record)
            assert row.rms == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-8)
            assert row.max == pytest.approx(np.max(np.abs(error)), rel=1e-8)

    def test_a_spike_is_no_extreme_of_the_drive(self) -> None:
        clean = made("clean", 4, np.asarray)
        v = clean.v.copy()
        v[list(SPIKES)] = 170.0
        (item,), _ = prepared.courses([replace(clean, v=v)], None, 0)
        assert item.first == max(np.argmax(clean.v), np.argmin(clean.v)) < min(SPIKES)

    def test_of_a_part_that_is_too_short(self) -> None:
        whole = made("cut.csv", 4, np.asarray)
        t = whole.t.copy()
        t[1500:] += 1.0
        t[1510:] += 1.0
        fit = hystgen.identify(Record("cut.csv", t, whole.v, whole.y, sample_time=0.001), thresholds=4)
        (used,) = fit.used
        assert used.left_out.tolist() == [*range(1500, 1510)]
        assert used.gaps.tolist() == [1500, 1510]
        assert [part[0] for part in used.parts] == [0, 1510]

    @pytest.mark.parametrize("history", [None, (60.0,)])
    def test_free_run_in_parts(self, history: tuple[float, ...] | None) -> None:
        record = spoilt()
        fit = hystgen.identify(record, thresholds=THRESHOLDS, history=history, p0_floor=0.0)
        (used,) = fit.used
        assert record.y is not None
        part = fit.parameters.model.pi
        drive = record.v.copy()
        good = np.setdiff1d(np.arange(len(drive)), place(SPIKES))
        for (begin, end), found in zip(((0, CUT), (CUT, len(record))), used.starts, strict=True):
            inside = good[(good >= begin) & (good < end)]
            v = np.interp(np.arange(begin, end), inside, drive[inside])
            start: float | Array = float(v[0])
            before = history if begin == 0 and history is not None else found.turns if found else None
            if before is not None:
                start = brute_plays(before, part.thresholds, 0.0)[-1]
            expected = brute_output(v, part.thresholds, part.weights, start)
            known = used.compared[begin:end]
            expected += np.mean((record.y[begin:end] - expected)[known])
            np.testing.assert_allclose(fit.along(record, used)[begin:end], expected, rtol=0, atol=1e-9)

    def test_other_records_are_refused(self, fitted: tuple[Fit, Record, Record], tmp_path: Path) -> None:
        fit, first, other = fitted
        with pytest.raises(ValueError, match="2 records"):
            hystgen.report_fit(fit, first, tmp_path / "out")
        with pytest.raises(ValueError, match=r"other\.csv is not the record spoilt\.csv of 2061 samples"):
            hystgen.report_fit(fit, other, tmp_path / "out", first)
        assert not (tmp_path / "out").exists()


class TestPage:
    def test_sections_in_order(self, page: Page) -> None:
        assert page.declared.lower() == "doctype html"
        assert [title for title in page.sections if title != "lead"] == [
            "How good it is", "Loops", "Over time", "Zoom and read values",
            "The residual, and what it depends on", "Initial loading curve",
            "Thresholds and weights", "What was done to the data", "Warnings", "Drive range", "What the C costs",
            "Parameters", "Provenance",
        ]  # fmt: skip
        assert "bytes on a Cortex-M0+" in page.sections["What the C costs"]

    def test_verdict(self, page: Page, fitted: tuple[Fit, Record, Record]) -> None:
        fit = fitted[0]
        lead, row = page.sections["lead"], fit.rows[-1]
        assert fit.intervals.held_out is not None
        low, high = fit.intervals.held_out
        assert "generalized Prandtl-Ishlinskii model" in lead
        assert f"{len(fit.parameters.model.pi.thresholds) - 1} plays behind a dead-zone front" in lead
        assert f"{row.rms:.3g} um rms, {row.rms_percent:.3g} % of the output range" in lead
        assert f"{low:.3g} to {high:.3g} um, {100 * low / row.output_range:.3g}" in lead
        assert "it is invertible" in lead
        assert "hystgen emit axis.yaml -o firmware/\n" in lead
        assert "Your next step: write the C." in lead

    def test_counts_are_those_put_in(self, page: Page, fitted: tuple[Fit, Record, Record]) -> None:
        first, other = table(page, "What was done to the data")
        used = fitted[0].used[0]
        found = sum(k not in used.ignored for k in place(OUTLIERS))
        assert (first["record"], first["part"]) == ("spoilt.csv", "fit")
        assert first["outliers of y"] == str(found)
        assert first["v bridged"] == str(len(SPIKES))
        assert first["gaps"] == "1"
        assert first["start, as asked"] == str(SKIP)
        assert int(first["samples"]) == len(fitted[1])
        assert int(first["compared"]) == fitted[0].rows[0].samples
        assert (other["part"], other["start, as asked"], other["gaps"]) == ("held out", str(SKIP), "0")
        caption = " ".join(page.sections["Over time"].split())
        assert f"{found} outliers, {len(SPIKES)} bridged drive samples, 1 gap;" in caption

    def test_fit_table_and_warnings(self, page: Page, fitted: tuple[Fit, Record, Record]) -> None:
        fit = fitted[0]
        for shown, row in zip(table(page, "How good it is"), fit.rows, strict=True):
            assert (shown["part"], shown["samples"]) == (row.part, str(row.samples))
            assert float(shown["rms [um]"]) == pytest.approx(row.rms, rel=1e-3)
        marked = [attributes for tag, attributes in page.tags if tag == "tr" and attributes.get("class") == "marked"]
        assert len(marked) == 1
        for text in fit.warnings:
            assert text in page.sections["Warnings"]
        assert fit.text() in page.sections["Parameters"]

    def test_pictures(self, page: Page, folder: Path) -> None:
        images = [attributes for tag, attributes in page.tags if tag == "img"]
        narrow = [attributes for tag, attributes in page.tags if tag == "source"]
        assert len(images) == len(narrow) == 6
        assert len({image["alt"] for image in images}) == 6
        for image, other in zip(images, narrow, strict=True):
            assert len(image["alt"]) > 30
            wide, slim = (
                base64.b64decode(data.removeprefix("data:image/svg+xml;base64,"), validate=True)
                for data in (image["src"], other["srcset"])
            )
            roots = [ElementTree.fromstring(svg) for svg in (wide, slim)]
            widths = [float(root.attrib["width"].removesuffix("pt")) for root in roots]
            assert widths[0] > 600 > 400 > widths[1] > 250
            assert min(len(list(root.iter())) for root in roots) > 100
        captions = [tag for tag, _ in page.tags if tag == "figcaption"]
        assert len(captions) == 6
        for file in FILES - {"report.html"}:
            content = (folder / file).read_bytes()
            assert content.startswith(b"\x89PNG\r\n\x1a\n" if file.endswith("png") else b"<?xml")
            assert len(content) > 10_000

    def test_nothing_to_load_and_one_script(self, page: Page, folder: Path) -> None:
        assert [attributes for tag, attributes in page.tags if tag == "script"] == [{}]
        for tag, attributes in page.tags:
            assert tag not in ("iframe", "object", "embed", "base")
            for name, value in attributes.items():
                assert not name.startswith("on")
                if name in ("src", "srcset", "href", "data", "action", "poster"):
                    assert value.startswith("data:")
        assert not re.search(r"@import|url\(", page.text)
        assert "://" not in page.text
        for svg in folder.glob("*.svg"):
            references = re.findall(r'href="([^"]*)"|url\(([^)]*)\)', svg.read_text())
            assert references
            assert all((a or b).startswith(("#", "data:image/png")) for a, b in references)

    def test_says_nothing_of_where_and_when(self, page: Page, folder: Path) -> None:
        for text in (page.text, *(svg.read_text() for svg in folder.glob("*.svg"))):
            for word in (str(folder), str(Path.cwd()), f" {platform.node()} ", "matplotlib.org"):
                assert word not in text
            assert not re.search(r"20\d\d-\d\d-\d\d|\d\d:\d\d:\d\d", text)
        assert f"hystgen {hystgen.__version__}" in page.sections["Provenance"]


def test_same_input_gives_the_same_bytes(fitted: tuple[Fit, Record, Record], folder: Path, tmp_path: Path) -> None:
    import matplotlib

    fit, first, other = fitted
    with matplotlib.rc_context({"font.size": 20, "svg.hashsalt": None, "lines.linewidth": 7, "axes.grid": False}):
        before = dict(matplotlib.rcParams)
        hystgen.report_fit(fit, [first], tmp_path / "again", [other])
        assert dict(matplotlib.rcParams) == before
    assert {path.name for path in folder.iterdir()} == FILES
    for name in FILES:
        assert (tmp_path / "again" / name).read_bytes() == (folder / name).read_bytes(), name


class TestFolder:
    def test_other_files_stay(self, fitted: tuple[Fit, Record, Record], tmp_path: Path) -> None:
        (tmp_path / "notes.txt").write_text("mine")
        (tmp_path / "report.html").write_text("old")
        fit, first, other = fitted
        hystgen.report_fit(fit, first, tmp_path, other)
        assert {path.name for path in tmp_path.iterdir()} == FILES | {"notes.txt"}
        assert (tmp_path / "notes.txt").read_text() == "mine"
        assert (tmp_path / "report.html").read_text() != "old"

    def test_a_new_one_has_the_usual_rights(self, folder: Path) -> None:
        (folder.parent / "usual").mkdir()
        assert stat.S_IMODE(folder.stat().st_mode) == stat.S_IMODE((folder.parent / "usual").stat().st_mode)
        assert {path.name for path in folder.parent.iterdir()} == {"out", "usual"}

    @pytest.mark.parametrize("exists", [False, True])
    @pytest.mark.thorough
    def test_nothing_half_written(
        self, exists: bool, fitted: tuple[Fit, Record, Record], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        fit, first, other = fitted
        if exists:
            (tmp_path / "out").mkdir()
            (tmp_path / "out" / "loop.svg").write_text("old")
        write = Path.write_bytes

        def full(self: Path, data: bytes) -> int:
            if self.name == "weights.png":
                raise OSError("disk full")
            return write(self, data)

        monkeypatch.setattr(Path, "write_bytes", full)
        with pytest.raises(OSError, match="disk full"):
            hystgen.report_fit(fit, first, tmp_path / "out", other)
        files = {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*")}
        assert files == ({"out", "out/loop.svg"} if exists else set())
        if exists:
            assert (tmp_path / "out" / "loop.svg").read_text() == "old"


class TestCommand:
    def files(self, folder: Path) -> list[Path]:
        v = wander(4)
        y = noisy(brute_output(v, THRESHOLDS, WEIGHTS, 0.0), NOISE)
        beyond = 1.2 * wander(5) - 10.0
        z = noisy(brute_output(beyond, THRESHOLDS, WEIGHTS, 0.0), NOISE)
        return [write_csv(folder / "a.csv", v, y), write_csv(folder / "b.csv", beyond, z)]

    def test_auto_and_a_holdout_beyond_the_range(self, run: Run, tmp_path: Path) -> None:
        a, b = self.files(tmp_path)
        out, report = tmp_path / "named.yaml", tmp_path / "new" / "report"
        code, said, warned = run("identify", a, "--holdout", b, "-o", out, "--model", "auto", "--units", "V,um",
                                 "--report", report)  # fmt: skip
        assert code == 0
        assert said.splitlines()[-1] == str(report / "report.html")
        page = Page((report / "report.html").read_text(encoding="utf-8"))
        assert "hystgen emit named.yaml -o firmware/\n" in page.sections["lead"]
        rows = table(page, "How good it is")
        assert [row["part"] for row in rows] == ["candidate"] * 4 + ["fit", "held out"]
        assert "pi was chosen" in page.sections["How good it is"], "the plant has no front"
        beyond = 1.2 * wander(5) - 10.0
        number = int(np.count_nonzero((beyond < 0.0) | (beyond > 100.0)))
        fitted_range, held = table(page, "Drive range")
        assert (fitted_range["samples outside"], held["samples outside"]) == ("0", str(number))
        assert (held["least [V]"], held["largest [V]"]) == ("-10", "110")
        assert (held["farthest outside [V]"], held["of the range"]) == ("10", "10 %")
        warning = f"b.csv: {number} samples have a drive outside the fitted range 0 to 100"
        assert warning in page.sections["Warnings"]
        assert warning in warned

    def test_without_an_inverse_and_without_holdout(self, tmp_path: Path) -> None:
        backlash = made("backlash.csv", 4, np.asarray, (0.0, *WEIGHTS[1:]))
        record = write_csv(tmp_path / "backlash.csv", backlash.v, backlash.y)
        fit = hystgen.identify(record, thresholds=THRESHOLDS, p0_floor=0.0)
        assert fit.parameters.model.pi.weights[0] == 0.0
        page = Page(hystgen.report_fit(fit, record, tmp_path / "out").read_text(encoding="utf-8"))
        lead = page.sections["lead"]
        assert "it has no inverse" in lead
        assert "(p_0 > 0)" in lead
        assert "hystgen emit stage.yaml -o firmware/ --operator forward\n" in lead
        assert "fitted to the first 75 % of the records, such a model predicts the rest" in lead

    def test_missing_matplotlib_is_reported_before_the_fit(
        self, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        a, _ = self.files(tmp_path)
        monkeypatch.setitem(sys.modules, "matplotlib", None)
        code, said, printed = run("identify", a, "-o", tmp_path / "a.yaml", "--report", tmp_path / "out")
        assert (code, said) == (2, "")
        assert extras.install("plot") in printed
        assert {path.name for path in tmp_path.iterdir()} == {"a.csv", "b.csv"}

    def test_a_file_in_the_way_and_an_input_in_the_folder(self, run: Run, tmp_path: Path) -> None:
        a, _ = self.files(tmp_path)
        assert run("identify", a, "-o", tmp_path / "a.yaml", "--report", a / "below")[0] == 2
        a.rename(tmp_path / "loop.png")
        code, _, printed = run("identify", tmp_path / "loop.png", "-o", tmp_path / "a.yaml", "--report", tmp_path)
        assert code == 2
        assert "would be overwritten" in printed
        assert {path.name for path in tmp_path.iterdir()} == {"loop.png", "b.csv"}


class TestDrawing:
    def test_thinned_lines_keep_their_peaks(self) -> None:
        random = np.random.default_rng(2)
        signal = random.normal(size=300_000)
        signal[random.choice(len(signal), 50, replace=False)] += 40.0
        signal[1234:5678] = np.nan
        chosen = drawing.kept(100, 290_000, signal)
        assert len(chosen) <= 2 * drawing.BLOCKS + 2
        assert np.all(np.diff(chosen) > 0)
        assert (chosen[0], chosen[-1]) == (100, 289_999)
        part = np.array_split(signal[100:290_000], 100)
        shown = [signal[chosen[(chosen >= a) & (chosen < a + 2899)]] for a in range(100, 290_000, 2899)]
        for whole, drawn in zip(part, shown, strict=True):
            if np.isfinite(whole).any():
                assert np.nanmax(drawn) == np.nanmax(whole)
                assert np.nanmin(drawn) == np.nanmin(whole)
        assert np.isnan(signal[chosen]).any(), "a hole stays one"
        assert drawing.kept(5, 900, signal).tolist() == [*range(5, 900)]

    def test_a_sample_of_a_cloud_is_fair(self) -> None:
        chosen = drawing.sampled(1_000_000)
        assert 0.99 * drawing.MOST_POINTS <= len(chosen) <= drawing.MOST_POINTS
        for period in (2, 100, 10_000):
            counts = np.histogram(chosen % period, bins=2)[0]
            np.testing.assert_allclose(counts / len(chosen), 0.5, atol=0.03)

    def test_bins(self) -> None:
        random = np.random.default_rng(3)
        x, y = random.uniform(-2.0, 3.0, 5000), random.normal(size=5000)
        x[:200] = np.nan
        x = x[200:]
        y = y[200:]
        middle, mean, spread = fit_figures.binned(x, y, -1.0, 2.0)
        inside = (x >= -1.0) & (x <= 2.0)
        for kind, found in (("mean", mean), ("std", spread)):
            expected = binned_statistic(x[inside], y[inside], kind, bins=40, range=(-1.0, 2.0)).statistic
            np.testing.assert_allclose(found, expected, rtol=1e-10)
        np.testing.assert_allclose(middle, -1.0 + (np.arange(40) + 0.5) * 0.075)
        assert np.isnan(fit_figures.binned(np.array([0.0, 1.0]), np.array([1.0, 1.0]), 0.0, 1.0)[1]).all()

    def shown(self, residual: Array, v: Array) -> Shown:
        n, none = len(residual), np.empty(0, dtype=np.intp)
        record = Record("made", np.arange(n) * 0.01, v, residual, sample_time=0.01)
        used = Used("made", False, n, ((0, n),), (None,), none, none, none, none, none, none, none)
        return Shown(record, used, np.zeros(n))

    @pytest.mark.parametrize("sigma", [0.01, 0.3])
    def test_white_noise_is_found_beside_smooth_errors(self, sigma: float) -> None:
        t = np.linspace(0.0, 20.0, 20_000)
        noise = np.random.default_rng(4).normal(0.0, sigma, len(t))
        found = self.shown(np.sin(t) + noise, t).noise
        assert found == pytest.approx(sigma, rel=0.05)

    def test_noise_that_is_not_white_is_not_reported(self) -> None:
        t = np.linspace(0.0, 20.0, 20_000)
        white = np.random.default_rng(5).normal(size=len(t))
        for length in (2, 3, 9):
            assert self.shown(np.convolve(white, np.ones(length) / length, "same"), t).noise is None
        assert self.shown(np.sin(t), t).noise is None

    def test_rate_of_a_triangle(self) -> None:
        v = np.abs(np.arange(2001) % 400 - 200.0)
        rate = self.shown(np.sin(v), v).rate
        away = np.abs(np.arange(2001) % 200 - 100) < 90
        rising = np.arange(2001) % 400 > 200
        np.testing.assert_allclose(rate[away], np.where(rising, 100.0, -100.0)[away])

    @pytest.mark.thorough
    def test_a_report_of_a_million_samples_is_small(self, tmp_path: Path) -> None:
        n = 1_000_000
        t = np.arange(n) * 1e-4
        v = 50.0 - 50.0 * np.cos(6.0 * np.pi * t) * (0.5 + 0.5 * np.cos(0.1 * np.pi * t))
        y = noisy(v + 5.0 * np.sin(v / 10.0), 0.3)
        record = Record("long", t, v, y, sample_time=1e-4)
        page = hystgen.report_fit(hystgen.identify(record, thresholds=2), record, tmp_path / "out")
        (samples,) = (
            attributes["data-viewer"] for _, attributes in Page(page.read_text()).tags if "data-viewer" in attributes
        )
        assert n < len(samples) < 9 * n
        assert page.stat().st_size < len(samples) + 3_000_000


class TestBrowser:
    def headless(self, chromium: str, folder: Path, *options: object) -> subprocess.CompletedProcess[str]:
        command = [
            chromium, "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run",
            "--hide-scrollbars", "--enable-logging=stderr", f"--user-data-dir={folder / 'profile'}", *map(str, options),
        ]  # fmt: skip
        return subprocess.run(command, capture_output=True, text=True, check=True, timeout=120)

    def measured(self, chromium: str, folder: Path, page: str, width: int) -> tuple[dict[str, list[float]], list[str]]:
        """Measures of the page in a window of that width, and the complaints of the browser."""
        (folder / "frame.html").write_text(
            f"""<!DOCTYPE html><html><head><meta charset="utf-8"></head><body>
<iframe style="width: {width}px; height: 900px; border: 0" srcdoc="{html.escape(page)}"></iframe><pre></pre>
<script>
addEventListener("load", () => {{
  const inner = document.querySelector("iframe").contentDocument, root = inner.documentElement;
  document.querySelector("pre").textContent = JSON.stringify({{
    page: [root.scrollWidth, root.clientWidth, root.scrollHeight],
    loaded: [...inner.images].map(i => i.complete ? i.naturalWidth : 0),
    shown: [...inner.images].map(i => i.getBoundingClientRect().width),
    narrow: [...inner.querySelectorAll("source")].map(s => s.srcset === s.nextElementSibling.currentSrc ? 1 : 0),
  }});
}});
</script></body></html>""",
            encoding="utf-8",
        )
        done = self.headless(
            chromium, folder, "--virtual-time-budget=20000", "--dump-dom", (folder / "frame.html").as_uri()
        )
        (found,) = re.findall(r"<pre>(\{.*?\})</pre>", done.stdout)
        return json.loads(html.unescape(found)), [line for line in done.stderr.splitlines() if "CONSOLE" in line]

    @pytest.mark.parametrize("width", [1200, 390])
    def test_fits_the_window_and_draws_every_picture(
        self, width: int, chromium: str, page: Page, tmp_path: Path
    ) -> None:
        found, complaints = self.measured(chromium, tmp_path, page.text, width)
        assert complaints == []
        needs, has, height = found["page"]
        assert needs <= has == width
        assert height > 2000
        assert len(found["loaded"]) == 6
        assert min(found["loaded"]) > 250
        assert min(found["shown"]) > 0.8 * min(width, 1024)
        assert found["narrow"] == [float(width == 390)] * 6

    def test_a_bad_page_would_be_noticed(self, chromium: str, tmp_path: Path) -> None:
        bad = (
            '<body><img src="data:image/svg+xml;base64,AAAA" alt=""><p style="width: 2000px">wide</p>'
            "<script>nothing.here</script></body>"
        )
        found, complaints = self.measured(chromium, tmp_path, bad, 390)
        assert complaints
        assert found["page"][0] > 1000
        assert found["loaded"] == [0]

    def test_prints_on_few_pages(self, chromium: str, folder: Path, tmp_path: Path) -> None:
        target = tmp_path / "out.pdf"
        self.headless(chromium, tmp_path, f"--print-to-pdf={target}", (folder / "report.html").as_uri())
        pdf = target.read_bytes()
        assert pdf.startswith(b"%PDF")
        assert 3 <= len(re.findall(rb"/Type\s*/Page\b", pdf)) <= 9
        sizes = {tuple(map(float, box.split())) for box in re.findall(rb"/MediaBox\s*\[([^\]]*)\]", pdf)}
        ((_, _, wide, high),) = sizes
        assert (wide, high) == pytest.approx((595.3, 841.9), abs=1.0), "A4"


def test_python_call_is_part_of_the_package() -> None:
    assert "report_fit" in hystgen.__all__
    assert pages.names()[0] == "report.html"
    assert set(pages.names()) == FILES


def test_shares_of_ten_times_and_more_are_factors() -> None:
    assert percent(0.1234) == "12.3 %"
    assert percent(9.994, of="the range") == "999 % of the range"
    assert percent(32.0, of="the range") == "32 times the range"
    assert percent(-0.5, "+.0f") == "-50 %"


def test_ratios_to_the_noise_have_two_digits() -> None:
    assert [times_noise(ratio) for ratio in (2.84, 45.6, 99.7, 100.0)] == [
        "2.8 times the noise", "46 times the noise", "100 times the noise", "100 times the noise",
    ]  # fmt: skip
    assert times_noise(130.0) == "more than 100 times the noise"
