"""Diagnosis of plants from `benchmarks/plants`, which share nothing with the package, and of measured records."""

from __future__ import annotations

import ast
import dataclasses
import html
import json
import math
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar, Literal

import numpy as np
import pytest
from made_up import STRUCTURE, result
from numpy.typing import NDArray
from recordings import brute_output, noisy, part_of_file, record, wander, write_csv
from scipy.signal import lfilter

import hystgen
from benchmarks.plants import run as plants_run
from benchmarks.plants.__main__ import main as plants
from hystgen.basics import parallel
from hystgen.diagnosis import Diagnosis
from hystgen.diagnosis.data import items, preparing
from hystgen.diagnosis.data.items import Item, rms
from hystgen.diagnosis.data.preparing import set_aside
from hystgen.diagnosis.data.signals import noise_floor
from hystgen.diagnosis.findings import content
from hystgen.diagnosis.findings.content import ONE_LOOP
from hystgen.diagnosis.findings.kinds import Line
from hystgen.diagnosis.findings.result import AtEnd, Contender, FitErrors, Gap, Result
from hystgen.diagnosis.run import _extended, _no_worse_than_identified
from hystgen.diagnosis.search import acceptance, fits, hypothesis, ranges, screening, selection
from hystgen.diagnosis.search.fits import Fitted
from hystgen.diagnosis.search.hypothesis import Actuator
from hystgen.effects.ageing.model import ExponentialAgeing
from hystgen.effects.base import About, Candidate, Effect, Place, Run
from hystgen.effects.creep.model import ExponentialCreep
from hystgen.effects.drift.model import LinearDrift
from hystgen.effects.noncongruent.model import PlayFunctions
from hystgen.effects.rate_dependence.model import RelaxingPlays
from hystgen.effects.saturation.model import TanhSaturation
from hystgen.effects.sensor_nonlinearity.model import SensorCurve, SensorPolynomial
from hystgen.identification.joint import BentFront, DeadZones, Ends, Kept
from hystgen.records import Record, read_record
from hystgen.report import diagnosis as report

Array = NDArray[np.float64]
Call = Callable[..., tuple[int, str, str]]

SINGLES = 13 if os.environ.get("HYSTGEN_WHOLE") else 6
"""Number of seeds of the tuning block: one for each single effect of the catalogue, or six of them."""

NONE = 6


def made(folder: Path, kind: str, seeds: int, first: int = 0) -> list[tuple[Path, dict[str, Any]]]:
    """Cases of the tuning block with their labels."""
    assert not plants(["generate", "--block", "tune", "--kind", kind, "--seeds", f"{first}:{first + seeds}",
                       "--no-rivals", "-o", str(folder)])  # fmt: skip
    labels = sorted((folder / "labels").glob("*.json"))
    return [(folder / "cases" / path.stem, json.loads(path.read_text())) for path in labels]


def diagnosed(case: Path) -> dict[str, Any]:
    spec = json.loads((case / "session.json").read_text())
    found = hystgen.diagnose(
        case / "params.yaml",
        [case / name for name in spec["fit"]],
        holdout=[case / name for name in spec["holdout"]],
        history=spec["history"],
        rest=spec["rest"] or 0.0,
    )
    content: dict[str, Any] = found.content
    return content


class TestBlindPlants:
    @pytest.mark.thorough
    def test_single_effects(self, tmp_path: Path) -> None:
        """In a small sample, most effects are named, first and alone, and the gap shrinks."""
        right, alone, wrong = 0, 0, []
        for case, label in made(tmp_path, "single", SINGLES):
            content = diagnosed(case)
            names = [effect["name"] for effect in content["effects"]]
            (true,) = [effect["name"] for effect in label["effects"]]
            tied = [set(pair) for pair in content["not_separable"]]
            right += names[:1] == [true] or {names[0] if names else "", true} in tied
            alone += names == [true]
            wrong += [] if names[:1] == [true] else [(true, names)]
            if names == [true]:
                assert content["gap"]["after"]["holdout"] < 0.5 * content["gap"]["refitted"]["holdout"]
                (effect,) = content["effects"]
                before, after = effect["holdout_before"], effect["holdout_after"]
                share, gap = effect["share_of_gap"], content["gap"]["refitted"]["holdout"]
                half = 5e-8  # all four numbers have eight digits
                assert abs(share * gap - (before - after)) <= half * (2.0 * share * gap + before + after)
                assert after == content["gap"]["after"]["holdout"]
        assert right >= SINGLES - 1, wrong
        assert alone >= SINGLES - 1, wrong

    @pytest.mark.thorough
    @pytest.mark.slow(one_in=2)
    @pytest.mark.parametrize("seed", range(NONE))
    def test_nothing_is_named_where_nothing_is_missing(self, seed: int, tmp_path: Path) -> None:
        ((case, label),) = made(tmp_path, "none", 1, seed)
        content = diagnosed(case)
        assert content["effects"] == []
        assert content["gap"]["after"]["holdout"] <= 1.25 * label["noise"]["rms"]
        assert content["noise_floor"] == pytest.approx(label["noise"]["rms"], rel=0.45)

    @pytest.mark.parametrize("place", ["file/out", "taken"])
    def test_a_folder_that_cannot_be_written_is_found_before_the_search(
        self, tmp_path: Path, run: Call, monkeypatch: pytest.MonkeyPatch, place: str
    ) -> None:
        (case, _), *_ = made(tmp_path, "none", 1)
        (tmp_path / "file").touch()
        (tmp_path / "taken" / "report.html").mkdir(parents=True)
        monkeypatch.setattr("hystgen.report.diagnosis.diagnose", lambda *_, **__: pytest.fail("searched"))
        data = sorted(case.glob("r*.csv"))[:2]
        code, out, err = run("diagnose", case / "params.yaml", *data, "-o", tmp_path / place)
        assert (code, out) == (2, "")
        said = {"file/out": f"{tmp_path / 'file'}: Not a directory",
                "taken": f"{tmp_path / 'taken' / 'report.html'}: Is a directory"}  # fmt: skip
        assert said[place] in err

    def test_the_command(self, tmp_path: Path, run: Call, monkeypatch: pytest.MonkeyPatch) -> None:
        (case, _), *_ = made(tmp_path, "single", 1)
        spec = json.loads((case / "session.json").read_text())
        words = ["diagnose", case / "params.yaml", *(case / name for name in spec["fit"]), "-o", tmp_path / "out"]
        words += [word for name in spec["holdout"] for word in ("--holdout", case / name)]
        words += [f"--history={','.join(map(str, spec['history']))}"] if spec["history"] else []
        words += ["--rest", spec["rest"] or 0.0]
        code, out, err = run(*words)
        assert code == 0, err
        content = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
        names = ("diagnosis.json", "report.html", "params.yaml")
        assert out.splitlines()[1].startswith("Your next step: ")
        assert out.splitlines()[-3:] == [str(tmp_path / "out" / name) for name in names]
        again = hystgen.load(tmp_path / "out" / "params.yaml")
        names = [effect["name"] for effect in content["effects"]]
        assert [effect.name for effect in again.parameters.model.effects] == [
            name for name in names if name not in ("asymmetry", "saturation")
        ]
        shown = (tmp_path / "out" / "report.html").read_text()
        own = sum(f"<h2>{title}</h2>" in shown for title in ("Frequency response", "Creep"))
        assert shown.count("<img src=\"data:image/svg+xml;base64,") == 7 + own
        assert "://" not in shown
        assert all(name in shown for name in names)
        # The report's statement about C agrees with emit
        emitted = run("emit", tmp_path / "out" / "params.yaml", "-o", tmp_path / "fw", "--list-outputs")
        page = html.unescape(re.sub(r"\s+", " ", shown))
        reason = " ".join(emitted[2].split("error: ", 1)[-1].split())
        assert ("They cannot be emitted as C yet" in page) == (emitted[0] != 0) == (f"yet: {reason}." in page)
        assert ("Error of the motion with the compensator:" in page) == (emitted[0] == 0)
        assert (reason in " ".join(err.split())) == (emitted[0] != 0)
        assert page.count("Your next step: ") == 1
        assert ("Your next step: write the compensator as C." in page) == (emitted[0] == 0)
        # Every byte is the same with another number of processes: one, or three if there is one core
        first = [path.read_bytes() for path in sorted((tmp_path / "out").iterdir())]
        cores = parallel.cores()
        monkeypatch.setattr(parallel, "cores", lambda: 1 if cores > 1 else 3)
        assert run(*words)[0] == 0
        assert [path.read_bytes() for path in sorted((tmp_path / "out").iterdir())] == first


class TestSeveralProcesses:
    @pytest.fixture
    def case(self, tmp_path: Path) -> Path:
        (case, _), = made(tmp_path, "single", 1)
        return case

    @pytest.mark.parametrize(("forks", "fits"), [(1, 0), (2, 0), (2, 10)])
    @pytest.mark.thorough
    def test_an_interrupt_leaves_nothing(self, case: Path, forks: int, fits: int) -> None:
        program = (
            "import os, sys; from hystgen import cli; from hystgen.basics import parallel; "
            "from hystgen.basics.progress import Progress; tick = Progress.tick; "
            "Progress.tick = lambda bar, n: (print('fitted', flush=True), tick(bar, n)); "
            "parallel.cores = lambda: 2; "
            "os.register_at_fork(after_in_parent=lambda: print('forked', flush=True)); sys.exit(cli.main(sys.argv[1:]))"
        )
        with subprocess.Popen(
            [sys.executable, "-c", program, *plants_run.arguments(case)], cwd=case, stdout=subprocess.PIPE,
            stderr=subprocess.PIPE, text=True, start_new_session=True,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
            env={**os.environ, "PYTHONPATH": str(Path(hystgen.__file__).parents[1])},
        ) as began:  # fmt: skip
            assert began.stdout is not None
            for said, times in (("forked\n", forks), ("fitted\n", fits)):
                for _ in range(times):
                    assert said in iter(began.stdout.readline, "")
            os.killpg(began.pid, signal.SIGINT)
            _, said = began.communicate(timeout=30)
        assert (began.returncode, said) == (1, "\nAborted!\n")
        assert not (case / "out").exists()


