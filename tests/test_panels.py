"""Panels that show small differences, and the page of a diagnosis that holds them, against other formulations."""

from __future__ import annotations

import html
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import bilinear, freqz, lfilter

from hystgen.basics import drawing
from hystgen.diagnosis import Diagnosis, Signals
from hystgen.diagnosis.findings.result import Contender, FitErrors, Gap, Inverse, NamedEffect, Result
from hystgen.effects import CATALOGUE, shapes
from hystgen.effects.base import Effect, Run
from hystgen.parameters.files import load_parameters
from hystgen.report import diagnosis as report
from hystgen.report import diagnosis_figures, panels

Array = NDArray[np.float64]


def made_effect(**keys: Any) -> Effect:
    """An effect of the catalogue."""
    text = ", ".join(f"{key}: {value}" for key, value in keys.items())
    return load(f"effects: [{{{text}}}]").model.effects[0]


def load(effects: str, folder: Path | None = None) -> Any:
    import tempfile

    with tempfile.TemporaryDirectory() as place:
        path = Path(folder or place) / "stage.yaml"
        path.write_text(
            "hystgen: 1\nname: stage\nunits: {input: V, output: um}\ninput_range: [0, 100]\n"
            f"model:\n  pi: {{thresholds: [0, 10], weights: [0.1, 0.05]}}\n  {effects}\n"
        )
        return load_parameters(path)


def test_the_straight_line_is_that_of_least_squares() -> None:
    random = np.random.default_rng(1)
    x, y = random.uniform(0.0, 100.0, 500), random.normal(size=500)
    y[::7] = np.nan
    known = np.isfinite(y)
    slope, offset = np.polyfit(x[known], y[known], 1)
    assert panels.straight_line(x, y) == pytest.approx((offset, slope))
    assert panels.straight_line(np.ones(4), np.arange(4.0)) == (1.5, 0.0)
    np.testing.assert_allclose(panels.line_of(x, y), offset + slope * x)


def test_the_worst_stretch_is_found_by_trying_all() -> None:
    error = np.random.default_rng(2).normal(size=3000)
    error[1200:1290] *= 3.0
    error[2000:2600] = np.nan
    first, last = panels.worst_stretch(error)
    length = last - first
    assert length == 120
    sums = [float(np.nansum(error[k : k + length] ** 2)) for k in range(len(error) - length + 1)]
    assert first == int(np.argmax(sums))
    assert panels.worst_stretch(np.ones(10)) == (0, 10)


class TestSpectrum:
    def test_of_white_noise_and_of_a_line_beside_a_gap(self) -> None:
        """The density of white noise, and the power of a line, which a gap does not smear: the stretches are not
        joined."""
        t = 1e-3 * np.arange(20_000)
        wave = np.sin(2.0 * np.pi * 50.0 * t)
        error = np.random.default_rng(3).normal(0.0, 0.2, len(t)) + wave
        error[9_000:9_013] = np.nan
        found = panels.density(t, error)
        assert found is not None
        hertz, values = found
        away = np.abs(hertz - 50.0) > 5.0
        assert np.sqrt(np.mean(values[away] ** 2)) == pytest.approx(0.2 * np.sqrt(2e-3), rel=0.03)
        near = np.abs(hertz - 50.0) < 3.0
        assert np.sum(values[near] ** 2) * hertz[0] == pytest.approx(0.5, rel=0.02)
        assert panels.density(t[:90], error[:90] * np.where(np.arange(90) == 45, np.nan, 1.0)) is None

    def test_mains_are_marked_where_they_can_be_told_apart(self) -> None:
        fine, coarse = np.arange(1, 200) * 1.0, np.arange(1, 100) * 6.0
        assert panels.mains(fine) == [50.0, 60.0, 100.0, 120.0, 150.0, 180.0]
        assert panels.mains(coarse) == []
        assert panels.mains(np.arange(1, 110) * 1.0) == [50.0, 60.0, 100.0]
        assert panels.mains(np.arange(1, 101) * 1.0) == [50.0, 60.0]
        assert "cannot" not in panels.mains_words(fine, np.ones(199))
        assert "No mains are marked" in panels.mains_words(coarse, np.ones(99))

    def test_noise_is_no_peak_and_a_line_is_one(self) -> None:
        """White noise has no peak in 2,000 tries; a line of 0.45 standard deviations has one in all of 50."""
        random, t = np.random.default_rng(4), 1e-3 * np.arange(2048)
        for k in range(400):
            found = panels.density(t, random.normal(size=len(t)) + (0.45 * np.sin(2e2 * np.pi * t) if k < 50 else 0.0))
            assert found is not None
            assert [panels.raised(*found, line) for line in (50.0, 60.0, 120.0, 150.0, 180.0)] == [False] * 5
            assert panels.raised(*found, 100.0) == (k < 50)
            words = panels.mains_words(*found)
            assert ("a peak stands out at 100 Hz." in words) == (k < 50)
            assert ("no peak stands out there." in words) == (k >= 50)
        assert "100 Hz, found in the records, is named; no other peak" in panels.mains_words(*found, [100.0])


