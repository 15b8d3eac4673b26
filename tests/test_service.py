"""Units in service: false alarms, changes, what cannot be told, and models brought up to date.

The units are `plain_stage`, in plain loops, or the blind ones of `benchmarks.service`; neither shares code with the
package. Statistics are compared with scipy's two-sample t-test.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import cast
from unittest.mock import Mock

import jsonschema
import numpy as np
import pytest
import scipy.stats
from plain_stage import MODEL, drive, stage

import hystgen
from hystgen.basics.problems import RecordError
from hystgen.identification.pi import IdentificationError
from hystgen.records import Record
from hystgen.service import change, monitoring, sessions
from hystgen.service.sessions import Seen, ServiceSession

Run = Callable[..., tuple[int, str, str]]

RESIDUAL = "residual: {rms: 0.003, correlation: 0.01, samples: 1000}\n"


def coloured(rng: np.random.Generator, number: int, size: float) -> np.ndarray:
    """Noise with a memory of ten samples and a random walk."""
    white = rng.standard_normal((2, number))
    kernel = 0.9 ** np.arange(60)
    memory = np.convolve(white[0], kernel)[:number] * np.sqrt(1.0 - 0.81)
    return np.asarray(size * (memory + 3.0 * np.cumsum(white[1]) / number))


def session(seed: int, gain: float = 1.0, creep: float = 0.0, part: float = 1.0, name: str = "") -> Record:
    """A session of `plain_stage`; `part`: of its drive."""
    rng = np.random.default_rng(seed)
    v = [part * x for x in drive(seed, 900)]
    y = gain * np.array(stage(v, creep, 0.0, seed)) + coloured(rng, len(v), 0.004) + rng.uniform(-1.0, 1.0)
    u = np.array(stage(v, 0.0, 0.0, 10_000 + seed))
    return Record(name or f"s{seed:02d}.csv", 0.01 * np.arange(len(v)), np.array(v), y, {"u": u}, 0.01)


def model(text: str = MODEL + RESIDUAL) -> hystgen.Model:
    from hystgen.parameters.files import parse_parameters

    return hystgen.Model(parse_parameters(text))


def written(folder: Path, records: Sequence[Record]) -> list[Path]:
    """The records as CSV."""
    paths = []
    for each in records:
        table = np.column_stack([each.t, each.v, np.asarray(each.y), each.extra["u"]])
        paths.append(folder / each.name)
        np.savetxt(paths[-1], table, fmt="%.9g", delimiter=",", header="t,v,y,u", comments="")
    return paths


def made(parts: np.ndarray, size: float = 1.0, sure: float = 1e-9) -> list[ServiceSession]:
    """Sessions known by one direction alone, all with the same use of the drive."""
    use = np.array([0.0, 1.0, 0.0])
    return [
        cast(ServiceSession, SimpleNamespace(name=f"s{k}", seen={"gain": Seen(size, float(x), sure)}, use=use, rms=0.0))
        for k, x in enumerate(parts)
    ]


# The test of change --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(3))
def test_the_statistic_is_the_largest_of_two_sample_t_tests(seed: int) -> None:
    """Sessions of one size and negligible noise: the regression is Student's test at every split."""
    parts = np.random.default_rng(seed).standard_normal(9) + np.where(np.arange(9) < 5, 0.0, 2.0)
    (found,) = change.find(made(parts), None, 0.5)
    tests = [scipy.stats.ttest_ind(parts[k:], parts[:k]) for k in range(1, 9)]
    best = max(range(8), key=lambda k: abs(float(tests[k].statistic)))
    assert found.first == best + 1
    assert found.size / found.sure == pytest.approx(float(tests[best].statistic), rel=1e-6)
    assert found.size == pytest.approx(float(parts[best + 1 :].mean() - parts[: best + 1].mean()), rel=1e-6)
    assert found.p_value >= float(tests[best].pvalue), "a choice among splits counts"