@pytest.mark.data
def test_flexure_stage(measured: Path, tmp_path: Path) -> None:
    """With the sine fitted and the fades held out, the error is at most half a percent of the range and the amplifier's
    lag is named. The lag shows only together with a second effect: alone, creep explains more."""
    sine = part_of_file(measured / "p885_sine_1hz.csv", tmp_path / "sine.csv", 300)
    fades = part_of_file(measured / "p885_fades_and_hold.csv", tmp_path / "fades.csv", 300)
    hystgen.identify(sine).write(tmp_path / "stage.yaml")
    content = hystgen.diagnose(tmp_path / "stage.yaml", sine, holdout=fades).content
    assert content["verdict"] == "effects_found"
    assert content["effects"][0]["name"] == "lag"
    assert content["ranking"][0][0]["name"] == "creep"
    assert content["gap"]["refitted"]["holdout"] > 0.011 * content["output_range"]
    assert content["gap"]["after"]["holdout"] <= 0.005 * content["output_range"]


@pytest.mark.data
@pytest.mark.thorough
def test_flexure_stage_with_its_start(measured: Path, tmp_path: Path) -> None:
    """With the start-up transient in both records, a delay explains as much as the lag, so both are named."""
    sine = measured / "p885_sine_1hz.csv"
    hystgen.identify(sine).write(tmp_path / "stage.yaml")
    content = hystgen.diagnose(tmp_path / "stage.yaml", sine, holdout=measured / "p885_fades_and_hold.csv").content
    assert content["effects"][0]["name"] == "lag"
    assert ["lag", "delay"] in content["not_separable"]
    assert content["gap"]["after"]["holdout"] <= 0.005 * content["output_range"]


@pytest.mark.slow
@pytest.mark.data
def test_flexure_stage_with_more_records(measured: Path, tmp_path: Path) -> None:
    """The larger loops show a non-congruence that hardly shows at the end of the fades; it is still named."""
    sine = part_of_file(measured / "p885_sine_1hz.csv", tmp_path / "sine.csv", 300)
    fades = read_record(part_of_file(measured / "p885_fades_and_hold.csv", tmp_path / "fades.csv", 300))
    half = len(fades) // 2
    hystgen.identify(sine).write(tmp_path / "stage.yaml")
    found = hystgen.diagnose(
        tmp_path / "stage.yaml", [sine, fades.section(0, half)], holdout=fades.section(half, None, "end")
    )
    names = [each["name"] for each in found.content["effects"]]
    assert names[1:] == ["noncongruent"]
    assert "lag" in names or [names[0], "lag"] in found.content["not_separable"]
    assert found.content["gap"]["after"]["holdout"] <= 0.003 * found.content["output_range"]


def test_the_sentence_says_what_is_left_open(tmp_path: Path) -> None:
    """The sentence states which effects could be other ones, and an error far above the noise."""
    parameters = hystgen.load(_model(tmp_path)).parameters
    rivals = [("lag", "delay"), ("lag", "resonance")]
    said = "Missing: lag (or delay or resonance), creep. The held-out rms error falls from 0.5 um to 0.05 um"
    for unexplained, more in (([], "."), ([STRUCTURE], ", 2.5 times the noise and with structure.")):
        found = result("effects_found", ("lag", "creep"), 0.05, unexplained, rivals)
        assert Diagnosis(found, parameters, (), ()).sentence() == said + more


def figures_of(said: str) -> list[float]:
    """The numbers in a sentence."""
    return [float(each) for each in re.findall(r"-?\d+\.?\d*(?:e-?\d+)?", said)]


@pytest.mark.parametrize(("held", "fitted"), [(0.05, 0.03), (0.3, 0.04), (0.03, 0.45), (0.9, 0.9)])
@pytest.mark.parametrize("why", ["range", "most", "above"])
def test_what_is_said_of_withdrawn_effects_follows_from_their_figures(why: str, held: float, fitted: float) -> None:
    """For gaps of 50 and 40 times the noise of 0.02 um, remainders from 3 to 90 % are stated but not judged."""
    of_held, of_fitted = selection.Explained(1.0, held, 0.02), selection.Explained(0.8, fitted, 0.02)
    refused = selection.Refusal(why, *{"range": (0.31, 0.105), "most": (held, 1.0), "above": (held, 0.04)}[why])
    end = ranges.End(0, "creep", AtEnd("weights 2", 3.0, "largest", 3.0, 9.0, 1.25 * held, held, "no less"))
    model: Any = SimpleNamespace()
    withdrawn = selection.Withdrawal(("creep",), refused, of_held, of_fitted, (end,))
    outcome = selection.Outcome(model, model, (), (), withdrawn)
    told = content._withdrawn(outcome, "um")
    before = result("unexplained", (), 0.5, [STRUCTURE])
    ranked = ((Contender("creep", "creep", 0.1, 0.1, "refused"),),)
    said = Diagnosis(dataclasses.replace(before, ranking=ranked, withdrawn=told), None, (), ()).sentence()  # type: ignore[arg-type]
    assert "most would remain" not in said
    (sentence,) = re.findall(r"Creep would leave .*", said)
    shares = [round(100 * np.sqrt((x**2 - 0.02**2) / (gap**2 - 0.02**2))) for x, gap in ((held, 1.0), (fitted, 0.8))]
    reason = {"range": [31, 10], "most": [held, 1.0], "above": [held, 0.04]}[why]
    wider = [2.0, 3.0, 9.0, 1.25 * held, held]
    expected = [held, 1.0, shares[0], fitted, 0.8, shares[1], *reason, *wider]
    assert figures_of(sentence) == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize(
    ("leaves", "compared"),
    [(0.0686, "0.0686 um rms on held-out records, only 2 % less than 0.07 um"), (0.0735, "no less than 0.07 um")],
)
def test_a_wider_range_is_compared_with_the_one_kept(leaves: float, compared: str) -> None:
    """It may leave a little less than the range kept, or more."""
    end = AtEnd("weights 2", 4.0, "largest", 3.0, 9.0, leaves, 0.07, "no less")
    said = end.sentence("creep", "um")
    assert said.endswith(compared)
    assert f"a range up to 9 leaves {leaves} um rms on held-out records, " in said


@pytest.mark.parametrize(
    ("why", "words"),
    [
        ("beyond", "beyond its usual range, which ends at 3 and fits worse"),
        ("no less", "the largest value tried: a range up to 9 leaves 0.069 um rms"),
        ("limit", "the largest value tried: a wider range changes nothing"),
        ("firm", "the largest value tried: its range is not widened"),
        ("noise", "the largest value tried: only noise remains"),
    ],
)
def test_the_verdict_says_what_is_left_and_which_number_is_at_its_end(why: str, words: str) -> None:
    """Of 0.5 um, 0.07 um remain; the noise is 0.02 um. If no parameter of creep is at an end, two times are equal."""
    found = result("effects_found", ("creep",), 0.07, [])
    end = AtEnd("weights 2", 4.0, "largest", 3.0, 9.0 if why == "no less" else None, 0.069, 0.07, why)
    named = dataclasses.replace(found.effects[0], at_an_end=True, ends=(end,))
    said = Diagnosis(dataclasses.replace(found, effects=(named,)), None, (), ()).sentence()  # type: ignore[arg-type]
    assert said.startswith("An error of 0.07 um rms is not explained, 3.5 times the noise. Missing, in part: creep.")
    assert "falls by 86 %, from 0.5 um to 0.07 um" in said
    assert f"weights 2 of creep is 4, {words}" in said
    twice = dataclasses.replace(named, ends=())
    said = Diagnosis(dataclasses.replace(found, effects=(twice,)), None, (), ()).sentence()  # type: ignore[arg-type]
    assert "two time constants of creep are practically equal" in said
    assert "range" not in said


def test_no_worse_than_the_model_of_identify() -> None:
    """A dead-zone front bends both ways and the records have only one loop, so no effect is named. The nominal model's
    plain plays are far worse than the model that `identify` finds on the same records."""
    t = np.arange(800) * 1e-3
    records = []
    for seed in range(2):
        v = 50.0 - 50.0 * np.cos(2.0 * np.pi * 5.0 * t)
        w = v + 0.8 * np.maximum(v - 30.0, 0.0) - 1.2 * np.maximum(v - 70.0, 0.0)
        x = brute_output(w, (0.0, 5.0, 12.0), (0.1, 0.02, 0.02), 0.0)
        records.append(Record(f"r{seed}", t, v, noisy(x, 0.01, seed)))
    chosen = selection.as_given(hystgen.identify(records[:1], holdout=records[1:], model="auto").model.cascade, ())
    ready = preparing.prepare(records[:1], records[1:], None, 0.0)
    structure = hypothesis.Structure(ready.thresholds, Kept())
    plain = selection.refit(structure, ready.to_fit, np.empty(0))
    noise = noise_floor([*ready.to_fit, *ready.held]).rms
    searched = screening.Records.of(ready.to_fit, ready.held, plain, noise)
    outcome = selection.Outcome(plain, plain, (), ())
    with parallel.one_thread():
        best, (note,) = _no_worse_than_identified(outcome, searched, "um")
    assert best.written == "identified"
    assert best.refitted is plain
    left = searched.residual(best.fitted)
    assert left == pytest.approx(searched.residual(chosen), rel=0.005)
    assert left < 0.5 * searched.residual(plain)
    stated = figures_of(note.replace("--", ""))
    assert stated == pytest.approx([left, searched.residual(plain)], rel=1e-3)
    quiet = dataclasses.replace(searched, noise=searched.residual(plain))
    assert _no_worse_than_identified(outcome, quiet, "um") == (outcome, [])


@pytest.mark.parametrize(
    ("share", "structured", "begins"),
    [(0.1, True, "Something is missing"), (0.1, False, "The records are"), (0.9, True, "The records are")],
)
def test_the_sentence_is_about_what_is_most_of_the_error(
    tmp_path: Path, share: float, structured: bool, begins: str
) -> None:
    line = Line(frequency=50.0, amplitude=0.1, share=share, records=("r",))
    found = result("unexplained", (), 0.5, [line, *([STRUCTURE] if structured else [])])
    said = Diagnosis(found, hystgen.load(_model(tmp_path)).parameters, (), ()).sentence()
    assert said.startswith(begins)
    assert "a line at 50 Hz" in said