class TestResponse:
    def test_of_a_known_filter(self) -> None:
        """Measured response of a second-order low pass, against that of its coefficients."""
        random, step = np.random.default_rng(5), 1e-3
        w = 2.0 * np.pi * 40.0
        b, a = bilinear([w * w], [1.0, 0.2 * w, w * w], 1.0 / step)
        u = random.normal(size=40_000)
        y = lfilter(b, a, u)
        t = step * np.arange(len(u))
        gone = np.where((np.arange(len(u)) > 20_000) & (np.arange(len(u)) < 20_050), np.nan, y)
        found = panels.response([(t, u, gone + 1e-4 * random.normal(size=len(u)), y)])
        assert found is not None
        hertz, measured, modelled = found
        expected = freqz(b, a, worN=hertz, fs=1.0 / step)[1]
        near = hertz < 100.0
        for each in (measured, modelled):
            assert np.max(np.abs(each[near] / expected[near] - 1.0)) < 0.1
        deaf = panels.response([(t, u, random.normal(size=len(u)), y)])
        assert deaf is not None
        assert np.isnan(deaf[1]).all(), "an output that does not follow the input has no response"

    @pytest.mark.parametrize(
        "keys",
        [
            {"name": "lag", "time_constant": 0.01},
            {"name": "delay", "time": 0.004},
            {"name": "resonance", "frequency": 40.0, "damping": 0.05},
            {"name": "resonance", "shape": "part", "frequency": 40.0, "damping": 0.05, "share": 0.3},
        ],
        ids=lambda keys: f"{keys['name']} {keys.get('shape', '')}",
    )
    def test_of_an_effect_is_that_of_its_forward_model(self, keys: dict[str, Any]) -> None:
        """A sine passed through the effect settles at the gain and the phase of its response."""
        effect, t = made_effect(**keys), 1e-4 * np.arange(40_000)
        for hertz in (5.0, 37.0, 60.0):
            angle = 2.0 * np.pi * hertz * t
            run = Run(t, np.sin(angle))
            out = effect.filtered(effect.drive(np.sin(angle), run), run)[20_000:]
            waves = np.column_stack([np.sin(angle), np.cos(angle)])[20_000:]
            (real, imaginary), *_ = np.linalg.lstsq(waves, out, rcond=None)
            response = effect.response(np.array([hertz]))
            assert response is not None
            assert response[0] == pytest.approx(complex(real, imaginary), rel=2e-3, abs=2e-3)
        assert effect.response(np.array([1e-9]))[0] == pytest.approx(1.0)  # type: ignore[index]

    def test_effects_with_a_response_are_those_named(self) -> None:
        with_one = {name for name in CATALOGUE for kind in shapes(name) if kind.response is not Effect.response}
        assert with_one == {"lag", "delay", "resonance"}
        corner = made_effect(name="lag", time_constant=0.01).corner
        assert corner is not None
        assert corner[0] == pytest.approx(15.9155, rel=1e-5)


def test_groups_even_in_the_logarithm_hold_every_sample_once() -> None:
    t = 0.01 * np.arange(1, 3000)
    groups = panels.even_in_log(t, 40)
    assert [k for part in groups for k in range(part.start, part.stop)] == [*range(2999)]
    assert all(part.stop > part.start for part in groups)
    assert 20 < len(groups) <= 40


# The page of a diagnosis -----------------------------------------------------------------------------------

def diagnosis(effects: str, named: bool = True) -> Diagnosis:
    """A made-up diagnosis: the drive moves and holds, the error before is a known wave, the one after is noise."""
    random = np.random.default_rng(6)
    t = 2e-3 * np.arange(6000)
    v = np.interp(t, [0.0, 2.0, 5.0, 6.0, 9.0, 12.0], [0.0, 80.0, 80.0, 20.0, 20.0, 100.0])
    noise = random.normal(0.0, 0.01, len(t))
    y = 0.1 * v + noise
    before = noise + 0.2 * np.sin(5.0 * t)
    before[:200] = np.nan
    signals = tuple(
        Signals(f"{role}.csv", held, t, v, y, before, noise if named else before)
        for role, held in (("fit", False), ("<b>$\\frac$", True))
    )
    names = ("lag", "creep") if named else ()
    found = tuple(NamedEffect(name, {}, {}, 0.9, 0.14, 0.01, 1e-9, "") for name in names)
    tried = (
        (
            Contender("lag", "lag", 0.01, 0.01),
            Contender("creep", "creep, logarithmic", 0.1, 0.1, "it removes too little"),
        ),
        (Contender("thermal", "thermal, gain", 0.01, 0.01, "its gain <may> be due to chance"),),
    )
    gap = Gap(FitErrors(0.15, 0.15), FitErrors(0.14, 0.14), FitErrors(0.01, 0.01))
    result = Result(
        "effects_found" if named else "unexplained", 0.01, 10.0, "um", gap, found, (), (), (), (), tried,
        Inverse(True, ()),
    )
    return Diagnosis(result, load(effects), (), signals)


