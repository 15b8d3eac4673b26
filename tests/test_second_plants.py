"""The second simulator of plants, and the diagnosis of a few of its plants."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import hystgen
from benchmarks import second_plants
from benchmarks.second_plants import EFFECTS, FOREIGN, Plant, Session, Stage, filtered

Array = NDArray[np.float64]


def relays(v: Array, density: float) -> Array:
    """Equally dense relays over the whole triangle: an Everett function of d^2 by brute force."""
    places = (np.arange(100) + 0.5) / 100
    up, down = np.meshgrid(places, places, indexing="ij")
    there = up >= down
    state, out = np.zeros_like(up), np.empty(len(v))
    for k, x in enumerate(v.tolist()):
        state[up <= x] = 1.0
        state[down >= x] = 0.0
        out[k] = np.sum(state[there])
    return np.asarray(density * out / 100**2)


def test_the_stack_of_extremes_is_a_preisach_model() -> None:
    turns = np.array([0.0, 0.9, 0.3, 0.7, 0.4, 0.6, 0.1, 1.0, 0.5])
    v = np.interp(np.arange(800) / 100, np.arange(9), turns)
    _, rest = Stage(0.0, 0.5, 0.0, 0.0).moved(v)
    assert rest - rest[0] == pytest.approx(relays(v, 1.0) - relays(v, 1.0)[0], abs=0.012)


def test_a_mode_and_a_lag_answer_a_step_as_known() -> None:
    """The step happens halfway between two times, where its mean over a sample puts it."""
    t = np.arange(400) * 1e-3
    x = np.where(t > 0.0, 1.0, 0.0)
    since = t[1:] - 0.5e-3
    assert filtered(t, x, 0.02)[1:] == pytest.approx(1.0 - np.exp(-since / 0.02), abs=1e-9)
    rings = second_plants._mode(t, x, 20.0, 0.05)
    root = math.sqrt(1.0 - 0.05**2)
    phase, decay = 2.0 * np.pi * 20.0 * root * since, np.exp(-0.05 * 2.0 * np.pi * 20.0 * since)
    expected = 1.0 - decay * (np.cos(phase) + 0.05 / root * np.sin(phase))
    assert rings[1:] == pytest.approx(expected, abs=1e-9)
    limited, made = Plant([], [], []), Session(t, x, (), (), (), 400, 1e-3)
    second_plants.slew_limit(np.random.default_rng(0), made, 0.05, limited)
    assert limited.drive[0](made, x)[1:] == pytest.approx(np.minimum(since * 50.0, 1.0))
    within = np.sin(49.0 * t)  # as fast as the limit allows
    assert limited.drive[0](made, within) == pytest.approx(within, abs=1e-12)


def test_a_sine_passes_a_mode_and_a_lag_without_being_early() -> None:
    """With four times per sample and 16 samples per period of a fast record, the phase is right to 0.1 degrees."""
    t = np.arange(64 * 400) / 64.0
    x, last = np.exp(2j * np.pi * t), slice(64 * 300, None)
    for found, gain in (
        (filtered(t, x.real, 0.05), 1.0 / (1.0 + 0.05 * 2j * np.pi)),
        (second_plants._mode(t, x.real, 2.0, 0.05), 1.0 / (1.0 - 0.25 + 2j * 0.05 * 0.5)),
    ):
        passed = np.mean(found[last] * x[last].conj()) * 2.0
        assert np.angle(passed / gain, deg=True) == pytest.approx(0.0, abs=0.1)
        assert abs(passed / gain) == pytest.approx(1.0, abs=0.005)


@pytest.mark.thorough
@pytest.mark.parametrize("kind", ["single", "foreign"])
def test_a_case_is_the_same_every_time(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Files and label have the same bytes each time, and the label names the effect or disturbance."""
    monkeypatch.setattr(second_plants, "session", _short)
    for folder in ("a", "b"):
        assert second_plants.case(kind, 2, tmp_path / folder) == f"{kind}_00002"
    files = sorted(path.relative_to(tmp_path / "a") for path in (tmp_path / "a").rglob("*.*"))
    assert len(files) == 11 + 3
    assert all((tmp_path / "a" / path).read_bytes() == (tmp_path / "b" / path).read_bytes() for path in files)
    label = json.loads((tmp_path / "a" / "labels" / f"{kind}_00002.json").read_text())
    if kind == "single":
        assert [each["name"] for each in label["effects"]] == [list(EFFECTS)[2]]
    else:
        assert label["foreign"]["name"] == list(FOREIGN)[2]


_whole = second_plants.session


def _short(rng: np.random.Generator, slow: bool) -> Session:
    made = _whole(rng, slow)
    return made if made.samples == 450 else _short(rng, slow)


@pytest.mark.thorough
@pytest.mark.slow(one_in=4)
@pytest.mark.parametrize(
    ("kind", "seed", "names"),
    [
        ("foreign", 6, []),  # room temperature on the gain, once named thermal
        ("foreign", 8, []),  # a slow line of crosstalk, once named saturation and creep
        ("single", 1, ["rate_dependence"]),
        ("pair", 1, ["ageing", "lag"]),  # once named rate dependence and ageing
    ],
)
def test_what_was_named_wrongly(kind: str, seed: int, names: list[str], tmp_path: Path) -> None:
    content = diagnosed(kind, seed, tmp_path)
    assert sorted(each["name"] for each in content["effects"]) == names
    if not names:
        assert content["verdict"] == "unexplained"
        assert all(each["refused"] for ranked in content["ranking"] for each in ranked)


def diagnosed(kind: str, seed: int, folder: Path) -> dict[str, Any]:
    home = folder / "cases" / second_plants.case(kind, seed, folder)
    spec = json.loads((home / "session.json").read_text())
    to_fit, held = ([home / name for name in spec[key]] for key in ("fit", "holdout"))
    return dict(hystgen.diagnose(home / "params.yaml", to_fit, holdout=held).content)