@pytest.mark.slow(one_in=2)
@pytest.mark.thorough(but_one_in=2)
@pytest.mark.parametrize(("bent", "names"), [(2e-4, 1), (2e-3, 0)])
def test_one_loop_supports_one_name(bent: float, names: int, tmp_path: Path) -> None:
    """With a lag and a bent sensor on a repeated sine, one effect is named, or none if the other causes so much error
    that the name may be wrong. The report says what to record."""
    t = np.arange(3000) * 1e-3
    v = 50.0 - 50.0 * np.cos(2 * np.pi * 4.0 * t)
    decay = np.exp(-1e-3 / 0.004)
    records = []
    for seed in range(3):
        w = lfilter([1.0 - decay], [1.0, -decay], v)
        x = brute_output(w, (0.0, 5.0, 12.0, 25.0), (0.1, 0.02, 0.02, 0.02), 0.0)
        noise = np.random.default_rng(seed).normal(0.0, 0.003, len(x))
        records.append(Record(f"r{seed}", t, v, x + bent * (x - 6.0) ** 2 + noise))
    found = hystgen.diagnose(_model(tmp_path), records[:2], holdout=records[2:])
    assert len(found.content["effects"]) == names
    assert ONE_LOOP in found.content["advice"]
    found.write(tmp_path / "out")
    assert ONE_LOOP.capitalize() in (tmp_path / "out" / "report.html").read_text()


def test_a_record_of_which_most_is_not_compared_is_told() -> None:
    """The record's drive first turns late, and not far enough to reveal a start memory."""
    v = np.concatenate([np.linspace(0.0, 100.0, 3000), np.linspace(100.0, 90.0, 300)])
    late = record(v, noisy(brute_output(v, (0.0, 10.0), (1.0, 0.5), 0.0), 0.01), "late")
    early = record(w := wander(3), noisy(brute_output(w, (0.0, 10.0), (1.0, 0.5), 0.0), 0.01), "early")
    ready = preparing.prepare([early, late], [early], None, 0.0)
    (said,) = ready.notes
    assert said.startswith(f"late: {np.count_nonzero(ready.to_fit[1].known)} of 3300 samples are compared")
    assert preparing.prepare([early, late], [early], (0.0,), 0.0).notes == []


@pytest.mark.slow
def test_start_memories_of_held_out_records_are_found_where_all_together_need_them() -> None:
    """A start memory found by a model without the effects contains part of them and would distort the comparison, so
    held-out records get one only if all together need it. A fit needs each of its records."""
    growing = 50.0 - np.linspace(10.0, 50.0, 2000) * np.cos(np.linspace(0.0, 10.0 * np.pi, 2000))
    steady = wander(3)

    def made(v: Array, name: str) -> Record:
        y = brute_output(v, (0.0, 10.0), (1.0, 0.5), 0.0)
        return record(v, noisy(40.0 * np.tanh((y - 60.0) / 40.0), 0.01), name)

    fitted = [made(wander(1), "fitted")]
    alone = preparing.prepare(fitted, [made(growing, "growing")], None, 0.0).held
    assert [item.turns is None for item in alone] == [False]
    assert alone[0].known.all()
    both = preparing.prepare(fitted, [made(growing, "growing"), made(steady, "steady")], None, 0.0).held
    assert [item.turns is None for item in both] == [True, True]
    assert np.argmax(both[0].known) >= 1900  # the largest drive is at its end
    fit = preparing.prepare([*fitted, made(growing, "growing")], [made(steady, "steady")], None, 0.0).to_fit
    assert [item.turns is None for item in fit] == [True, False]
    assert fit[1].known.all()


def test_a_start_is_wiped_by_what_the_plays_see() -> None:
    """The drive steps to the ends of the range, which the stage reaches six samples late; until then the output depends
    on drives before the record."""
    v = np.repeat([40.0, 100.0, 0.0, 70.0, 30.0], 40)
    seen = np.full(len(v), 40.0)
    for k in range(1, len(v)):
        seen[k] = seen[k - 1] + np.clip(v[k] - seen[k - 1], -16.0, 16.0)

    def output(before: float) -> Array:
        state, y = before, []
        for x in seen.tolist():
            state = min(max(state, x - 45.0), x + 45.0)
            y.append(x + 0.5 * state)
        return np.array(y)

    records = [record(v, output(40.0), name) for name in "ab"]
    (item,) = preparing.prepare(records[:1], records[1:], None, 0.0).to_fit
    apart, arrived = np.flatnonzero(output(-5.0) != output(85.0)), np.flatnonzero(seen <= 0.0)[0]
    assert (apart[-1], arrived) == (84, 86)  # the step is at 80
    assert np.flatnonzero(np.isfinite(item.y))[0] == arrived


class TestNoise:
    def item(self, y: Array, v: Array, name: str = "made") -> Item:
        return Item(name, Run(np.arange(len(v)) * 1e-3, v), y, None, float(np.ptp(y)))

    @pytest.mark.parametrize("drive", ["hold", "period", "move"])
    def test_white_noise(self, drive: str) -> None:
        rng = np.random.default_rng(3)
        t = np.arange(6000) * 1e-3
        v = {
            "hold": np.interp(t, [0, 1, 3, 4, 6], [0, 50, 50, 10, 10]),
            "period": 50.0 + 40.0 * np.sin(2 * np.pi * 2.0 * t),
            "move": 50.0 + 40.0 * np.sin(2 * np.pi * (0.3 * t + 0.05 * t**2)),
        }[drive]
        found = noise_floor([self.item(0.1 * v + rng.normal(0.0, 0.02, len(v)), v)])
        assert found.rms == pytest.approx(0.02, rel=0.12)

    def test_p_value(self) -> None:
        rng = np.random.default_rng(5)
        before = [rng.normal(size=2000) for _ in range(3)]
        same = [rng.normal(size=2000) for _ in range(3)]
        less = [0.8 * e for e in before]
        assert selection.difference(before, less) < 1e-6
        assert selection.difference(before, same) > 1e-3
        assert selection.difference(less, before) > 0.9

    def test_a_hold_that_rings_tells_nothing(self) -> None:
        """A decaying oscillation in a hold is not noise, however large; slow random motion is."""
        rng = np.random.default_rng(7)
        t = np.arange(2000) * 1e-3
        v = np.interp(t, [0.0, 0.5, 0.9, 1.4, 2.0], [0.0, 90.0, 90.0, 5.0, 0.0])
        ringing = np.where((t > 0.5) & (t < 0.9), np.exp(-2.0 * (t - 0.5)) * np.cos(2.0 * np.pi * 47.0 * t), 0.0)
        y = 0.1 * v + rng.normal(0.0, 0.02, len(v))
        assert noise_floor([self.item(y + ringing, v)]).holds is None
        slow = np.zeros(len(v))
        for k in range(1, len(v)):
            slow[k] = 0.9 * slow[k - 1] + rng.normal(0.0, 0.05 * np.sqrt(1.0 - 0.81))
        found = noise_floor([self.item(0.1 * v + slow, v)]).holds
        assert found is not None
        # 240 samples are worth 13 independent ones, and some of their motion is taken for creep
        assert found == pytest.approx(0.05, rel=4.0 / np.sqrt(2.0 * 13))


@pytest.mark.parametrize(
    ("points", "names"),
    [
        ([(0, 0), (90, 90), (100, 90.5)], ("saturation",)),  # one rail
        ([(0, 8), (8, 8.1), (95, 95), (100, 95.1)], ("saturation",)),  # both rails
        ([(0, 0), (80, 80), (100, 98)], ("saturation", "asymmetry")),  # a soft rail or a bend
        ([(0, 0), (50, 55), (100, 100)], ("asymmetry",)),
        ([(0, 0), (80, 80), (100, 110)], ("asymmetry",)),  # steeper at an end
        ([(0, 0), (25, 15), (50, 40), (75, 75), (100, 120)], ("asymmetry",)),
        ([(0, 0), (20, 10), (80, 90), (100, 100)], ("saturation",)),  # the same at both ends
    ],
)
def test_what_a_front_is_called(points: list[tuple[float, float]], names: tuple[str, ...]) -> None:
    x, y = np.array(points, dtype=np.float64).T
    front = DeadZones((x[0], x[-1]), tuple(x[1:-1].tolist()))
    assert screening.front_names(front, front.shape(np.diff(y) / np.diff(x)), front.drive) == names


@pytest.mark.parametrize("drive", [(0.0, 100.0), (-50.0, 50.0), (-10.0, 100.0), (-120.0, -20.0)])
def test_a_limiter_is_straight_between_its_ends(drive: tuple[float, float]) -> None:
    low, high = drive
    (stage,) = Ends(drive).stages(np.array([0.1, 0.2, -3.0]))
    ends = np.array([low, low + 0.1 * (high - low), high - 0.2 * (high - low), high])
    v = np.linspace(low, high, 1001)
    inner = 1.0 / (0.7 + 0.3 * np.exp(-3.0))  # the range keeps its length
    slopes = inner * np.array([np.exp(-3.0), 1.0, np.exp(-3.0)])
    heights = np.concatenate([[0.0], np.cumsum(slopes * np.diff(ends))])
    exact = np.interp(v, ends, heights)
    exact -= exact[0] - stage.forward(np.array([low]))[0]
    # numbers of the stage have ten digits; at most three of them act on one value
    assert np.max(np.abs(stage.forward(v) - exact)) <= 3 * 0.5e-9 * 120.0
    assert stage.forward(np.array([0.0]))[0] == 0.0
    assert not list(stage.inverse_problems(low, high))