@pytest.fixture(scope="module")
def with_effects() -> Diagnosis:
    return diagnosis(
        "effects: [{name: lag, time_constant: 0.01}, {name: creep, time_constants: [1.0], weights: [0.01]}]"
    )


def test_before_and_after_are_on_one_scale(with_effects: Diagnosis) -> None:
    with drawing.styled():
        figure = diagnosis_figures.deviation(with_effects, diagnosis_figures.WIDE)
        figure.draw_without_rendering()
    top, other, bottom, below = figure.axes[:4]
    assert top.get_ylim() == other.get_ylim()
    assert bottom.get_ylim() == below.get_ylim()
    low, high = bottom.get_ylim()
    assert low < -0.19
    assert high > 0.19
    spread = [np.ptp(axes.collections[0].get_offsets()[:, 1]) for axes in (bottom, below)]
    assert spread[0] > 0.35 > 0.1 > spread[1]


def test_lines_end_at_bins_with_too_few_samples(with_effects: Diagnosis) -> None:
    with drawing.styled():
        figure = diagnosis_figures.against(with_effects, diagnosis_figures.WIDE)
        (rate,) = (axes for axes in figure.axes if axes.get_xlabel().startswith("drive rate"))
        means = rate.lines[0].get_ydata()
    # the drive moves at 0, 27, 40 and -60 V/s alone: single bins, with nothing between them
    known = np.isfinite(np.asarray(means, dtype=float))
    assert 4 <= np.count_nonzero(known) <= 8
    assert np.count_nonzero(np.diff(known.astype(int)) == 1) >= 3


@pytest.mark.parametrize("named", [True, False])
def test_every_legend_entry_is_drawn(named: bool, with_effects: Diagnosis) -> None:
    """No legend names what its figure does not show; figures of effects are there only with those effects."""
    given = "effects: [{name: lag, time_constant: 0.01}]"  # as the model was given, so in the refitted one too
    found = with_effects if named else diagnosis(given, False)
    shown = [name for name in diagnosis_figures.FIGURES if diagnosis_figures.applies(found, name)]
    assert {"bode", "stops"} & set(shown) == ({"bode", "stops"} if named else set())
    with drawing.styled():
        for name in shown:
            figure = diagnosis_figures.FIGURES[name](found, diagnosis_figures.NARROW)
            legends = [axes.get_legend() for axes in figure.axes] + figure.legends
            entries = {text.get_text() for legend in legends if legend for text in legend.get_texts()}
            lines = {
                line.get_label()
                for axes in figure.axes
                for line in (*axes.lines, *axes.collections)
                if np.isfinite(np.asarray(line.get_ydata() if hasattr(line, "get_ydata") else 0.0, dtype=float)).any()
            }
            assert entries <= lines, name
            assert ("with the effects" in entries) <= named, name


def test_the_page_folds_what_was_refused_and_escapes_names(with_effects: Diagnosis) -> None:
    page = report.html(with_effects, "text of the file")
    assert "<b>$" not in page
    titles = re.findall(r"<h2>(.*?)</h2>", page)
    assert "Frequency response" in titles
    assert "Creep" in titles
    summary = "<summary>3 shapes, 2 of them refused, and why</summary>"
    (folded,) = re.findall(rf"<details>\s*{summary}(.*?)</details>", page, re.DOTALL)
    assert folded.count("<table>") == page.count("<table>", page.index("Shapes that were tried")) == 1
    cells = [html.unescape(cell) for cell in re.findall(r"<td[^>]*>(.*?)</td>", folded)]
    assert [cells[k : k + 7] for k in (0, 7, 14)] == [
        ["1", "lag", "lag", "0.01", "0.01", "0.0 %", "named"],
        ["1", "creep", "creep, logarithmic", "0.1", "0.1", "900.0 %", "it removes too little"],
        ["2", "thermal", "thermal, gain", "0.01", "0.01", "0.0 %", "its gain <may> be due to chance"],
    ]
