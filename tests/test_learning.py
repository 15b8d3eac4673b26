"""Learning from a repeated scan: a blind stage behind a model's inverse, the condition for convergence, refusals."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

import hystgen
from benchmarks import learning as blind
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters
from hystgen.records import RecordError
from hystgen.service import learning
from hystgen.service.learning import Pass, learning_filter

T = np.arange(400) * 1e-3
WANTED = 5.0 - 4.0 * np.cos(2 * np.pi * 5.0 * T) - 0.3 * np.cos(2 * np.pi * 15.0 * T)
TEXT = """\
hystgen: 1
name: m
units: {input: V, output: um}
input_range: [0.0, 100.0]
model:
  pi:
    thresholds: [0, 10]
    weights: [0.1, 0.02]
"""


def model() -> Model:
    return Model(parse_parameters(TEXT))


def repetitions(plant: Callable[[Any], Any], given: Any = WANTED, noise: float = 1e-3, count: int = 3) -> list[Any]:
    """Records of a plant from reference to displacement."""
    rng = np.random.default_rng(5)
    return [
        {"t": T, "u": given, "v": 8.0 * given, "y": plant(given) + noise * rng.normal(size=len(T))}
        for _ in range(count)
    ]


def shifted(x: Any, seconds: float) -> Any:
    """A periodic signal later, by its spectrum."""
    turn = np.exp(-2j * np.pi * np.fft.rfftfreq(len(x), 1e-3) * seconds)
    return np.fft.irfft(np.fft.rfft(x) * turn, len(x))


def test_a_gain_and_a_delay_are_learned_in_one_pass() -> None:
    """The plant is 0.9 and 2 ms: the corrected reference is the wanted one over 0.9, 2 ms earlier, within the noise of
    three repetitions: each of 400 samples gets what is learned of the noise, 1e-3/sqrt(3) rms at most."""
    found = hystgen.refine(model(), repetitions(lambda u: 0.9 * shifted(u, 2e-3)), refit=False)
    assert found.report.verdict == "reference_corrected"
    assert found.reference is not None
    moved = found.reference - found.reference.mean()
    exact = shifted(WANTED - WANTED.mean(), -2e-3) / 0.9
    assert np.std(moved - exact) < 2e-3
    assert found.report.correction is not None
    assert found.report.correction.gain == pytest.approx(0.9, abs=1e-3)
    assert found.report.correction.delay == pytest.approx(2e-3, abs=1e-5)
    assert found.report.correction.gamma < 0.05


def test_only_noise_is_left_alone() -> None:
    found = hystgen.refine(model(), repetitions(lambda u: u), refit=False)
    assert found.report.verdict == "at_noise_floor"
    assert found.report.stop
    assert found.report.passes[-1].noise == pytest.approx(1e-3, rel=0.1)
    with pytest.raises(ValueError, match="no correction to write"):
        found.correction_text()


def test_the_stated_gamma_bounds_a_plant_within_the_stated_uncertainty() -> None:
    """|1 - L P| by brute force for the plant that made the records, over 40 of them: the bound counts two standard
    deviations of P, so it holds for 95 %; 5 of 40 beyond it have a probability of 5 %."""
    rng, beyond = np.random.default_rng(2), 0
    for _ in range(40):
        measured = np.array([0.8 * shifted(WANTED, 4e-3) + 0.02 * rng.normal(size=len(T)) for _ in range(4)])
        found = learning_filter(1e-3, [Pass(("a",) * 4, WANTED, measured)], WANTED)
        assert found is not None
        plant = 0.8 * np.exp(-2j * np.pi * found.frequency * 4e-3)
        lines = [k for k in (2, 6) if found.frequency[k] <= found.band]
        assert lines
        beyond += max(abs(1.0 - found.response[k] * plant[k]) for k in lines) > found.gamma
    assert beyond <= 5


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow), pytest.param(5, marks=pytest.mark.slow)])
def test_the_error_of_a_blind_stage_falls_and_never_rises_by_more_than_noise(seed: int) -> None:
    """`benchmarks.relays` shares nothing with the package; `benchmarks.learning` does this for 12 stages. A quarter of
    the error or less is left, and a pass is worse by two standard deviations of the difference of two means at most."""
    one = blind.stage(seed)
    found = list(blind.passes(one, blind.identified(one), 3))
    low, noise = blind.below(found, 40.0), found[-1].report.passes[-1].floor
    assert all(after <= before + 2.0 * noise * 2**0.5 for before, after in itertools.pairwise(low))
    assert low[-1] < 0.25 * low[0]
    assert all(after < before for before, after in itertools.pairwise(low[:3]))


def test_a_model_that_helps_comes_first(tmp_path: Path, run: Callable[..., tuple[int, str, str]]) -> None:
    """A stage that is a play sum with other weights than the file's; held out, the refit leaves its noise."""
    stage = hystgen.PI([0.0, 10.0], [0.11, 0.03])
    rng = np.random.default_rng(1)
    v = 50.0 - 45.0 * np.cos(2 * np.pi * 5.0 * T) + 4.0 * np.sin(2 * np.pi * 40.0 * T)
    files = []
    for k in range(3):
        y = stage.simulate(np.tile(v, 2))[len(v) :] + 2e-3 * rng.normal(size=len(v))
        files.append(tmp_path / f"pass_{k}.csv")
        rows = np.column_stack([T, model().simulate(v), v, y])
        files[-1].write_text("t,u,v,y\n" + "\n".join(",".join(f"{x:.9g}" for x in row) for row in rows))
    (tmp_path / "m.yaml").write_text(TEXT)
    new, out, report = tmp_path / "new.yaml", tmp_path / "next.csv", tmp_path / "refine.json"
    code, said, _ = run("refine", tmp_path / "m.yaml", *files, "-o", new, "--correction", out, "--json", report)
    assert code == 0, said
    assert "improved" in said
    assert new.exists()
    assert not out.exists()
    assert json.loads(report.read_text())["verdict"] == "model_improved"
    assert hystgen.load(new).parameters.model.pi.weights[0] == pytest.approx(0.11, rel=0.02)
    code, said, _ = run("refine", tmp_path / "m.yaml", *files, "--correction", out, "--json", report)
    assert code == 0, said
    assert json.loads(report.read_text())["verdict"] == "reference_corrected"
    assert out.read_text().startswith("t,u\n")


@pytest.mark.parametrize(("change", "words"), [
    (lambda r: r.pop("u"), "the reference that the compensator was given, is missing"),
    (lambda r: r.pop("y"), "no column \"y\""),
    (lambda r: r.update({key: r[key][:-20] for key in "tuvy"}), "cut them alike"),
    (lambda r: r.update(u=r["u"] * 1.1), "--reference"),
    (lambda r: r.update(t=2.0 * r["t"]), "resample it"),
])
def test_records_that_do_not_fit_are_refused(change: Callable[[Any], Any], words: str) -> None:
    records = repetitions(lambda u: u)
    change(records[1])
    with pytest.raises((RecordError, ValueError), match=words):
        hystgen.refine(model(), records, refit=False)


def test_a_single_repetition_is_refused() -> None:
    with pytest.raises(RecordError, match="at least twice"):
        hystgen.refine(model(), repetitions(lambda u: u, count=1), refit=False)


def test_the_json_follows_its_schema() -> None:
    found = hystgen.refine(model(), repetitions(lambda u: 0.9 * u), refit=False)
    jsonschema.validate(json.loads(found.to_json()), learning.schema())