@pytest.mark.parametrize("drive", [(0.0, 100.0), (-50.0, 50.0), (-120.0, -20.0)])
@pytest.mark.parametrize("shape", [(0.4,), (-0.7, 0.3)])
def test_a_smooth_front_has_the_slopes_of_its_shape(drive: tuple[float, float], shape: tuple[float, ...]) -> None:
    low, high = drive
    (stage,) = BentFront(drive, len(shape)).stages(np.array(shape))
    assert stage.forward(np.array([0.0]))[0] == 0.0
    edges = np.linspace(low, high, 17)
    middles = 0.5 * (edges[1:] + edges[:-1])
    u = (middles - 0.5 * (low + high)) / (0.5 * (high - low))
    expected = np.exp(sum(c * u**k for k, c in enumerate(shape, 1)))
    expected *= 16.0 / np.sum(expected)  # the range keeps its length
    # away from the breaks, since a break near 0 is moved a little
    step = 0.1 * (edges[1] - edges[0])
    slopes = (stage.forward(middles + step) - stage.forward(middles - step)) / (2.0 * step)
    # the moved break changes the length of two pieces by a twentieth; numbers of the stage have ten digits
    moved = 0.05 * float(np.max(np.abs(np.diff(expected)))) / 16.0 if low < 0.0 < high else 0.0
    assert np.max(np.abs(slopes / expected - 1.0)) <= 1.01 * moved + 17 * 0.5e-10 * 120.0 / step


def test_a_strong_curve_of_the_sensor_is_found_whatever_the_offset(tmp_path: Path) -> None:
    """The sensor also sees the offset, so a strong curve is found only if its argument includes the offset."""
    records = []
    for number, reach in enumerate((100.0, 60.0, 100.0), 1):
        v = np.concatenate([np.linspace(0.0, 40.0, 60), 40.0 + (reach / 100.0) * (wander(number) - 40.0)])
        h = brute_output(v, (0.0, 10.0), (1.0, 0.8), 0.0) + 20.0
        y = h + 0.1 * h**2 / 100.0 - 0.05 * h**3 / 100.0**2
        records.append(record(v, noisy(y, 0.02, number), f"record {number}"))
    content = hystgen.diagnose(_model(tmp_path), records[:2], holdout=records[2:], history=[0.0]).content
    assert [effect["name"] for effect in content["effects"]] == ["sensor_nonlinearity"]
    # the nominal thresholds are right, so nothing else is missing
    assert content["gap"]["refitted"]["holdout"] > 30.0 * 0.02
    assert content["gap"]["after"]["holdout"] < 1.15 * 0.02


@pytest.mark.parametrize(("rate", "start"), [(40.0, 0.0), (0.0, 30.0), (40.0, 30.0)])
def test_what_a_curved_sensor_sees(rate: float, start: float) -> None:
    """Creep from any start acts before the sensor, a drift after it; with the right numbers no error remains."""
    v = wander(5, turns=40)
    v[:40] = np.linspace(0.0, v[40], 40)
    t = np.arange(len(v)) * 1e-3
    creep = ExponentialCreep(name="creep", shape="exponential", time_constants=(0.4,), weights=(0.2,))
    slow = creep.filtered(brute_output(v, (0.0, 10.0), (1.0, 0.5), 0.0), Run(t, v)) + start * np.exp(-t / 0.4)
    xi = (slow + 20.0) / 100.0
    y = 100.0 * (xi - 0.12 * xi**2) + 50.0 + rate * t
    made = (
        LinearDrift(name="drift", rate=rate),
        creep,
        SensorPolynomial(name="sensor_nonlinearity", coefficients=(-0.12,), scale=100.0),
    )
    # the start states of drift and creep are free
    item = Item("made", Run(t, v), y - 50.0, None, float(np.ptp(y)))
    error = Actuator(np.array([0.0, 10.0]), (), made).error(item, np.array([1.0, 0.5]))
    assert np.max(np.abs(error)) < 1e-6


@pytest.mark.parametrize("samples", [1, 30])
@pytest.mark.parametrize(
    "bent",
    [
        SensorPolynomial(name="sensor_nonlinearity", coefficients=(0.3,), scale=100.0),
        TanhSaturation(name="saturation", level=60.0),
    ],
)
@pytest.mark.parametrize("place", [0.0, 30.0])
def test_a_drive_at_rest_leaves_the_offset_free(place: float, bent: Effect, samples: int) -> None:
    """Even if a map bends the output, a record at rest determines only its offset."""
    v = np.full(200, place)
    y = noisy(np.full(200, 12.0), 0.02)
    y[:-samples] = np.nan
    actuator = Actuator(np.array([0.0, 10.0]), (), (bent,))
    error = actuator.error(Item("rest", Run(np.arange(200) * 1e-3, v), y, None, 0.0), np.array([1.0, 0.5]))
    np.testing.assert_allclose(error[-samples:], y[-samples:] - y[-samples:].mean(), atol=1e-6)


def test_a_shape_that_contains_a_simpler_one_goes_on_from_it(tmp_path: Path) -> None:
    """The search starts with the simpler shape's weights too, since those for a straight sensor would not suit it."""

    def made(number: int) -> Record:
        v = wander(number, turns=40)
        h = brute_output(v, (0.0, 10.0, 30.0), (1.0, 0.3, 0.3), 0.0) / 160.0
        return record(v, noisy(160.0 * (h + 0.15 * np.sin(3.0 * h + 0.5)), 0.05, number), f"record {number}")

    ready = preparing.prepare([made(1), made(2)], [made(3)], None, 0.0)
    base, start = hypothesis.structure_of(hystgen.load(_model(tmp_path)).cascade, [], ready)
    refitted = selection.refit(base, ready.to_fit, start)
    records = screening.Records.of(ready.to_fit, ready.held, refitted, 0.05)
    rough = screening._rough(refitted, records.thin)
    pairs = zip(screening.options(refitted, records.known), screening.options(rough, records.known), strict=True)
    found = [screening._Pair(*each) for each in pairs if each[0].name == "sensor_nonlinearity"]
    searches = screening._Searches(refitted, rough, found, records)
    simpler = searches(screening._Trial(screening._SCREEN, 1))
    containing = searches(screening._Trial(screening._SCREEN, 2, simpler.shape, simpler.weights))
    assert [pair.option.label for pair in found[1:3]] == ["sensor, cubic", "sensor, quartic"]
    assert containing.rms < simpler.rms


@pytest.mark.slow(one_in=2)
@pytest.mark.parametrize("curve", [-0.15, 0.15])
@pytest.mark.thorough
def test_a_curved_sensor_beside_a_drift(tmp_path: Path, curve: float) -> None:
    records = []
    for number in range(1, 6):
        v = np.concatenate([np.linspace(0.0, 40.0, 60), 40.0 + (1.0 if number % 2 else 0.6) * (wander(number) - 40.0)])
        t = np.arange(len(v)) * 1e-3 + 3.0 * number
        xi = (brute_output(v, (0.0, 10.0), (1.0, 0.5), 0.0) + 60.0) / 100.0
        y = 100.0 * (xi + curve * xi**2) + 1.5 * t
        records.append(Record(f"record {number}", t, v, noisy(y, 0.02, number), sample_time=0.001))
    content = hystgen.diagnose(_model(tmp_path), records[:3], holdout=records[3:], history=[0.0]).content
    assert sorted(effect["name"] for effect in content["effects"]) == ["drift", "sensor_nonlinearity"]
    assert content["gap"]["after"]["holdout"] < 1.15 * 0.02


def test_a_drift_is_not_explained_by_free_start_states(tmp_path: Path) -> None:
    """With an unknown history, creep may start anywhere in every record, which imitates a drift piece by piece."""
    records = []
    for number in range(1, 6):
        v = wander(number, turns=40)
        t = np.arange(len(v)) * 1e-3 + 3.0 * number
        y = brute_output(v, (0.0, 10.0), (1.0, 0.5), 0.0) + 0.4 * t + 0.02 * t**1.5
        records.append(Record(f"record {number}", t, v, noisy(y, 0.02, number), sample_time=0.001))
    content = hystgen.diagnose(_model(tmp_path), records[:3], holdout=records[3:]).content
    assert [effect["name"] for effect in content["effects"]] == ["drift"]


@pytest.mark.thorough
def test_what_shows_in_held_out_records_alone_is_not_fitted(tmp_path: Path) -> None:
    """Only one record has steps faster than the amplifier. If it is held out, no parameter is fitted to them."""
    slow = [np.concatenate([np.linspace(0.0, v[0], 40), v]) for v in (wander(seed, turns=40) for seed in (1, 2))]
    steps = np.concatenate([np.zeros(40), np.repeat(np.random.default_rng(3).uniform(0.0, 100.0, 40), 60)])

    def output(v: Array, rate: float) -> Array:
        a = v.copy()
        for k in range(1, len(a)):
            a[k] = a[k - 1] + np.clip(v[k] - a[k - 1], -1e-3 * rate, 1e-3 * rate)
        return brute_output(a, (0.0, 10.0, 25.0), (1.0, 0.5, 0.3), 0.0)

    drives = enumerate((*slow, steps))
    records = [record(v, noisy(output(v, 7000.0), 0.05, number), f"record {number}") for number, v in drives]
    found = hystgen.diagnose(_model(tmp_path), records[:2], holdout=records[2:], history=[0.0]).content
    assert found["verdict"] == "unexplained"
    assert any(advice.startswith("fit record 2 too and hold out others") for advice in found["advice"])
    found = hystgen.diagnose(_model(tmp_path), records[1:], holdout=records[:1], history=[0.0]).content
    assert [effect["name"] for effect in found["effects"]] == ["slew_limit"]
    # the noise gives the rate a standard error of 0.05 / |slope|; four standard errors are allowed
    slope = (output(steps, 7001.0) - output(steps, 6999.0)) / 2.0
    assert abs(found["effects"][0]["parameters"]["rate"] - 7000.0) <= 4.0 * 0.05 / np.linalg.norm(slope)
    assert not any("hold out others" in advice for advice in found["advice"])