@pytest.mark.parametrize("number", [3, 4, 8, 15])
def test_the_false_alarm_rate_is_the_stated_one(number: int) -> None:
    """Healthy scatter of unknown size, 400 sets: alarms at 10 % within the binomial 99.9 % range."""
    rng, rate, sets = np.random.default_rng(number), 0.1, 400
    alarms = 0
    for _ in range(sets):
        scatter = rng.uniform(0.1, 10.0)
        (found,) = change.find(made(0.3 + scatter * rng.standard_normal(number), sure=0.05), None, rate)
        alarms += found.p_value <= rate
    low, high = scipy.stats.binom.ppf([0.0005, 0.9995], sets, rate)
    assert low <= alarms <= high


def test_a_session_alone_is_judged_by_the_residual_of_identification() -> None:
    """A part is evidence as far as it exceeds twice that residual: p is the normal tail of the excess; of several
    sessions, half have to show it."""
    tail = 2.0 * float(scipy.stats.norm.sf(3.0))
    (found,) = change.find(made(np.array([0.5]), sure=0.1), 0.1, 0.01)
    assert found.p_value == pytest.approx(tail)
    (within,) = change.find(made(np.array([0.19]), sure=0.01), 0.1, 0.01)
    assert within.p_value == 1.0
    lasting = change.find(made(np.array([0.0, 0.5, 0.5, 0.5]), sure=0.05), 0.1, 0.01)
    (found,) = (each for each in lasting if each.against == "identification")
    assert found.first == 1
    odd = change.find(made(np.array([0.0, 9.0, 0.0, 0.0]), sure=0.1), 0.1, 0.01)
    (found,) = (each for each in odd if each.against == "identification")
    assert found.p_value == 1.0


def test_the_bound_of_a_residual_covers_its_truth() -> None:
    """The upper end for an rms from 12 samples is exceeded as often as stated."""
    from hystgen.parameters.schema import Residual

    rng, rate = np.random.default_rng(0), 0.05
    short = 0
    for _ in range(1000):
        rms = float(np.sqrt(np.mean(rng.standard_normal(12) ** 2)))
        bound = change.largest_residual(Residual(rms=rms, correlation=0.1, samples=12.0), rate)
        assert bound is not None
        short += bound < 1.0
    assert short <= scipy.stats.binom.ppf(0.999, 1000, rate)
    assert short >= scipy.stats.binom.ppf(0.001, 1000, rate)


# Units in service ----------------------------------------------------------------------------------------------


def test_a_healthy_unit_and_one_that_lost_gain() -> None:
    healthy = [session(k) for k in range(7)]
    found = hystgen.monitor(model(), healthy)
    assert (found.verdict, found.since, found.cause) == ("healthy", None, "")
    later = [session(10 + k, gain=0.95) for k in range(2)]
    found = hystgen.monitor(model(), [*healthy, *later], causes=False)
    best = found.clearest
    assert found.alarm
    assert found.since == "s10.csv"
    assert best is not None
    assert best.direction == "gain"
    assert best.interval[0] < -0.05 < best.interval[1]
    assert found.rms_then is not None
    assert found.tracking_then is not None
    assert found.tracking_now is not None
    assert found.rms_now > 5.0 * found.rms_then
    assert found.tracking_now > 5.0 * found.tracking_then
    jsonschema.validate(json.loads(found.to_json()), monitoring.schema())


def test_new_creep_is_named_by_the_diagnosis(tmp_path: Path) -> None:
    """The cause is in the diagnosis' words, on the page and in the JSON."""
    records = [*(session(k) for k in range(2)), *(session(k, creep=0.03) for k in (20, 21))]
    found = hystgen.monitor(model(), records)
    assert found.since == "s20.csv"
    assert [each.name for each in found.effects] == ["creep"]
    paths = found.write(tmp_path / "out")
    assert [each.name for each in paths] == ["monitor.json", "report.html"]
    content = json.loads(paths[0].read_text())
    jsonschema.validate(content, monitoring.schema())
    assert content["effects"][0]["name"] == "creep"
    page = paths[1].read_text()
    assert "creep" in page
    assert "s20.csv" in page
    assert found.write(tmp_path / "out") == paths
    assert paths[1].read_text() == page, "the same bytes"


