"""`hystgen compare`: models side by side on records of a stage in plain loops, and what is said of their order."""

from __future__ import annotations

import html
import json
import math
import random
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from plain_stage import MODEL, NOISE, record_text

import hystgen
from hystgen.comparison import Comparison, Deviation

Call = Callable[..., tuple[int, str, str]]

CREEP = MODEL.replace(
    "0.01]}}", "0.01]}, effects: [{name: creep, time_constants: [0.4, 1.2, 3.6, 10.8], weights: [0.02, 0.02, 0.02, "
    "0.02]}]}",
)
WIDER = MODEL.replace("0.02, 0.015", "0.021, 0.015")


def plays(v: list[float]) -> list[float]:
    """The plays of `MODEL` from virgin stops."""
    p, r = (0.10, 0.02, 0.015, 0.01), (0.0, 5.0, 12.0, 25.0)
    states, y = [0.0] * 4, []
    for each in v:
        states = [min(max(s, each - a), each + a) for s, a in zip(states, r, strict=True)]
        y.append(sum(a * b for a, b in zip(p, states, strict=True)))
    return y


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, text in {"plain": MODEL, "creep": CREEP, "wider": WIDER}.items():
        (tmp_path / f"{name}.yaml").write_text(text)
    (tmp_path / "one.csv").write_text(record_text(1, 0.02))
    (tmp_path / "two.csv").write_text(record_text(2, 0.02))
    return tmp_path


def test_the_table_of_a_stage_that_creeps(folder: Path, run: Call) -> None:
    models = [folder / "plain.yaml", folder / "creep.yaml"]
    given = ("--history", "0", "-o", folder / "out", "--json", folder / "c.json", "--plot", folder / "c.png")
    code, out, err = run("compare", *models, "--holdout", folder / "one.csv", folder / "two.csv", *given)
    assert code == 0, err
    files = [folder / "out" / name for name in ("comparison.json", "report.html", "deviations.svg")]
    assert out.splitlines()[-5:] == [str(folder / "c.json"), str(folder / "c.png"), *map(str, files)]
    found = json.loads((folder / "c.json").read_text())
    assert found == json.loads(files[0].read_text())
    assert found["records"] == ["one.csv", "two.csv"], "a shell's expansion of a pattern is held out too"
    creep, plain = found["models"]
    assert (creep["name"], plain["name"]) == (str(models[1]), str(models[0])), "the closest first"
    assert found["closest"] == [str(models[1])]
    squares, centred = [], []
    for name in found["records"]:
        _, v, y = np.loadtxt(folder / name, delimiter=",", skiprows=1).T
        error = y - plays(v.tolist())
        squares += ((error - error.mean()) ** 2).tolist()
        centred.append((v - v.mean(), y - y.mean()))
        assert plain["records"][name] == pytest.approx(error.std(), rel=1e-4)
    assert plain["rms"] == pytest.approx(math.sqrt(np.mean(squares)), rel=1e-4)
    assert plain["max"] == pytest.approx(math.sqrt(max(squares)), rel=1e-4)
    slope = sum(v @ y for v, y in centred) / sum(v @ v for v, _ in centred)
    line = np.concatenate([y - slope * v for v, y in centred])
    assert found["straight_line"]["rms"] == pytest.approx(line.std(), rel=1e-4)
    assert creep["rms"] == pytest.approx(NOISE, rel=0.1)
    assert creep["times_noise"] == pytest.approx(creep["rms"] / found["noise_floor"], rel=1e-6)
    rows = [line.split("  ")[0] for line in out.splitlines()]
    assert rows[1:4] == ["straight line", str(models[1]), str(models[0])]
    assert f"{models[1]} is the closest: {creep['rms']:.4g} um rms" in out
    assert " % of the output range, no more than noise; " in out
    page = html.unescape(files[1].read_text())
    assert page.count("<svg") + page.count("image/svg+xml") >= 2
    assert found["sentence"] in page
    assert page.partition('<tr class="marked">')[2].split("</td>")[0].endswith(str(models[1])), "the closest is marked"
    assert creep["cost"]["flash"] > plain["cost"]["flash"] > 0


def deviation(name: str, scale: float, seed: int, shared: float = 0.0) -> Deviation:
    """White deviations, partly the same for all seeds."""
    own, same = np.random.default_rng(seed), np.random.default_rng(0)
    values = scale * (math.sqrt(1.0 - shared) * own.normal(size=4000) + math.sqrt(shared) * same.normal(size=4000))
    return Deviation(name, (), (values,))


def told(models: list[Deviation], noise: float = 1e-3, line: float = 1.0) -> Comparison:
    ordered = tuple(sorted(models, key=lambda each: each.rms))
    return Comparison("um", (), deviation("straight line", line, 9), ordered, noise, 10.0)