@pytest.mark.parametrize("curve", [None, 0.3])
@pytest.mark.parametrize(("weight", "left"), [(0.0, 1.0), (1e-4, 1.0), (0.2, 0.0)])
def test_a_start_state_explains_no_more_than_it_can_be(weight: float, left: float, curve: float | None) -> None:
    """A ramp is explained as the start of a slow state only if that state has enough weight, with a straight sensor or
    a curved one."""
    v = wander(1, turns=40)
    run = Run(np.arange(len(v)) * 1e-3, v)
    slow = ExponentialCreep(name="creep", time_constants=(50.0,), weights=(weight,))
    bent = SensorPolynomial(name="sensor_nonlinearity", coefficients=(curve or 0.0,), scale=100.0)
    actuator = Actuator(np.array([0.0]), (), (slow,) if curve is None else (slow, bent))
    p = np.ones(1)
    rows, _ = actuator.columns(Item("still", run, v, None, 100.0), p)
    ramp = 0.2 * np.linspace(-1.0, 1.0, len(v))
    y = bent.mapped(rows[0] + 3.0 + ramp, run)
    (error,) = Fitted(_only(actuator), np.empty(0), p, 0.0).errors([Item("ramp", run, y, None, 100.0)])
    error = error / (1.0 + 2.0 * (curve or 0.0) * (rows[0] + 3.0 + ramp) / 100.0)
    assert np.sqrt(np.mean(error**2) / np.mean(ramp**2)) == pytest.approx(left, abs=0.02)


def _only(actuator: Actuator) -> hypothesis.Structure:
    return hypothesis.Structure(actuator.thresholds, Kept(), tuple(map(hypothesis.kept, actuator.effects)))


@pytest.mark.parametrize("curve", [None, 0.3])
@pytest.mark.parametrize("plays", [1, 2, 7, 8])
def test_every_other_threshold_leaves_hardly_more(plays: int, curve: float | None) -> None:
    """This also holds behind a curved sensor, where the output is not linear in the weights."""
    places = np.linspace(0.0, 30.0, plays + 1)
    weights = np.append(1.0, np.full(plays, 0.6 / plays))
    v = wander(5, turns=40)
    bent = SensorPolynomial(name="sensor_nonlinearity", coefficients=(curve or 0.0,), scale=100.0)
    actuator = Actuator(places, (), () if curve is None else (bent,))
    item = Item("made", Run(np.arange(len(v)) * 1e-3, v), v, (0.0,), 100.0)
    h = brute_output(v, tuple(places.tolist()), tuple(weights.tolist()), 0.0)
    item = dataclasses.replace(item, y=np.asarray(h + (curve or 0.0) * h**2 / 100.0))
    whole = Fitted(_only(actuator), np.empty(0), weights, 0.0)
    rough = screening._rough(whole, [item])
    kept = rough.structure.thresholds
    assert (kept[0], kept[-1]) == (0.0, 30.0)
    assert len(kept) == 1 + (plays + 1) // 2
    assert set(kept) <= set(places)
    assert rms(whole.errors([item])) < 1e-9 * np.ptp(item.y)
    assert rms(rough.errors([item])) < (0.02 if plays > 1 else 1e-9) * np.ptp(item.y)


def _bent(folder: Path, codes: float, metres: float) -> dict[str, Any]:
    """Diagnosis of a bent front, with the drive in `codes` per V and the output in `metres` per um."""
    records = []
    for number in range(1, 6):
        v = wander(number, turns=40)
        y = noisy(brute_output(100.0 * np.tanh(0.01 * v), (0.0, 10.0, 25.0), (1.0, 0.5, 0.3), 0.0), 0.05, number)
        records.append(record(v * codes, y * metres, f"record {number}"))
    (folder / "stage.yaml").write_text(
        f"hystgen: 1\nname: stage\ninput_range: [0, {100.0 * codes}]\nmodel:\n  pi:\n"
        f"    thresholds: [0, {10.0 * codes}, {25.0 * codes}]\n"
        f"    weights: [{metres / codes}, {0.5 * metres / codes}, {0.3 * metres / codes}]\n"
    )
    content: dict[str, Any] = hystgen.diagnose(
        folder / "stage.yaml", records[:3], holdout=records[3:], history=[0.0]
    ).content
    return content


@pytest.mark.slow(one_in=2)
@pytest.mark.thorough(but_one_in=2)
@pytest.mark.parametrize(("codes", "metres"), [(436.9, 1e-6), (1e-6, 1e6)])
def test_units_do_not_matter(codes: float, metres: float, tmp_path: Path) -> None:
    """With the drive in converter codes and the output in metres, the diagnosis is the same as with V and um."""
    plain, other = _bent(tmp_path, 1.0, 1.0), _bent(tmp_path, codes, metres)
    assert [effect["name"] for effect in other["effects"]] == [effect["name"] for effect in plain["effects"]]
    assert [effect["name"] for effect in other["effects"]] == ["asymmetry"]
    # either search may stop above the minimum by 1e-5 of its error, or by one sample's part of it
    assert other["gap"]["after"]["holdout"] == pytest.approx(plain["gap"]["after"]["holdout"] * metres, rel=1e-3)


def test_stops_that_are_not_centred_and_give(tmp_path: Path) -> None:
    """The stops are behind the plays and off centre: neither a front nor a symmetric limit explains them."""
    lower, upper, give = -5.0, 118.0, 0.3
    records = []
    for number in range(1, 7):
        v = wander(number, turns=40)
        h = brute_output(v, (0.0, 10.0), (1.0, 0.5), 0.0)
        y = np.clip(h, lower, upper)
        y = y + give * (h - y) + 7.0
        records.append(record(v, noisy(y, 0.05, number), f"record {number}"))
    content = hystgen.diagnose(_model(tmp_path), records[:4], holdout=records[4:], history=[0.0]).content
    (effect,) = content["effects"]
    found = effect["parameters"]
    assert (effect["name"], found["shape"]) == ("saturation", "stops")
    assert found["upper"] == pytest.approx(upper, abs=0.5)
    assert found["give"] == pytest.approx(give, abs=0.03)
    assert content["gap"]["after"]["holdout"] < 1.1 * 0.05


@pytest.mark.parametrize(
    ("rates", "aside"),
    [
        ([1, 1, 1, 1, 1, 1], [2, 5]),
        ([1, 1, 9, 1, 6, 1], [2, 5]),  # one fast record is fitted, another held out
        ([1, 1, 9, 1, 1, 8], [1, 5]),  # every third record would leave both fast ones on one side
        ([1, 9, 1, 1, 8, 1], [1, 5]),
        ([1, 1, 9, 1, 1, 1], [2, 5]),  # a single fast record cannot be on both sides
        ([1, 9, 1, 1, 8, 7], [2, 5]),
        ([9, 1, 1, 8, 1], [0, 4]),
        ([1, 1, 9, 8], [2]),
    ],
)
def test_either_side_has_fast_records(rates: list[float], aside: list[int]) -> None:
    records = []
    for number, rate in enumerate(rates):
        t = np.arange(400) * 0.01
        records.append(Record(f"record {number}", t, 50.0 * np.abs((rate * t) % 2.0 - 1.0), t, sample_time=0.01))
    assert set_aside(records) == aside


def test_held_out_records_take_no_part_in_the_fit(tmp_path: Path) -> None:
    """The refitted model does not depend on the content of a held-out record."""
    records = []
    for number in (1, 2, 3):
        v = np.concatenate([np.linspace(0.0, 30.0, 40), 0.3 * wander(number, turns=40)])
        records.append(record(v, noisy(brute_output(v, (0.0, 5.0), (1.0, 0.5), 0.0), 0.02, number), f"record {number}"))
    wide = 3.0 * np.asarray(records[2].v)
    other = record(wide, noisy(brute_output(wide, (0.0, 5.0, 40.0), (1.0, 0.5, 0.8), 0.0), 0.02, 4), "wide")
    fits = [
        hystgen.diagnose(_model(tmp_path), records[:2], holdout=held, history=[0.0]).content["gap"]["refitted"]["fit"]
        for held in (records[2], other)
    ]
    assert fits[0] == fits[1]


def test_records_of_which_the_memory_is_known_at_the_end_only(tmp_path: Path) -> None:
    """Without a history, only the way back of a single sweep can be compared; with a history, all of it."""
    v = np.concatenate([np.linspace(0.0, 100.0, 600), np.linspace(100.0, 90.0, 60)])
    sweep = record(v, noisy(brute_output(v, (0.0, 10.0), (1.0, 0.5), 0.0), 0.01), "sweep")
    path = _model(tmp_path)
    found = hystgen.diagnose(path, sweep, holdout=sweep)
    assert found.verdict == "nothing_missing"
    assert any("90 of 660 samples are compared" in note and "--history" in note for note in found.notes)
    short = record(v[:-55], np.asarray(sweep.y)[:-55], "short")
    with pytest.raises(hystgen.diagnosis.IdentificationError, match=r"short: .*: at most \d in a .*--history"):
        hystgen.diagnose(path, short, holdout=short)
    last = record(v[:600], np.asarray(sweep.y)[:600], "last")  # the record ends at its largest drive
    with pytest.raises(hystgen.diagnosis.IdentificationError, match=r"last: too few samples to fit: at most 1 in a"):
        hystgen.diagnose(path, last, holdout=last)
    content = hystgen.diagnose(path, sweep, holdout=sweep, history=[0.0]).content
    assert content["gap"]["refitted"]["holdout"] < 0.01 * content["output_range"]


def _behind_a_cycle(drives: list[Array]) -> list[Record]:
    """Records of an actuator that was driven to 100 and to 0 before each of them."""
    records = []
    for number, v in enumerate(drives):
        before = np.concatenate([np.linspace(0.0, 100.0, 50), np.linspace(100.0, 0.0, 50), np.linspace(0.0, v[0], 50)])
        y = brute_output(np.concatenate([before, v]), (0.0, 10.0, 25.0), (1.0, 0.5, 0.4), 0.0)[len(before) :]
        records.append(record(v, noisy(y, 0.05, number), f"record {number}"))
    return records


def test_a_history_that_the_starts_contradict_is_left_out(tmp_path: Path) -> None:
    """The errors that it would cause at the starts are not taken for an effect."""
    records = _behind_a_cycle([wander(number) for number in (1, 2, 3, 4)])
    right, wrong, none = (
        hystgen.diagnose(_model(tmp_path), records[:3], holdout=records[3:], history=history)
        for history in ([100.0, 0.0], [0.0], None)
    )
    assert right.verdict == wrong.verdict == none.verdict == "nothing_missing"
    assert right.content["unexplained"] == none.content["unexplained"] == []
    (said,) = wrong.content["unexplained"]
    assert (said["kind"], said["record"]) == ("history", "all")
    assert said["start"] > said["rest"] > 0.05
    assert wrong.content["gap"] == none.content["gap"]
    assert wrong.sentence().endswith("The data have faults: 1 history that the starts contradict.")
    wrong.write(tmp_path / "out")
    assert "a history other than the given one" in (tmp_path / "out" / "report.html").read_text()


