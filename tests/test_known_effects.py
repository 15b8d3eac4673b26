"""`hystgen diagnose --with`: effects that the user knows to be there, where they are there and where they are not."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from plain_stage import MODEL, NOISE, STEP, record_text

import hystgen
from hystgen.parameters.files import load_parameters

Call = Callable[..., tuple[int, str, str]]

@pytest.fixture
def recorded(tmp_path: Path) -> Callable[[float, float], list[Path]]:
    """Writes the model and two records of a stage with so much creep and such a lag."""
    (tmp_path / "stage_x.yaml").write_text(MODEL)

    def make(creep: float, lag: float) -> list[Path]:
        paths = []
        for seed in (1, 2):
            paths.append(tmp_path / f"record_{seed}.csv")
            paths[-1].write_text(record_text(seed, creep, lag))
        return paths

    return make


def test_where_they_are_there(recorded: Callable[..., list[Path]], tmp_path: Path, run: Call) -> None:
    to_fit, held = recorded(0.02, 0.02)
    given = ("--holdout", held, "--history", "0", "--with", "lag,creep", "-o", tmp_path / "out")
    code, out, err = run("diagnose", tmp_path / "stage_x.yaml", to_fit, *given)
    assert code == 0, err
    content = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert content["verdict"] == "effects_found"
    assert [each["name"] for each in content["effects"]] == ["lag", "creep"], "in the user's order, and none besides"
    gap = content["gap"]
    for each in content["effects"]:
        assert each["known"]
        assert each["unsupported"] is None
        assert each["p_value"] < 0.05
        assert f"You named {each['name']}, and the records support it" in out
        share = (each["holdout_before"] - each["holdout_after"]) / gap["refitted"]["holdout"]
        assert each["share_of_gap"] == pytest.approx(share, rel=1e-6)
    lag, creep = content["effects"]
    assert lag["holdout_before"] == pytest.approx(gap["refitted"]["holdout"], rel=1e-6)
    assert creep["holdout_before"] == pytest.approx(lag["holdout_after"], rel=1e-6)
    assert creep["holdout_after"] == pytest.approx(gap["after"]["holdout"], rel=1e-6)
    assert lag["parameters"]["time_constant"] == pytest.approx(0.02, rel=0.05)
    assert gap["after"]["holdout"] < 2.0 * NOISE < 0.1 * gap["refitted"]["holdout"]
    page = (tmp_path / "out" / "report.html").read_text()
    assert page.count("you; the records support it") == 2
    written = load_parameters(tmp_path / "out" / "params.yaml")
    assert {each.name for each in written.model.effects} == {"lag", "creep"}


def test_where_they_are_not(recorded: Callable[..., list[Path]], tmp_path: Path) -> None:
    """The effects are written as asked, hardly there, and the judgement says that the records do not support them."""
    to_fit, held = recorded(0.0, 0.0)
    found = hystgen.diagnose(
        tmp_path / "stage_x.yaml", to_fit, holdout=held, history=[0.0], known=["creep", "lag", "asymmetry"]
    )
    assert found.verdict == "nothing_missing"
    assert repr(found) == "<Diagnosis stage_x: nothing_missing>"
    assert [each.name for each in found.result.effects] == ["creep", "lag", "asymmetry"]
    for each in found.result.effects:
        assert each.known
        assert each.unsupported is not None
        assert "it removes too little" in each.unsupported
        assert abs(each.share_of_gap) < 0.1
        assert f"You named {each.name}, so it is written, but the records do not support it" in found.sentence()
    assert "Nothing else is missing" in found.sentence()
    assert {each.name for each in found.parameters.model.effects} == {"creep", "lag"}
    assert found.parameters.model.memoryless
    assert found.result.gap.after.holdout < 1.1 * NOISE
    entry = found.content["effects"][1]  # type: ignore[index]
    assert entry["parameters"]["time_constant"] < 0.1 * STEP


def test_the_search_goes_on_from_them(recorded: Callable[..., list[Path]], tmp_path: Path) -> None:
    to_fit, held = recorded(0.02, 0.02)
    found = hystgen.diagnose(tmp_path / "stage_x.yaml", to_fit, holdout=held, history=[0.0], known=["creep"])
    assert [(each.name, each.known) for each in found.result.effects] == [("creep", True), ("lag", False)]
    assert all(each.unsupported is None for each in found.result.effects)
    assert found.result.effects[1].holdout_before == found.result.effects[0].holdout_after
    assert found.result.gap.after.holdout < 2.0 * NOISE


@pytest.mark.parametrize(
    ("names", "said"),
    [
        ("crep,lag", 'there is no effect "crep" (did you mean creep?); the effects are creep, rate_dependence, '),
        ("", 'there is no effect ""; the effects are creep, '),
        ("lag,lag", "lag is named twice"),
        ("thermal", "thermal cannot be fitted: not every record has a column temperature; "),
    ],
)
def test_names_that_cannot_be_fitted(
    names: str, said: str, recorded: Callable[..., list[Path]], tmp_path: Path, run: Call
) -> None:
    to_fit, held = recorded(0.0, 0.0)
    out = tmp_path / "out"
    code, said_out, err = run(
        "diagnose", tmp_path / "stage_x.yaml", to_fit, "--holdout", held, "--history", "0", "--with", names, "-o", out
    )
    assert (code, said_out) == (2, "")
    messages = err.splitlines()
    assert len(messages) == 1
    assert messages[0].startswith(f"error: {said}")
    assert not out.exists()


def test_an_effect_that_the_model_has(recorded: Callable[..., list[Path]], tmp_path: Path) -> None:
    to_fit, held = recorded(0.0, 0.0)
    model = MODEL.replace("0.01]}}", "0.01]}, effects: [{name: lag, time_constant: 0.05}]}")
    (tmp_path / "stage_x.yaml").write_text(model)
    with pytest.raises(ValueError, match="the model already has lag, which a diagnosis refits and keeps"):
        hystgen.diagnose(tmp_path / "stage_x.yaml", to_fit, holdout=held, known=["lag"])
    with pytest.raises(TypeError, match="known must be a list of names"):
        hystgen.diagnose(tmp_path / "stage_x.yaml", to_fit, holdout=held, known="lag")


def test_with_is_for_records(tmp_path: Path, run: Call) -> None:
    (tmp_path / "stage_x.yaml").write_text(MODEL)
    code, _, err = run("diagnose", "--plan", tmp_path / "stage_x.yaml", "--with", "creep", "-o", tmp_path / "plan")
    assert code == 2
    assert "leave out --with" in err