def test_one_session_is_compared_with_identification() -> None:
    assert hystgen.monitor(model(), session(1), causes=False).verdict == "healthy"
    found = hystgen.monitor(model(), session(1, gain=0.93), causes=False)
    assert found.since == "s01.csv"
    assert found.rms_then == found.residual
    with pytest.raises(RecordError, match=r"s01.csv is left out: only \d+ samples can be compared.*--history"):
        hystgen.monitor(model(), session(1).section(0, 99))
    with pytest.raises(RecordError, match=r"cannot show a change.*identify again"):
        hystgen.monitor(model(MODEL), session(1, gain=0.93))


def test_another_use_of_the_unit_is_not_a_change() -> None:
    """A model that misses a saturating motion differs for small moves; that is misfit, and the page says what would
    tell."""

    def bent(seed: int, part: float) -> Record:
        each = session(seed, part=part)
        y = np.asarray(each.y)
        y = y - 0.004 * (y - y.min()) ** 2
        return Record(each.name, each.t, each.v, y, each.extra, each.sample_time)

    records = [*(bent(k, 1.0) for k in range(5)), *(bent(10 + k, 0.5) for k in range(5))]
    found = hystgen.monitor(model(MODEL), records, causes=False)
    assert found.verdict == "untold"
    assert "differ from those before" in found.sentence()
    assert any("reference of s04.csv" in text for text in found.advice())


@pytest.mark.parametrize(
    "sets", [pytest.param(4, id="few"), pytest.param(300, id="all", marks=pytest.mark.slow)]
)
def test_blind_healthy_units(sets: int) -> None:
    """False alarms of units with relays or a differential equation, whose models miss some of their motion."""
    from benchmarks import service

    rate = 0.05
    found = [service.healthy(40_000 + k, 5 if sets < 300 else None) for k in range(sets)]
    for which in ("p", "p_without_residual", "p_first_session"):
        assert sum(float(str(each[which])) <= rate for each in found) <= scipy.stats.binom.ppf(0.999, sets, rate)


def test_sessions_are_put_in_order() -> None:
    """By `recorded_at`, by dates in names, by time, or as given."""
    plain = [session(k) for k in range(3)]
    moments = [
        Record(each.name, each.t, each.v, each.y, {**each.extra, "recorded_at": np.full(len(each), 3.0 - k)}, 0.01)
        for k, each in enumerate(plain)
    ]
    ordered, why = sessions.in_order(moments, moments)
    assert ([each.name for each in ordered], why) == (["s02.csv", "s01.csv", "s00.csv"], "column recorded_at")
    names = ["x_2026-11-30.csv", "x_2026-02-01T1200.csv", "x_20260201-0730.csv"]
    ordered, why = sessions.in_order(plain, names)
    assert ([each.name for each in ordered], why) == (["s02.csv", "s01.csv", "s00.csv"], "dates in the file names")
    later = [Record(each.name, each.t - 100.0 * k, each.v, each.y, {}, 0.01) for k, each in enumerate(plain)]
    ordered, why = sessions.in_order(later, later)
    assert ([each.name for each in ordered], why) == (["s02.csv", "s01.csv", "s00.csv"], "times of the records")
    assert sessions.in_order(plain, plain) == (plain, "order in which they were given")


# The model brought up to date ----------------------------------------------------------------------------------