def test_short_records_without_the_history_that_the_starts_contradict(tmp_path: Path) -> None:
    """Start memories are found in place of the history; without them hardly any samples could be compared."""
    ways = [np.random.default_rng(number).uniform(0.0, 100.0, 9) for number in range(8)]
    legs = [np.concatenate([[way[0], 60.0, 5.0, 0.0, 100.0], way[1:]]) for way in ways]
    records = _behind_a_cycle([np.interp(np.arange(130) / 10.0, np.arange(len(leg)), leg) for leg in legs])
    for history in ([100.0, 0.0], [0.0]):
        found = hystgen.diagnose(_model(tmp_path), records[:6], holdout=records[6:], history=history)
        assert found.verdict == "nothing_missing"
        assert [each["kind"] for each in found.content["unexplained"]] == (["history"] if history == [0.0] else [])


@pytest.mark.parametrize("command", ["identify", "diagnose"])
def test_a_record_that_is_fitted_and_held_out_is_told(command: str, tmp_path: Path, run: Call) -> None:
    """A wildcard may cause this, but a fitted record tests nothing."""
    v = wander(1)
    files = [write_csv(tmp_path / name, v, noisy(brute_output(v, (0.0, 10.0), (1.0, 0.5), 0.0), 0.01, seed))
             for seed, name in enumerate(("a.csv", "b.csv", "c.csv"))]  # fmt: skip
    files.append(tmp_path / "d.csv")
    files[-1].write_bytes(files[0].read_bytes())
    words = ["identify"] if command == "identify" else ["diagnose", _model(tmp_path)]
    code, _, err = run(*words, files[0], files[1], "--holdout", files[3], "-o", tmp_path / "out")
    assert code == 0, err
    assert "warning: d.csv: held out, but also fitted, as a.csv, so it is no test; leave it out of" in err
    assert "b.csv" not in err
    code, _, err = run(*words, files[0], files[1], files[3], "--holdout", files[2], "-o", tmp_path / "out")
    assert code == 0, err
    assert "warning: d.csv: fitted twice, also as a.csv; leave one of them out" in err
    assert "held out" not in err


@pytest.mark.parametrize("held_out", [True, False])
def test_a_record_that_says_nothing_is_told(held_out: bool, tmp_path: Path) -> None:
    """If it is the only held-out record, others are held out instead; otherwise a note says that it is not compared."""
    rng = np.random.default_rng(1)
    ends = [rng.permutation(np.linspace(0, 100, 11)) for _ in "abcd"]
    drives = [np.concatenate([[50, 100, 0], np.interp(np.arange(900), np.arange(0, 901, 90), x)]) for x in ends]
    drives.append(np.linspace(0.0, 100.0, 600))
    made = [
        record(v, noisy(brute_output(v, (0.0, 10.0), (1.0, 0.5), 0.0), 0.01), name)
        for v, name in zip(drives, [*"abcd", "sweep"], strict=True)
    ]
    held = made[4:] if held_out else made[3:]
    found = hystgen.diagnose(_model(tmp_path), made[: 4 if held_out else 3], holdout=held)
    spec = " ".join(found.notes)
    assert ("sweep: too few samples to judge by" in spec) is held_out
    assert ("held-out record was given: c set aside" in spec) is held_out
    assert ("sweep: only 1 sample compared" in spec) is not held_out
    assert found.verdict == "nothing_missing"


def test_no_records_to_judge_by(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="record"):
        hystgen.diagnose(hystgen.load(_model(tmp_path)), [])


@pytest.mark.parametrize(
    "effect",
    [
        RelaxingPlays(name="rate_dependence", shape="relaxation", time_constant=1e-4, exponent=3.0),
        PlayFunctions(name="noncongruent", coefficients=((0.3,), (0.2,), (0.1,))),
        LinearDrift(name="drift", rate=0.5),
    ],
    ids=lambda effect: effect.name,
)
def test_the_extended_file_is_the_model_that_was_found(tmp_path: Path, effect: Effect) -> None:
    """The file keeps the largest threshold although its play has no weight, since stretches are relative to it."""
    places, weights = np.array([0.0, 10.0, 20.0, 30.0]), np.array([1.0, 0.5, 0.25, 0.0])
    form = hypothesis.Structure(places, Kept(), (hypothesis.kept(effect),))
    v = np.concatenate([np.linspace(0.0, 40.0, 60), 40.0 + (wander(3, 40) - 40.0)])
    run = Run(np.arange(len(v)) * 1e-3, v)
    item = Item("made", run, v, (0.0,), 100.0)
    actuator = Actuator(places, (), (effect,))
    (rows,), _ = actuator.columns(item, weights)
    predicted = rows + actuator.added(item.run)[item.compared]
    item = dataclasses.replace(item, y=predicted)
    fitted = Fitted(form, np.empty(0), weights, 0.0)
    ready = preparing.Prepared([item], [item], [], [], (0.0, 100.0), places)
    given = hystgen.load(_model(tmp_path))
    outcome = selection.Outcome(fitted, fitted, (), ())
    extended = hystgen.Model(_extended(given.parameters, given.cascade, outcome, ready, ()))
    (found,) = extended.chain.simulate([run], [0.0])
    # weights are written with ten digits; each multiplies up to 100, and the offset absorbs the mean error
    assert np.max(np.abs(found - predicted)) <= 2.0 * 0.5e-9 * np.sum(weights) * 100.0


@pytest.mark.parametrize("offset", [-9.0, 0.0, 14.0])
def test_the_written_offset_is_that_in_front_of_the_sensor(tmp_path: Path, offset: float) -> None:
    """The sensor flattens towards the ends, so the mean error behind it is not the offset in front of it."""
    places, weights = np.array([0.0, 10.0, 20.0]), np.array([0.6, 0.5, 0.25])
    knots = np.linspace(-30.0, 120.0, 7)
    sensor = SensorCurve(
        name="sensor_nonlinearity", shape="curve", knots=tuple(knots.tolist()),
        values=tuple((60.0 * np.tanh((knots - 40.0) / 40.0)).tolist()),
    )
    v = np.concatenate([np.linspace(0.0, 40.0, 60), 40.0 + (wander(3, 40) - 40.0)])
    run = Run(np.arange(len(v)) * 1e-3, v)
    y = sensor.mapped(offset + brute_output(v, places.tolist(), weights.tolist(), 0.0), run)
    item = Item("made", run, y, (0.0,), 100.0)
    fitted = Fitted(hypothesis.Structure(places, Kept(), (hypothesis.kept(sensor),)), np.empty(0), weights, 0.0)
    ready = preparing.Prepared([item], [item], [], [], (0.0, 100.0), places)
    given = hystgen.load(_model(tmp_path))
    outcome = selection.Outcome(fitted, fitted, (), ())
    extended = hystgen.Model(_extended(given.parameters, given.cascade, outcome, ready, ()))
    assert extended.parameters.model.output_offset == pytest.approx(offset, abs=1e-6)
    np.testing.assert_allclose(extended.simulate(v, t=run.t), y, atol=1e-5)


@pytest.mark.parametrize("before", [-70.0, 70.0])
@pytest.mark.parametrize("start", [0.4, 0.7, 1.5, 3.0])
def test_a_play_that_never_moves_gets_no_weight_behind_a_bent_sensor(before: float, start: float) -> None:
    """It acts as an offset, which is free already: the drive moves 80 V at most, and 120 V would have to be covered."""
    places, weights = np.array([0.0, 10.0, 60.0]), np.array([0.6, 0.5, 0.0])
    knots = np.linspace(-60.0, 60.0, 7)
    sensor = SensorCurve(
        name="sensor_nonlinearity", shape="curve", knots=tuple(knots.tolist()),
        values=tuple((50.0 * np.tanh(knots / 25.0)).tolist()),
    )
    v = wander(3, -40.0, 40.0)
    run = Run(np.arange(len(v)) * 1e-3, v)
    moved = brute_output(np.concatenate([[before], v]), places.tolist(), weights.tolist(), 0.0)[1:]
    item = Item("made", run, sensor.mapped(8.0 + moved, run), (before,), 80.0)
    structure = hypothesis.Structure(places, Kept(), (hypothesis.kept(sensor),))
    found = fits.linear(structure, [item], np.empty(0), start * weights)
    assert found.best[-1] == 0.0


def five_records(output: Callable[[Array, Array], Array]) -> list[Record]:
    """Five records of one session: a function of time and drive as output, and noise."""
    made = []
    for number in range(5):
        v = np.concatenate([np.linspace(0.0, 40.0, 60), 40.0 + (1.0 - 0.1 * number) * (wander(number, 40) - 40.0)])
        t = np.arange(len(v)) * 1e-3 + 4.0 * number
        made.append(Record(f"record {number}", t, v, noisy(output(t, v), 0.02, number), sample_time=0.001))
    return made


def test_a_bend_that_may_be_the_stage_s_or_the_sensor_s_is_said_where_c_is_made(tmp_path: Path, run: Call) -> None:
    """The loops are so narrow that a bend in front of the plays looks like a bend of the sensor behind them."""

    def output(_: Array, v: Array) -> Array:
        bent = v + 0.003 * (v - 20.0) ** 2
        return np.asarray(brute_output(bent, (0.0, 10.0), (1.0, 0.01), 0.0))

    path = tmp_path / "stage.yaml"
    path.write_text(
        "hystgen: 1\nname: stage\nsample_time: 1.0e-3\ninput_range: [0, 40]\n"
        "model: {pi: {thresholds: [0, 10.0], weights: [1.0, 0.01]}}\n"
    )
    records = five_records(output)
    found = hystgen.diagnose(path, records[:3], holdout=records[3:], history=[0.0])
    assert found.content["not_separable"] == [["sensor_nonlinearity", "asymmetry"]]
    found.write(tmp_path / "out")
    extended = tmp_path / "out" / "params.yaml"
    assert hystgen.load(extended).parameters.not_separable == (("sensor_nonlinearity", "asymmetry"),)
    code, _, err = run("emit", extended, "-o", tmp_path / "firmware")
    assert code == 0
    assert "warning: stage: the sensor was diagnosed as curved" in err
    assert "the inverse leaves it as it is" in err


