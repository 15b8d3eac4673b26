"""What each compensator would leave on a recorded actuator."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from hystgen import tracking
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
    """Stops instead of plays, and springs with dampers stepped ten times per sample: none of the package's code."""
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
    assert "whole model" in table


def test_track_prints_a_table_and_draws(tmp_path: Path, run: Callable[..., tuple[int, str, str]]) -> None:
    record = recorded()
    assert record.y is not None
    rows = np.column_stack([record.t, record.v, record.y])
    np.savetxt(tmp_path / "crept.csv", rows, delimiter=",", header="t,v,y", comments="")
    (tmp_path / "crept.yaml").write_text(TEXT)
    code, out, err = run("track", tmp_path / "crept.yaml", tmp_path / "crept.csv", "--plot", tmp_path / "t.svg")
    assert code == 0, err
    assert out.splitlines()[-1] == str(tmp_path / "t.svg")
    assert "straight line" in out
    assert (tmp_path / "t.svg").stat().st_size > 1000
    assert "late" not in err
    (tmp_path / "late.yaml").write_text(TEXT + "emit: {compensation: {corner: 21, preview: 10}}\n")
    code, _, err = run("track", tmp_path / "late.yaml", tmp_path / "crept.csv")
    assert "the motion of the whole model is 20 samples late, which counts as error" in err
    np.savetxt(tmp_path / "v.csv", rows[:, :2], delimiter=",", header="t,v", comments="")
    code, out, err = run("track", tmp_path / "crept.yaml", tmp_path / "v.csv")
    assert (code, out) == (2, "")
    assert "y" in err


def test_what_rounds_corners_or_makes_late_counts_as_error() -> None:
    """Creep is taken back exactly, so that the motion is the reference as it was averaged and delayed."""
    record = recorded(0.0)
    model = Model(parse_parameters(TEXT + "emit: {compensation: {corner: 21, preview: 10}}\n"))
    (one,) = tracking.track(model, [record]).records
    mean = np.full(21, 1.0 / 21)
    averaged = one.reference
    for _ in range(3):  # of the last 21 samples each: 30 samples late, of which 10 are known ahead
        averaged = np.convolve(np.pad(averaged, 20, mode="edge"), mean)[20:-40]
    motion = np.append(averaged[10:], np.full(10, averaged[-1]))
    assert record.y is not None
    reached = motion - one.reference + record.y - one.reference
    reached -= np.mean(reached[one.known :])
    assert float(np.max(np.abs(one.errors[tracking.WHOLE] - reached)[one.known : -60])) < 1e-3 * float(np.ptp(reached))


def test_tracking_needs_the_motion() -> None:
    record = recorded()
    with pytest.raises(ValueError, match="a column y in every record"):
        tracking.track(Model(parse_parameters(TEXT)), [Record("v.csv", record.t, record.v)])