def test_the_order_is_said_with_what_the_records_can_tell() -> None:
    apart = told([deviation("a", 0.02, 1), deviation("b", 0.03, 2), deviation("c", 0.3, 3)])
    assert apart.tied == ()
    assert apart.sentence().startswith("a is the closest: 0.02")
    assert "b, the next, leaves 1.5" in apart.sentence()
    one = deviation("a", 0.02, 1)
    same = told([one, replace(one, name="b"), deviation("c", 0.3, 3)])
    assert same.sentence() == (
        "a and b cannot be told apart on these records: their rms deviations differ by less than 0.5 %. "
        "They are closer than c."
    )
    noisy = told([deviation("a", 1.00e-3, 1), deviation("b", 1.05e-3, 2)])
    assert noisy.sentence() == (
        "a and b cannot be told apart on these records: the difference is within the noise. They leave no more than "
        "noise."
    )
    rng = random.Random(5)
    slow = [np.repeat([rng.gauss(0.0, s) for _ in range(20)], 200) for s in (0.02, 0.024)]
    chance = told([Deviation(name, (), (values,)) for name, values in zip("ab", slow, strict=True)])
    assert chance.models[1].rms > 1.005 * chance.models[0].rms
    assert "cannot be told apart on these records: the difference may be chance, p = 0." in chance.sentence()
    useless = told([deviation("a", 2.0, 1)])
    assert useless.sentence() == (
        f"a leaves {useless.models[0].rms:.4g} um rms, {10.0 * useless.models[0].rms:.3g} % of the output range. "
        "No model is closer than a straight line."
    )


def test_other_units_of_the_same_quantity(folder: Path) -> None:
    nano = MODEL.replace("output: um", "output: nm").replace("[0.10, 0.02, 0.015, 0.01]", "[100, 20, 15, 10]")
    (folder / "nano.yaml").write_text(nano)
    models = [folder / "plain.yaml", folder / "nano.yaml"]
    found = hystgen.compare(models, folder / "one.csv", history=[0.0])
    assert found.unit == "um"
    assert found.models[0].rms == pytest.approx(found.models[1].rms, rel=1e-9)
    assert found.models[0].name in found.sentence()
    assert "cannot be told apart" in found.sentence()
    assert "<table>" in found._repr_html_()
    (folder / "nano.csv").write_text(record_text(1, 0.02, header="t,v [V],y [nm]"))
    scaled = hystgen.compare(models, folder / "nano.csv", history=[0.0])
    assert scaled.output_range == pytest.approx(1e-3 * found.output_range, rel=1e-6)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("plain.yaml", "volts.yaml", "--holdout", "one.csv"), "volts.yaml has its output in V and "),
        (("plain.yaml", "warm.yaml", "--holdout", "one.csv"), "warm.yaml: the effect thermal needs the column temp"),
        (("plain.yaml", "gone.yaml", "--holdout", "one.csv"), "gone.yaml: error: cannot be read"),
        (("plain.yaml", "--holdout", "gone.csv"), "gone.csv: error: cannot be read"),
        (("plain.yaml", "--holdout", "one.csv", "--json", "one.csv"), "one.csv is an input and would be overwritten"),
        (("plain.yaml", "--holdout", "one.csv", "--plot", "x.pdf"), "a plot is a .png or .svg file"),
        (("plain.yaml",), "Missing option '--holdout'"),
        (("--holdout", "one.csv"), "Missing argument 'PARAMS...'"),
    ],
)
def test_wrong_inputs(given: tuple[str, ...], said: str, folder: Path, run: Call) -> None:
    (folder / "volts.yaml").write_text(MODEL.replace("output: um", "output: V"))
    (folder / "warm.yaml").write_text(MODEL.replace("0.01]}}", "0.01]}, effects: [{name: thermal, source: logged, "
                                                    "gain_per_degree: 0.001, offset_per_degree: 0.0, reference: 20}]}"))
    there = sorted(path.name for path in folder.iterdir())
    words = [word if word.startswith("-") else str(folder / word) for word in given]
    code, out, err = run("compare", *words)
    assert (code, out) == (2, "")
    assert said in err
    assert "Traceback" not in err
    assert sorted(path.name for path in folder.iterdir()) == there


def test_names_and_sources(folder: Path) -> None:
    model = hystgen.load(folder / "plain.yaml")
    found = hystgen.compare([model, hystgen.load(folder / "wider.yaml")], folder / "one.csv", history=[0.0])
    assert sorted(each.name for each in found.models) == ["stage_x (1)", "stage_x (2)"]
    alone = hystgen.compare(model, folder / "one.csv", history=[0.0], names=["mine"])
    assert alone.sentence().startswith("mine leaves ")
    with pytest.raises(ValueError, match="1 model need as many names, not 2"):
        hystgen.compare(model, folder / "one.csv", names=["a", "b"])
    with pytest.raises(ValueError, match="there is no model to compare"):
        hystgen.compare([], folder / "one.csv")