class TestNominalEffects:
    """The nominal model has effects. Their parameters are refitted; wrong values do not show as a missing effect."""

    def records(self, before: Callable[[Array], Array], behind: Callable[[Array], Array]) -> list[Record]:
        """Records of plays with one function before and one behind them."""
        return five_records(lambda _, v: behind(brute_output(before(v), (0.0, 10.0), (1.0, 0.5), 0.0)))

    def diagnosed(self, tmp_path: Path, records: list[Record], effect: dict[str, Any], **more: Any) -> Diagnosis:
        path = tmp_path / "nominal.yaml"
        path.write_text(_model(tmp_path).read_text().replace("}}", f"}}, effects: {json.dumps([effect])}}}"))
        return hystgen.diagnose(path, records[:3], holdout=records[3:], history=[0.0], **more)

    def check(self, found: Diagnosis, key: str, value: float) -> None:
        assert found.content["verdict"] == "nothing_missing", found.sentence()
        assert found.content["gap"]["after"]["holdout"] < 1.1 * 0.02
        (effect,) = found.parameters.model.effects
        assert getattr(effect, key) == pytest.approx(value, rel=0.03)

    def test_a_wrong_time_constant(self, tmp_path: Path) -> None:
        def lagging(v: Array) -> Array:
            fine = np.interp(np.linspace(0, len(v) - 1, 20 * (len(v) - 1) + 1), np.arange(len(v)), v)
            left = np.exp(-1e-3 / 20 / 6e-3)
            return np.asarray(v[0] + lfilter([1.0 - left], [1.0, -left], fine - v[0]))[::20]

        records = self.records(lagging, lambda y: y)
        found = self.diagnosed(tmp_path, records, {"name": "lag", "time_constant": 0.0066})
        self.check(found, "time_constant", 0.006)

    @pytest.mark.parametrize("level", [30.0, 33.0])
    def test_a_hard_limit(self, tmp_path: Path, level: float) -> None:
        """A correct nominal limit is kept, although weights fitted without it stay below it, where it is inactive."""
        records = self.records(lambda v: v, lambda y: np.minimum(y, 30.0))
        found = self.diagnosed(tmp_path, records, {"name": "saturation", "shape": "stops", "lower": -900.0,
                                                   "upper": level, "give": 0.0})  # fmt: skip
        self.check(found, "upper", 30.0)

    def test_gains_of_records_that_come_and_go(self) -> None:
        """Gains cached for a record are not used for a later record at the same memory address."""
        effect = ExponentialAgeing(name="ageing", shape="exponential", loss=0.05, travel=100.0)
        actuator = Actuator(np.array([0.0]), (), (effect,))
        for number in range(200):
            v = wander(number, 20)[: 100 + number % 7]
            run = Run(np.arange(len(v)) * 1e-3, v)
            (rows,), _ = actuator.columns(Item("passing", run, v, (0.0,), 1.0), np.ones(1))
            travelled = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(v)))])
            assert np.max(np.abs(rows - v * (1.0 - 0.05 * (1.0 - np.exp(-travelled / 100.0))))) < 1e-9

    @pytest.mark.parametrize("history", [None, (100.0, 0.0)])
    def test_a_history_says_nothing_of_slow_states(self, history: tuple[float, ...] | None) -> None:
        """A history gives the memory of the plays but not its timing, so creep may still be going on."""
        effect = ExponentialCreep(name="creep", time_constants=(4.0,), weights=(0.06,))
        actuator = Actuator(np.array([0.0]), (), (effect,))
        v = wander(3, 20)
        t = np.arange(len(v)) * 1e-3
        slow = np.asarray(lfilter([1.0], [1.0, -np.exp(-1e-3 / 4.0)], np.zeros(len(v)), zi=[50.0])[0])
        item = Item("made", Run(t, v), v, history, 100.0)
        (rows,), _ = actuator.columns(item, np.ones(1))
        left = actuator.error(dataclasses.replace(item, y=rows + 0.06 * slow + 7.0), np.ones(1))
        assert np.max(np.abs(left)) < 1e-9

    def test_the_start_memory_stays(self, tmp_path: Path) -> None:
        records = self.records(lambda v: v, lambda y: y)
        path = tmp_path / "nominal.yaml"
        path.write_text(_model(tmp_path).read_text().replace("}}", ", initial_state: 4.0}}"))
        found = hystgen.diagnose(path, records[:3], holdout=records[3:], history=[0.0])
        extended, given = hystgen.Model(found.parameters), hystgen.load(path)
        v = np.linspace(4.0, 40.0, 50)
        assert np.ptp(extended.simulate(v) - given.simulate(v)) < 0.1
        assert extended.cascade.pi.start[-1] == pytest.approx(given.cascade.pi.start[-1])


