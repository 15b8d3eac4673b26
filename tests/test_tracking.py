"""Errors that each compensator would leave on a recorded actuator."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import hystgen
from hystgen import simulation, tracking
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters
from hystgen.records import Record

T = 0.01
TEXT = """\
hystgen: 1
name: crept
units: {input: V, output: um}
sample_time: 0.01
input_range: [0, 100]
model:
  pi:
    thresholds: [0, 4, 10, 20, 35]
    weights: [0.15, 0.02, 0.02, 0.02, 0.01]
  effects:
    - {name: creep, time_constants: [0.5, 5], weights: [0.03, 0.03]}
"""


def recorded(noise: float = 1e-3) -> Record:
    """A record of stops instead of plays, and of springs with dampers, stepped ten times per sample here."""
    rng = np.random.default_rng(4)
    turns = np.concatenate([[0.0, 100.0, 0.0], rng.uniform(0.0, 100.0, 40)])
    v = np.interp(np.linspace(0, len(turns) - 1, 4000), np.arange(len(turns)), turns)
    r, p = np.array([4.0, 10.0, 20.0, 35.0]), np.array([0.02, 0.02, 0.02, 0.01])
    stretch, late, before = np.zeros(4), np.zeros(2), 0.0
    y = []
    for each in v:
        for drive in np.linspace(before, each, 11)[1:]:
            stretch = np.clip(stretch + drive - before, -r, r)
            before = drive
            h = 0.22 * drive - float(p @ stretch)
            late += (0.03 * h - late) * T / 10.0 / np.array([0.5, 5.0])
        y.append(h + float(np.sum(late)))
    return Record("crept.csv", T * np.arange(len(v)), v, np.array(y) + noise * rng.normal(size=len(v)))


def test_the_whole_model_leaves_the_noise_and_plays_alone_the_creep() -> None:
    record = recorded()
    found = tracking.track(Model(parse_parameters(TEXT)), [record])
    (one,) = found.records
    assert set(one.errors) == {tracking.LINE, tracking.PLAYS, tracking.WHOLE}
    assert one.rms(tracking.LINE) > 3.0 * one.rms(tracking.PLAYS) > 6.0 * one.rms(tracking.WHOLE)
    noise = 100.0 * 1e-3 / one.span
    assert one.rms(tracking.WHOLE) < 3.0 * noise
    table = found.table()
    assert f"{one.rms(tracking.WHOLE):6.3f}" in table
    assert "plays alone: the inverse of the model without its effects (creep), all else as in" in table
    assert [text.rpartition(", ")[2] for text in one.limited] == [tracking.PLAYS], "they do not reach what crept"


def solved(y: float, states: list[float]) -> float:
    """The drive in range at which the plays of `TEXT` alone give y, or come nearest to it, by bisection."""
    r, p = (0.0, 4.0, 10.0, 20.0, 35.0), (0.15, 0.02, 0.02, 0.02, 0.01)
    low, high = 0.0, 100.0
    for _ in range(80):
        v = 0.5 * (low + high)
        found = sum(b * min(max(s, v - a), v + a) for a, b, s in zip(r, p, states, strict=True))
        low, high = (v, high) if found < y else (low, v)
    states[:] = [min(max(s, v - a), v + a) for a, s in zip(r, states, strict=True)]
    return v


def test_plays_alone_are_the_plays_of_the_model() -> None:
    """Plays are not refitted to the record that is tracked, which creeps far more here than the model says."""
    record = recorded()
    assert record.y is not None
    other = Record("other.csv", record.t, record.v, record.y + 0.05 * np.cumsum(record.v - 50.0) * T)
    model = Model(parse_parameters(TEXT))
    (one,) = tracking.track(model, [other]).records
    states = [0.0] * 5
    v = [solved(float(y), states) for y in one.reference]
    error = one.reference - model.simulate(v, t=record.t) - (other.y - one.reference)
    error -= np.mean(error[one.known :])
    assert one.errors[tracking.PLAYS] == pytest.approx(error, abs=1e-9)
    (said,) = one.limited
    limited = np.count_nonzero(one.reference > 0.22 * 100.0 - 0.02 * (4.0 + 10.0 + 20.0) - 0.01 * 35.0)
    assert said == f"other.csv: {limited} of 4000 references lie outside the output range and were limited, plays alone"


def test_a_model_without_effects_is_its_plays() -> None:
    found = tracking.track(Model(parse_parameters(TEXT.partition("  effects")[0])), [recorded()])
    (one,) = found.records
    assert one.rms(tracking.PLAYS) == one.rms(tracking.WHOLE)
    assert "plays alone: the inverse of the model, which has no effects." in found.table()


class TestLimited:
    """Only drives that an end of the range really changed are counted."""

    STATIC = TEXT.partition("  effects")[0]
    LAGS = TEXT + "    - {name: lag, time_constant: 0.02}\n"

    def said(self, text: str, u: np.ndarray) -> list[str]:
        record = Record("u.csv", T * np.arange(len(u)), np.empty(0), extra={"u": u})
        ((_, found),) = simulation.simulate_records(Model(parse_parameters(text)), [record], "inverse")
        return found

    @pytest.mark.parametrize("seed", range(12))
    def test_motions_of_the_range_need_no_limit(self, seed: int) -> None:
        """The drive goes exactly to both ends, and rests there."""
        rng = np.random.default_rng(seed)
        low, high = float(rng.uniform(-50.0, 0.0)), float(rng.uniform(50.0, 120.0))
        weights = rng.uniform(0.01, 0.3, 5).tolist()
        v = np.interp(np.arange(400) / 20.0, np.arange(20), [low, low, high, high, *rng.uniform(low, high, 16)])
        for text in (self.STATIC, TEXT):
            text = text.replace("[0, 100]", f"[{low}, {high}]").replace("[0.15, 0.02, 0.02, 0.02, 0.01]", f"{weights}")
            u = Model(parse_parameters(text)).simulate(v, t=T * np.arange(len(v)))
            assert self.said(text, u) == []

    def test_at_rest_at_an_end(self) -> None:
        for text in (self.STATIC, TEXT, self.LAGS):
            assert self.said(text, np.zeros(50)) == []

    def test_beyond_the_range(self) -> None:
        u = np.concatenate([np.linspace(0.0, 12.0, 50), np.full(3, 500.0), np.full(40, 12.0)])
        for text in (TEXT, self.STATIC):
            assert self.said(text, u)[0] == "u.csv: 3 of 93 references lie outside the output range and were limited"
        u[51:53] = 12.0
        for text in (TEXT, self.STATIC):
            assert self.said(text, u)[0] == "u.csv: 1 of 93 references lies outside the output range and was limited"

    def test_a_little_beyond_the_range_counts(self) -> None:
        """The excess is a millionth of the range, a code of a 20-bit converter."""
        for text in (self.STATIC, TEXT):
            model = Model(parse_parameters(text))
            wide = Model(parse_parameters(text.replace("[0, 100]", "[-10, 110]")))
            v = np.interp(np.arange(60), [0, 50, 51, 59], [0.0, 100.0 + 1e-4, 99.0, 30.0])
            u = wide.simulate(v, t=T * np.arange(len(v)))
            assert model.cascade.input_range == (0.0, 100.0)
            (said,) = self.said(text, u)
            assert said.startswith("u.csv: 1 of 60 ")


def test_track_prints_a_table_and_draws(tmp_path: Path, run: Callable[..., tuple[int, str, str]]) -> None:
    record = recorded()
    assert record.y is not None
    rows = np.column_stack([record.t, record.v, record.y])
    np.savetxt(tmp_path / "crept.csv", rows, delimiter=",", header="t,v,y", comments="")
    (tmp_path / "crept.yaml").write_text(TEXT)
    written_to = ["--plot", tmp_path / "t.svg", "--json", tmp_path / "t.json", "-o", tmp_path / "tracking"]
    code, out, err = run("track", tmp_path / "crept.yaml", tmp_path / "crept.csv", *written_to)
    assert code == 0, err
    made = [tmp_path / "tracking" / name for name in ("tracking.json", "report.html", "tracking.svg")]
    assert out.splitlines()[-5:] == [str(tmp_path / "t.json"), str(tmp_path / "t.svg"), *map(str, made)]
    assert made[0].read_text() == (tmp_path / "t.json").read_text()
    assert made[2].read_bytes() == (tmp_path / "t.svg").read_bytes()
    written = json.loads((tmp_path / "t.json").read_text())
    assert written["left_out"] == ["creep"]
    assert "without its effects (creep)" in written["compensators"]["plays alone"]
    (one,) = written["records"]
    assert f"{one['errors']['whole model']['rms']:6.3f}" in out
    assert "straight line" in out
    (viewer,) = re.findall(r'data-viewer="([^"]*)"', made[1].read_text())
    shown = json.loads(html.unescape(viewer))
    assert shown["models"] == [tracking.LINE, tracking.PLAYS, tracking.WHOLE]
    assert shown["words"] == ["reference", "reference \N{MINUS SIGN} motion"]
    assert shown["records"][0]["count"] == len(record)
    assert "late" not in err
    (tmp_path / "late.yaml").write_text(TEXT + "emit: {compensation: {corner: 21, preview: 10}}\n")
    code, _, err = run("track", tmp_path / "late.yaml", tmp_path / "crept.csv")
    assert "the motion of the whole model is 20 samples late, which counts as error" in err
    np.savetxt(tmp_path / "v.csv", rows[:, :2], delimiter=",", header="t,v", comments="")
    code, out, err = run("track", tmp_path / "crept.yaml", tmp_path / "v.csv")
    assert (code, out) == (2, "")
    assert "y" in err


def test_what_rounds_corners_or_makes_late_counts_as_error() -> None:
    """Creep is compensated exactly, so the motion is the averaged and delayed reference."""
    record = recorded(0.0)
    model = Model(parse_parameters(TEXT + "emit: {compensation: {corner: 21, preview: 10}}\n"))
    (one,) = tracking.track(model, [record]).records
    mean = np.full(21, 1.0 / 21)
    averaged = one.reference
    for _ in range(3):  # of the last 21 samples each: 30 samples late, of which 10 are known ahead
        averaged = np.convolve(np.pad(averaged, 20, mode="edge"), mean)[20:-40]
    motion = np.append(averaged[10:], np.full(10, averaged[-1]))
    assert record.y is not None
    reached = one.reference - motion - (record.y - one.reference)
    reached -= np.mean(reached[one.known :])
    assert float(np.max(np.abs(one.errors[tracking.WHOLE] - reached)[one.known : -60])) < 1e-3 * float(np.ptp(reached))


def test_the_page_of_a_model_without_effects_shows_it_once() -> None:
    found = hystgen.track(Model(parse_parameters(TEXT.partition("  effects")[0])), [recorded()])
    assert found.page is not None
    page = found.page()
    assert "plays alone" not in json.loads(html.unescape(re.findall(r'data-viewer="([^"]*)"', page)[0]))["models"]
    labels = [line.get_label() for axes in found.plot().axes for line in axes.get_lines()]
    assert [text for text in labels if text.startswith("plays alone")] == []
    assert sum(text.startswith("whole model") for text in labels) == 1


def test_tracking_needs_the_motion() -> None:
    record = recorded()
    with pytest.raises(ValueError, match="a column y in every record"):
        tracking.track(Model(parse_parameters(TEXT)), [Record("v.csv", record.t, record.v)])