def test_refining_finds_the_new_gain_and_refuses_what_is_not_shown() -> None:
    """A unit that lost 6 %: one factor, whose interval holds the truth; small moves show no weight."""
    found = hystgen.monitor(model(), [session(k, gain=0.94) for k in range(3)], causes=False)
    refined = found.refine()
    (gain,) = refined.numbers
    assert gain.moved
    assert gain.interval[0] < 0.94 < gain.interval[1]
    assert gain.interval[1] - gain.interval[0] < 0.01
    assert refined.after < 0.2 * refined.before
    assert refined.parameters.model.pi.weights[0] == pytest.approx(0.094, rel=0.01)
    small = hystgen.monitor(model(), session(1, part=0.01), causes=False)
    with pytest.raises(IdentificationError, match=r"1 % of the input range at most; record .* over the whole range"):
        small.refine()


def test_refining_finds_a_weight_of_its_own() -> None:
    """A unit whose stop at 12 V went soft: that weight moves, and intervals hold the truth for the others."""
    records = []
    for k in range(3):
        each = session(k)
        stretch, before, lost = 0.0, 0.0, []
        for x in each.v.tolist():  # the play at 12 V is the drive minus its stop
            stretch, before = max(-12.0, min(12.0, stretch + x - before)), x
            lost.append(0.01 * (x - stretch))
        records.append(Record(each.name, each.t, each.v, np.asarray(each.y) - lost, each.extra, 0.01))
    refined = hystgen.monitor(model(), records, causes=False).refine()
    truth = {"weight at r = 0": 0.1, "weight at r = 5": 0.02, "weight at r = 12": 0.005, "weight at r = 25": 0.01}
    assert {each.name for each in refined.numbers} == set(truth)
    for each in refined.numbers:
        assert each.interval[0] <= truth[each.name] <= each.interval[1]
    assert {each.name for each in refined.numbers if each.moved} >= {"weight at r = 12"}


# The command ---------------------------------------------------------------------------------------------------


def test_the_command(tmp_path: Path, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """Exit codes for cron, the files, and nothing half-written; without the diagnosis, which takes most of the time."""
    monkeypatch.setattr(monitoring, "diagnose", Mock(side_effect=IdentificationError("short")))
    file = tmp_path / "stage.yaml"
    file.write_text(MODEL + RESIDUAL)
    healthy = written(tmp_path, [session(k) for k in range(3)])
    code, out, _ = run("monitor", file, *healthy, "-q")
    assert (code, out) == (0, "")
    lost = written(tmp_path, [session(10 + k, gain=0.94) for k in range(2)])
    new, content = tmp_path / "new.yaml", tmp_path / "monitor.json"
    code, out, _ = run("monitor", file, *healthy, *lost, "--json", content, "--refine", new)
    assert code == 1
    assert "since s10.csv" in out
    assert "too short for a diagnosis" in out
    assert "gain (all weights)" in out
    jsonschema.validate(json.loads(content.read_text()), monitoring.schema())
    assert hystgen.load(new).parameters.model.pi.weights[0] == pytest.approx(0.094, rel=0.01)
    assert hystgen.monitor(new, lost, causes=False).verdict == "healthy"
    (small,) = written(tmp_path, [session(30, part=0.01)])
    code, _, err = run("monitor", file, small, "--refine", tmp_path / "other.yaml")
    assert code == 2
    assert "show no parameter" in err
    assert err.count("error") == 1
    assert not os.path.exists(tmp_path / "other.yaml")
    file.write_text(MODEL)
    code, _, err = run("monitor", file, lost[0])
    assert code == 2
    assert f"{lost[0].name}: error: 1 session cannot show a change" in err
    code, _, err = run("monitor", file, *lost, "--false-alarms", "1")
    assert code == 2
    assert "between 0 and 1" in err


def test_the_schema_is_printed(run: Run) -> None:
    code, out, _ = run("schema", "--monitor")
    assert code == 0
    jsonschema.Draft202012Validator.check_schema(json.loads(out))
    assert run("schema", "--monitor", "--manifest")[0] == 2