class TestOwnEffects:
    """A user's own effect is treated like the catalogue's effects."""

    def records(self, amplitude: float, period: float) -> list[Record]:
        """Records of plays plus an offset from a duty cycle."""

        def output(t: Array, v: Array) -> Array:
            beside = 0.5 * amplitude * (1.0 - np.cos(2.0 * np.pi * t / period))
            return np.asarray(brute_output(v, (0.0, 10.0), (1.0, 0.5), 0.0) + beside)

        return five_records(output)

    def drifting(self) -> list[Record]:
        """Records of plays that drift."""
        return five_records(lambda t, v: np.asarray(brute_output(v, (0.0, 10.0), (1.0, 0.5), 0.0) + 0.05 * t))

    @pytest.mark.thorough(but_one_in=2)
    @pytest.mark.parametrize(("amplitude", "period"), [(2.0, 3.3), (-6.0, 11.0)])
    def test_it_is_found_named_and_added(self, tmp_path: Path, run: Call, amplitude: float, period: float) -> None:
        """The effect's amplitude may have either sign, and may exceed the value at which the search starts."""
        records = self.records(amplitude, period)
        for each in records:
            table = np.column_stack([each.t, each.v, each.y])
            np.savetxt(tmp_path / f"{each.name}.csv", table, delimiter=",", header="t,v,y", comments="")
        own = Path(__file__).parent / "neighbour.py"
        files = [tmp_path / f"{each.name}.csv" for each in records]
        words = [*files[:3], "--holdout", files[3], "--holdout", files[4], "--history", "0", "--effects", own]
        code, _, err = run("diagnose", _model(tmp_path), *words, "-o", tmp_path / "out")
        assert code == 0, err
        (effect,) = json.loads((tmp_path / "out" / "diagnosis.json").read_text())["effects"]
        assert effect["name"] == "user:neighbour"
        # standard errors of amplitude and period with free offsets and weights; four of each are allowed
        columns = []
        for k, each in enumerate(records[:3]):
            angle = 2.0 * np.pi * np.asarray(each.t) / period
            plays = [brute_output(each.v, (r,), (1.0,), 0.0) for r in (0.0, 10.0)]
            columns.append(
                np.column_stack(
                    [0.5 * (1.0 - np.cos(angle)), -0.5 * amplitude * np.sin(angle) * angle / period, *plays]
                    + [np.full(len(angle), float(k == other)) for other in range(3)]
                )
            )
        table = np.concatenate(columns)
        sure = 0.02 * np.sqrt(np.diag(np.linalg.inv(table.T @ table)))
        found = effect["parameters"]
        assert abs(found["amplitude"] - amplitude) <= 4.0 * sure[0]
        assert abs(found["period"] - period) <= 4.0 * sure[1]
        again = hystgen.load(tmp_path / "out" / "params.yaml", effects=[own])
        assert [each.name for each in again.effects] == ["user:neighbour"]

    @pytest.mark.thorough
    def test_numbers_that_make_nothing_end_its_search(self, tmp_path: Path) -> None:
        """If the output is infinite right next to the start of the search, the effect is not named. An effect of the
        catalogue explains the records, so that the search ends with it."""

        class Cliff(Effect):
            name: Literal["user:cliff"] = "user:cliff"
            height: float
            place: ClassVar[Place] = Place.ADDED

            def added(self, run: Run) -> Array:
                return self.height * run.t**2 if self.height <= 0.1 else np.full(len(run.t), np.inf)

            @classmethod
            def candidates(cls, about: About) -> list[Candidate]:  # noqa: ARG003
                def build(x: Array) -> Cliff:
                    return cls(height=float(x[0]))

                return [Candidate("cliff", np.array([-9.0]), np.array([9.0]), np.array([0.1]), build, np.zeros(1))]

        records = self.drifting()
        given: dict[str, Any] = {"holdout": records[3:], "history": [0.0]}
        content = hystgen.diagnose(_model(tmp_path), records[:3], effects=[Cliff], **given).content
        (effect,) = content["effects"]
        assert effect["name"] != "user:cliff"

    @pytest.mark.thorough
    def test_it_sees_all_samples(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        """Trials of catalogue effects use fewer samples, but a user's code may rely on even steps."""
        monkeypatch.setattr(acceptance, "SCREENED", 500)
        monkeypatch.setattr(acceptance, "SEARCHED", 800)
        monkeypatch.setattr(parallel, "cores", lambda: 1)  # another process would fill a list of its own
        seen = []

        class Even(Effect):
            name: Literal["user:even"] = "user:even"
            height: float
            place: ClassVar[Place] = Place.ADDED

            def added(self, run: Run) -> Array:
                seen.append(float(np.ptp(np.diff(run.t))))
                return np.full(len(run.t), self.height) * run.t

            @classmethod
            def candidates(cls, about: About) -> list[Candidate]:  # noqa: ARG003
                def build(x: Array) -> Even:
                    return cls(height=float(x[0]))

                return [Candidate("even", np.array([-9.0]), np.array([9.0]), np.array([0.1]), build, np.zeros(1))]

        records = self.drifting()
        given: dict[str, Any] = {"holdout": records[3:], "history": [0.0]}
        steps = []
        look, enough = screening.thinned, math.inf

        class UnevenError(Exception):
            """A trial's steps differ by more than `enough`, which ends the search."""

        def looked(groups: Any, most: int, masks: Any) -> Any:
            found = look(groups, most, masks)
            steps.extend(float(np.ptp(np.diff(item.run.t))) for group in found for item in group)
            if max(steps, default=0.0) > enough:
                raise UnevenError
            return found

        monkeypatch.setattr(screening, "thinned", looked)
        hystgen.diagnose(_model(tmp_path), records[:3], effects=[Even], **given)
        assert seen
        assert max(seen) < 1e-9
        assert max(steps) < 1e-9
        enough = 1e-3
        with pytest.raises(UnevenError):
            hystgen.diagnose(_model(tmp_path), records[:3], **given)


def _model(folder: Path) -> Path:
    path = folder / "stage.yaml"
    path.write_text(
        "hystgen: 1\nname: stage\ninput_range: [0, 100]\nmodel: {pi: {thresholds: [0, 10], weights: [1, 0.5]}}\n"
    )
    return path


def test_the_report_says_why_refitting_may_widen_the_gap() -> None:
    found = result("unexplained", (), 0.5, [])

    def gap(held_out: float) -> Result:
        return dataclasses.replace(found, gap=Gap(FitErrors(2.0, 3.0), FitErrors(0.5, held_out), FitErrors(0.5, 0.5)))

    (said,) = report._refitted(gap(4.0))
    assert "rms error (um) of the fitted records from 2 to 0.5, and that of the held-out ones from 3 to 4" in said.text
    assert report._refitted(gap(3.02)) == []


def test_a_model_with_a_bent_sensor_is_refitted(tmp_path: Path) -> None:
    """The sensor's curve only suits outputs of the right size; a search that starts far from them may end anywhere."""
    v = np.concatenate([np.linspace(0.0, 100.0, 200), wander(3), wander(8)])
    x = brute_output(v, (0.0, 5.0, 12.0, 25.0), (0.04, 0.01, 0.01, 0.01), 0.0)
    xi = x / 6.0
    bent = noisy(x + 6.0 * (0.15 * xi**2 - 0.1 * xi**3), 0.003)
    path = tmp_path / "bent.yaml"
    path.write_text(
        "hystgen: 1\nname: bent\ninput_range: [0, 100]\nmodel:\n"
        "  pi: {thresholds: [0, 5, 12, 25], weights: [0.04, 0.01, 0.01, 0.01]}\n"
        "  effects: [{name: sensor_nonlinearity, coefficients: [0.15, -0.1], scale: 6}]\n"
    )
    found = hystgen.diagnose(path, record(v, bent, "r"), history=[0.0])
    assert found.verdict == "nothing_missing"
    assert found.content["gap"]["refitted"]["holdout"] < 0.0033


def _slewed(v: Array, rate: float, step: float) -> Array:
    """The drive followed at a limited rate, in steps of a fiftieth of a sample."""
    fine = np.interp(np.arange(50 * (len(v) - 1) + 1) / 50, np.arange(len(v)), v)
    out, most = np.empty_like(fine), rate * step / 50
    x = out[0] = fine[0]
    for k in range(1, len(fine)):
        x = out[k] = x + min(max(fine[k] - x, -most), most)
    return np.asarray(out[::50])


@pytest.mark.thorough(but_one_in=2)
@pytest.mark.parametrize(("name", "key", "value"), [("slew_limit", "rate", 150.0), ("delay", "time", 0.06)])
def test_numbers_far_from_where_drives_are_fast_are_found(tmp_path: Path, name: str, key: str, value: float) -> None:
    """Steps between samples are a hundred times as fast as the limit; sines reverse within the delay."""
    step, thresholds, weights = 2e-3, (0.0, 4.0, 10.0, 20.0), (0.08, 0.01, 0.01, 0.01)
    t = np.asarray(np.arange(4000) * step, dtype=np.float64)
    drives = {
        "slow": 50.0 - 50.0 * np.cos(2 * np.pi * 0.25 * t),
        "steps": np.repeat([0.0, 60.0, 20.0, 100.0, 40.0, 80.0, 0.0, 30.0], 500),
        "sines": 50.0 + 20.0 * np.sin(2 * np.pi * 1.1 * t) + 15.0 * np.sin(2 * np.pi * 7.3 * t),
        "other": 50.0 + 25.0 * np.sin(2 * np.pi * 0.9 * t) + 12.0 * np.sin(2 * np.pi * 5.1 * t),
        "more": np.repeat([0.0, 30.0, 90.0, 10.0, 70.0, 100.0, 50.0, 0.0], 500),
    }
    made = []
    for k, (record_name, v) in enumerate(drives.items()):
        seen = _slewed(v, value, step) if name == "slew_limit" else np.interp(t - value, t, v)
        y = brute_output(np.concatenate([[100.0, 0.0], seen]), thresholds, weights, 0.0)[2:]
        y = np.asarray(y) + np.random.default_rng(k).normal(0.0, 0.01, len(t))
        made.append(Record(record_name, 20.0 * k + t, v, y))
    stage = tmp_path / "stage.yaml"
    stage.write_text(
        "hystgen: 1\nname: stage\ninput_range: [0, 100]\n"
        f"model: {{pi: {{thresholds: {list(thresholds)}, weights: {list(weights)}}}}}\n"
    )
    found = hystgen.diagnose(stage, made[:3], holdout=made[3:], history=[100.0, 0.0])
    (effect,) = found.content["effects"]
    assert effect["name"] == name
    assert effect["parameters"][key] == pytest.approx(value, rel=0.02)


def test_no_name_beside_one_that_explains_far_more(monkeypatch: pytest.MonkeyPatch) -> None:
    """If the best effect is uncertain because few blocks show it, a certain one that explains far less is not named."""

    def step(*held_out: float) -> object:
        """Held-out error of the accepted effect or None; the first option is uncertain, the second certain."""
        tried = [SimpleNamespace(held_out=left) for left in held_out]
        worth = selection.Merit(1.0, 1.0, 0.5, 1e-6)
        monkeypatch.setattr(selection, "simplest_first", lambda found, _: found)
        monkeypatch.setattr(selection, "merit_of", lambda _, best, *__: None if best is tried[0] else worth)
        monkeypatch.setattr(selection, "removes", lambda *_: removes)
        records = SimpleNamespace(extensions=lambda *_: tried, gap=1.0)
        found = selection._step(object(), 1.0, records)  # type: ignore[arg-type]
        assert found is not None
        return None if found.merit is None else found.best.held_out

    removes = True
    assert step(0.287, 0.4167) is None
    assert step(0.35, 0.4167) == 0.4167
    removes = False  # the first option's gain is due to its free terms
    assert step(0.287, 0.4167) == 0.4167


ROOMS = (
    ("search.acceptance", "findings.kinds", "data.items"),
    ("data",),
    ("findings.result",),
    ("search",),
    ("findings",),
    ("run",),
)
"""The rooms of a diagnosis in order: a module may import from earlier rooms and its own."""


def _room(module: str) -> int:
    fitting = [(len(name), k) for k, names in enumerate(ROOMS) for name in names if f"{module}.".startswith(f"{name}.")]
    return max(fitting)[1]


def test_rooms_import_earlier_rooms_and_no_report() -> None:
    folder = Path(hystgen.__file__).parent / "diagnosis"
    for path in [*folder.glob("*/*.py"), folder / "run.py"]:
        module = ".".join(path.relative_to(folder).with_suffix("").parts)
        if path.name == "__init__.py":
            continue
        for node in ast.walk(ast.parse(path.read_text())):
            if not isinstance(node, ast.ImportFrom) or node.module is None:
                continue
            assert not node.module.startswith("hystgen.report"), path
            _, _, within = node.module.partition("hystgen.diagnosis.")
            for name in node.names if within else ():
                target = f"{within}.{name.name}" if "." not in within and within != "run" else within
                assert _room(target) <= _room(module), (path, target)


def test_ends_of_fitted_records_judge_too() -> None:
    """The ends of fitted records are held out once each, even if records have the same name."""

    def made(seed: int, name: str) -> Record:
        v = wander(seed)
        return record(v, noisy(brute_output(v, (0.0, 5.0), (1.0, 0.5), 0.0), 0.02), name)

    ready = preparing.prepare([made(1, "same"), made(2, "same")], [made(3, "other")], (0.0,), 0.0)
    more = preparing.with_ends(ready)
    assert more is not None
    for item, front, end in zip(ready.to_fit, more.to_fit, more.held[1:], strict=True):
        number = np.count_nonzero(item.known)
        assert np.count_nonzero(end.known) == pytest.approx(0.3 * number, abs=1)
        assert (front.known | end.known).tolist() == item.known.tolist()
        assert not (front.known & end.known).any()
    assert items.compared([*more.to_fit, *more.held]) == items.compared([*ready.to_fit, *ready.held])
    assert more.notes[-1].endswith("the last 30 % of each fitted record is held out too")
    assert preparing.with_ends(more) is None


@pytest.mark.slow
@pytest.mark.thorough
def test_what_only_the_fitted_records_show_is_no_noise(tmp_path: Path) -> None:
    """Another axis moves slowly during the fitted records, but not during the held-out one, which hardly moves."""
    records = []
    for number in (1, 2, 3):
        v = wander(number) if number < 3 else 49.5 + 0.01 * wander(number)
        moved = np.cumsum(np.random.default_rng(number).normal(0.0, 0.02, len(v))) if number < 3 else 0.0
        y = noisy(brute_output(v, (0.0, 10.0), (1.0, 0.5), 0.0), 0.02, number) + moved
        records.append(record(v, y, f"record {number}"))
    found = hystgen.diagnose(_model(tmp_path), records[:2], holdout=records[2], history=[0.0])
    assert found.content["gap"]["after"]["fit"] > 5.0 * found.content["noise_floor"]
    assert (found.verdict, found.content["effects"]) == ("unexplained", [])
    assert "rms remains on the fitted records" in found.sentence()
