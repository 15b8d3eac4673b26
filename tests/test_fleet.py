"""Identification of a fleet of units in one call: files written, outliers marked, and failures that it survives."""

from __future__ import annotations

import csv
import functools
import html
import json
import os
import re
import shutil
import signal
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from recordings import brute_output, noisy, wander, write_csv

import hystgen
from hystgen import identification
from hystgen.basics import extras
from hystgen.fleet import batch, outliers, workers
from hystgen.fleet.batch import FIGURES, KEPT_IN
from hystgen.fleet.workers import Task, UnitResult

pytestmark = pytest.mark.thorough

Run = Callable[..., tuple[int, str, str]]

SOUND = 16
ODD = "SN-103"
DISTURBED = "SN-109"
SPOILT = {"garbage.csv": "no measurement\n1;2\n", "nothing.csv": ""}
R = (0.0, 5.0, 10.0, 20.0, 35.0)
P = np.array([0.3, 0.1, 0.1, 0.05, 0.04])


def plant(k: int, samples: int = 20) -> tuple[Any, Any]:
    """Drive and output of a unit, whose weights differ a little from those of other units."""
    weights = P * np.random.default_rng(500 + k).normal(1.0, 0.03, len(P))
    v = wander(k, turns=30, samples=samples)
    return v, noisy(brute_output(v, R, weights, 0.0), 0.05, seed=k)


def make_units(folder: Path, number: int, spoilt: bool = True) -> Path:
    """Recordings of units; larger fleets include a worn plant and a noisy record."""
    folder.mkdir(parents=True)
    for k in range(number):
        v, y = plant(k)
        name = f"SN-{100 + k}"
        if name == ODD:
            y = brute_output(v, R, [0.3, 0.1, 0.1, 0.05, 0.34], 0.0)
        if name == DISTURBED:
            y = noisy(y, 0.5)
        write_csv(folder / f"{name}.csv", v, y)
    for file, text in (SPOILT if spoilt else {}).items():
        (folder / file).write_text(text)
    return folder


def tree(folder: Path) -> dict[str, bytes]:
    """Every file below a folder, hidden ones too, with its bytes."""
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def rows(folder: Path) -> dict[str, dict[str, str]]:
    with (folder / "summary.csv").open(newline="") as stream:
        return {row["unit"]: row for row in csv.DictReader(stream)}


def by_hand(values: list[float]) -> list[float]:
    """Modified z-scores, computed with the standard library alone."""
    middle = statistics.median(values)
    mad = statistics.median(abs(x - middle) for x in values)
    return [0.6745 * (x - middle) / mad for x in values]


@pytest.fixture(scope="module")
def units(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_units(tmp_path_factory.mktemp("fleet") / "units", SOUND)


@pytest.fixture(scope="module")
def fleet(units: Path) -> Path:
    """Results of a single process that identifies the units one after another."""
    folder = units.parent / "params"
    hystgen.identify_batch(units / "*.csv", folder, jobs=1)
    return folder


@pytest.fixture
def few(tmp_path: Path) -> Path:
    return make_units(tmp_path / "few", 3, spoilt=False)


# -- what is written ---------------------------------------------------------------------------------------------------


def test_the_command(units: Path, fleet: Path, tmp_path: Path, run: Run) -> None:
    """Two processes write the same bytes as one, and the command the same as the Python call."""
    output, report = tmp_path / "new" / "params", tmp_path / "report"
    code, out, err = run("identify", "--batch", units / "*.csv", "-o", output, "--jobs", 2, "--report", report)
    assert (code, out.split()) == (1, [str(output / "summary.csv"), str(report / "report.html")])
    page = (report / "report.html").read_text()
    assert page.count("data:image/svg+xml") == 4
    shown = json.loads(html.unescape(re.findall(r'data-viewer="([^"]*)"', page)[0]))["records"]
    assert [(each["name"], each["role"]) for each in shown[:2]] == [("SN_103", "outlier"), ("SN_109", "outlier")]
    assert [each["role"] for each in shown[2:]] == ["typical unit"]
    assert f"hystgen identify {units / 'garbage.csv'} -o garbage.yaml" in page
    for name in ("units", "loops"):
        assert (report / f"{name}.svg").read_text().count("<path") > SOUND
    assert tree(output) == tree(fleet)
    printed = err.splitlines()
    table = rows(output)
    marked = {name: row["outlier_in"] for name, row in table.items() if row["outlier"] == "yes"}
    assert printed[0] == (
        f"{SOUND + 2} units: {SOUND} done (0 by an earlier call), {len(marked)} of them outliers; 2 failed"
    )
    failed = [["failed", name, *table[name]["message"].split()] for name in ("garbage", "nothing")]
    assert [line.split() for line in printed[1:-1]] == [
        *failed, *(["outlier", name, *words.split()] for name, words in marked.items())
    ]  # fmt: skip
    assert printed[-1] == f"error: 2 of {SOUND + 2} units failed"


@pytest.mark.parametrize("stem", ["SN-100", ODD])
def test_every_unit_has_the_bytes_of_a_single_run(
    stem: str, units: Path, fleet: Path, tmp_path: Path, run: Run
) -> None:
    name = stem.replace("-", "_")
    assert run("identify", units / f"{stem}.csv", "-o", tmp_path / f"{name}.yaml")[0] == 0
    assert run("emit", tmp_path / f"{name}.yaml", "-o", tmp_path / name)[0] == 0
    alone = tree(tmp_path)
    assert len(alone) == 5
    assert alone == {file: data for file, data in tree(fleet).items() if file.startswith(name)}


def test_summary(units: Path, fleet: Path) -> None:
    table = rows(fleet)
    assert list(table) == sorted(table)
    assert len(table) == SOUND + len(SPOILT)
    assert {name: row["status"] for name, row in table.items() if row["status"] != "done"} == {
        "garbage": "failed", "nothing": "failed",
    }  # fmt: skip
    assert table["nothing"]["message"] == f"{units}/nothing.csv: error: is empty; record again, or give another file"
    assert table["garbage"]["message"].startswith(f"{units}/garbage.csv:2:1: error: the first line has numbers, ")
    row, fit = table["SN_100"], hystgen.identify(units / "SN-100.csv")
    every = {r.part: r for r in fit.rows if r.model == "written" or r.part == "held out"}
    part = fit.parameters.model.pi
    low, high = fit.parameters.input_range
    swept = brute_output(np.array([low, high]), part.thresholds, part.weights, 0.0)
    expected = {
        "plays": len(part.thresholds) - 1,
        "p_0": part.weights[0],
        "width": 2.0 * np.dot(part.thresholds, part.weights) / sum(part.weights),
        "gain": (swept[1] - swept[0]) / (high - low),
        "fit_rms": every["all"].rms,
        "fit_rms_percent": every["all"].rms_percent,
        "held_out_rms": every["held out"].rms,
        "held_out_rms_percent": every["held out"].rms_percent,
        "warnings": len(fit.warnings),
    }
    assert row["kind"] == "pi"
    assert row["file"] == str(units / "SN-100.csv")
    for name, value in expected.items():
        assert float(row[name]) == pytest.approx(value, rel=1e-5), name
    assert len({r["sha256"] for r in table.values()}) == len(table)


def test_outliers_by_hand_with_the_planted_ones_among_them(fleet: Path) -> None:
    done = {name: row for name, row in rows(fleet).items() if row["status"] == "done"}
    expected: dict[str, set[str]] = {}
    for words, column in (("held-out rms %", "held_out_rms_percent"), ("gain",) * 2, ("width",) * 2, ("p_0",) * 2):
        values = [float(row[column]) for row in done.values()]
        values = [float(np.log(x)) for x in values] if column.endswith("percent") else values
        for name, score in zip(done, by_hand(values), strict=True):
            if score > 3.5 or (score < -3.5 and column != "held_out_rms_percent"):
                expected.setdefault(name, set()).add(f"{words} {float(done[name][column]):.4g} (z {score:+.1f})")
    assert {"SN_103", "SN_109"} <= set(expected)
    assert len(expected) < SOUND // 4
    assert any(words.startswith("width") for words in expected["SN_103"])
    assert any(words.startswith("held-out") for words in expected["SN_109"])
    for name, row in done.items():
        assert row["outlier"] == ("yes" if name in expected else "no")
        printed = {part.rsplit(" (z ", 1)[0] for part in row["outlier_in"].split("; ")} - {""}
        assert printed == {part.rsplit(" (z ", 1)[0] for part in expected.get(name, ())}


def test_the_page_of_units_that_are_not_judged_or_all_failed(few: Path, tmp_path: Path) -> None:
    found = hystgen.identify_batch(few, tmp_path / "params", emit=False, jobs=1)
    page = hystgen.report_fleet(found, tmp_path / "report")
    assert "outliers are judged only with 8 or more" in page.read_text()
    (tmp_path / "bad").mkdir()
    (tmp_path / "bad" / "a.csv").write_text("")
    failed = hystgen.identify_batch(tmp_path / "bad", tmp_path / "none", emit=False, jobs=1)
    page = hystgen.report_fleet(failed, tmp_path / "second")
    assert "0 units identified" in page.read_text()
    assert [path.name for path in page.parent.iterdir()] == ["report.html"]


def test_few_units_are_not_judged(few: Path, tmp_path: Path, run: Run) -> None:
    """A pattern that the shell expands to several files gives the same result as their folder."""
    code, _, err = run("identify", "--batch", *sorted(few.iterdir()), "-o", tmp_path / "a", "--no-emit")
    assert code == 0
    assert "outliers are marked only with 8 or more units" in err
    assert {row["outlier"] for row in rows(tmp_path / "a").values()} == {"not judged"}
    assert not (tmp_path / "a" / "SN_100").exists()
    assert run("identify", "--batch", few, "-o", tmp_path / "b", "--no-emit", "--jobs", 1)[0] == 0
    assert tree(tmp_path / "a") == tree(tmp_path / "b")


def test_held_out_records_by_name(few: Path, tmp_path: Path, run: Run) -> None:
    for k in range(2):
        write_csv(few / f"SN-{100 + k}_later.csv", *plant(k, samples=12))
    output = tmp_path / "params"
    code, _, err = run("identify", "--batch", few, "-o", output, "--holdout", few / "{unit}_later.csv", "--jobs", 1)
    assert code == 1
    assert "SN-102_later.csv: error: cannot be read" in err
    assert {name: row["status"] for name, row in rows(output).items()} == {
        "SN_100": "done", "SN_101": "done", "SN_102": "failed",
    }  # fmt: skip
    single = tmp_path / "SN_101.yaml"
    assert run("identify", few / "SN-101.csv", "--holdout", few / "SN-101_later.csv", "-o", single)[0] == 0
    assert single.read_bytes() == (output / "SN_101.yaml").read_bytes()


def test_a_unit_without_an_inverse_has_parameters_and_a_reason(few: Path, tmp_path: Path, run: Run) -> None:
    v = wander(1, turns=30, samples=20)
    write_csv(few / "SN-101.csv", v, brute_output(v, R, [0.0, 0.3, 0.1, 0.05, 0.04], 0.0))
    code, _, err = run("identify", "--batch", few, "-o", tmp_path / "a", "--jobs", 1)
    assert code == 1
    assert "fitted, but not emitted: no inverse: " in err
    row = rows(tmp_path / "a")["SN_101"]
    assert (row["status"], row["outlier"]) == ("failed", "")
    assert float(row["p_0"]) == 0.0
    assert (tmp_path / "a" / "SN_101.yaml").is_file()
    assert run("identify", "--batch", few, "-o", tmp_path / "b", "--jobs", 1, "--no-emit")[0] == 0


def test_what_nobody_expected_stops_no_other(few: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fit = identification.identify

    def broken(records: Any, *, name: str, **options: Any) -> Any:
        if name == "SN_101":
            raise ZeroDivisionError("oh\nno")
        return fit(records, name=name, **options)

    monkeypatch.setattr(identification, "identify", functools.wraps(fit)(broken))
    done = hystgen.identify_batch(few, tmp_path / "params", jobs=1)
    assert [(unit.name, unit.message) for unit in done.failed] == [
        ("SN_101", "unexpected ZeroDivisionError: oh (and 1 more)")
    ]
    assert len(done.units) == 3


# -- resuming ----------------------------------------------------------------------------------------------------------


def redone(folder: Path, again: Callable[[], Any]) -> set[str]:
    """Units whose parameter files a call rewrites."""
    before = {path.stem: path.stat().st_ino for path in folder.glob("*.yaml")}
    held = [path.open() for path in folder.glob("*.yaml")]  # so that no inode is reused
    again()
    for stream in held:
        stream.close()
    return {path.stem for path in folder.glob("*.yaml") if before.get(path.stem) != path.stat().st_ino}


def test_only_what_changed_is_done_again(few: Path, tmp_path: Path) -> None:
    folder = tmp_path / "params"

    def call(**options: Any) -> None:
        assert not hystgen.identify_batch(few, folder, jobs=1, **options).failed

    assert redone(folder, call) == {"SN_100", "SN_101", "SN_102"}
    first = tree(folder)
    assert redone(folder, call) == set()
    assert tree(folder) == first
    (folder / "SN_101" / "SN_101.h").unlink()
    assert redone(folder, call) == {"SN_101"}
    (folder / "SN_102" / "SN_102.c").write_text("edited")
    assert redone(folder, call) == {"SN_102"}
    (folder / "SN_100.yaml").unlink()
    assert redone(folder, call) == {"SN_100"}
    (folder / ".hystgen" / "SN_100.json").write_text("{}")
    assert redone(folder, call) == {"SN_100"}
    assert tree(folder) == first
    assert redone(folder, lambda: call(thresholds=5)) == {"SN_100", "SN_101", "SN_102"}
    assert redone(folder, lambda: call(thresholds=5, emission={"operator": "both"})) == {"SN_100", "SN_101", "SN_102"}
    assert redone(folder, call) == {"SN_100", "SN_101", "SN_102"}
    assert tree(folder) == first
    write_csv(few / "SN-101.csv", *plant(77))
    assert redone(folder, call) == {"SN_101"}
    assert tree(folder).keys() == first.keys()
    write_csv(few / "SN-101.csv", *plant(1))
    assert redone(folder, call) == {"SN_101"}
    assert tree(folder) == first


UNREADABLE: dict[str, Callable[[Path], object]] = {
    "empty": lambda note: note.write_bytes(b""),
    "cut off": lambda note: os.truncate(note, note.stat().st_size // 2),
    "binary": lambda note: note.write_bytes(bytes(range(256))),
    "nested": lambda note: note.write_text("[" * 100_000),
    "a list": lambda note: note.write_text("[1, 2]"),
    "no figures": lambda note: spoil(note, figures=None),
    "figures of another kind": lambda note: spoil(note, figures=[1, 2]),
    "few figures": lambda note: spoil(note, figures={"gain": 1.0}),
    "figures that are text": lambda note: spoil(note, figures=dict.fromkeys(FIGURES, "1.0")),
    "outputs of another kind": lambda note: spoil(note, outputs=["a"]),
    "no key": lambda note: spoil(note, sha256=7),
    "a folder": lambda note: (note.unlink(), note.mkdir(), (note / "x").mkdir()),
}


def spoil(note: Path, **changed: Any) -> None:
    note.write_text(json.dumps({**json.loads(note.read_text()), **changed}))


@pytest.mark.parametrize("kind", UNREADABLE)
def test_notes_that_cannot_be_read_are_one_warning(kind: str, few: Path, tmp_path: Path, run: Run) -> None:
    output = tmp_path / "params"
    words = ("identify", "--batch", few, "-o", output, "--jobs", "1")
    assert run(*words)[0] == 0
    whole = tree(output)
    notes = sorted((output / KEPT_IN).iterdir())
    for note in notes[:2]:
        UNREADABLE[kind](note)
    code, _, err = run(*words)
    if kind == "a folder":  # a file cannot replace a folder
        assert (code, err.count(" cannot be written: ")) == (1, 2)
        return
    assert code == 0
    assert err.count("warning") == 1
    assert f"warning: {notes[0]} cannot be read, and 1 more; these units are fitted again" in err
    assert "(1 by an earlier call)" in err
    assert tree(output) == whole


def test_another_version_of_the_tool_does_all_again(few: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    hystgen.identify_batch(few, tmp_path / "params", jobs=1)
    monkeypatch.setattr(batch, "__version__", "9")
    done = hystgen.identify_batch(few, tmp_path / "params", jobs=1)
    assert not any(unit.kept for unit in done.units)


def test_a_worker_of_another_version_is_reported(few: Path) -> None:
    task = Task("a", (("a.csv", (few / "SN-100.csv").read_bytes()),), (), {}, None, version="0.0.1")
    assert workers.fit_unit(task).message == (
        f"the worker has hystgen {hystgen.__version__}, not 0.0.1; install the same version"
    )


@pytest.mark.slow(one_in=3)
@pytest.mark.parametrize(
    ("sent", "jobs"),
    [(signal.SIGINT, 2), (signal.SIGINT, 1), (signal.SIGKILL, 1)],
    ids=["Ctrl-C", "Ctrl-C-alone", "kill"],
)
def test_interrupted(sent: signal.Signals, jobs: int, units: Path, fleet: Path, tmp_path: Path) -> None:
    output = tmp_path / "params"
    command = [sys.executable, "-m", "hystgen.cli", "identify", "--batch", str(units), "-o", str(output)]
    process = subprocess.Popen(
        [*command, "--jobs", str(jobs)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        start_new_session=True, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip
    while process.poll() is None and len(list(output.glob(".hystgen/*.json"))) < 3:
        time.sleep(0.01)
    stopped = time.monotonic()
    os.killpg(process.pid, sent)
    out, err = process.communicate(timeout=30)
    assert out == ""
    if sent == signal.SIGINT:
        assert process.returncode == 130
        assert err == "interrupted; finished units are kept, and the same command resumes from there\n"
        assert time.monotonic() - stopped < 10.0
    whole = tree(fleet)
    found = {name: data for name, data in tree(output).items() if not Path(name).parts[-1].startswith(".hystgen-")}
    assert 3 * 6 <= len(found) < len(whole)
    assert found.items() <= whole.items(), "what is there is complete"
    kept = len(list(output.glob(".hystgen/*.json")))
    done = hystgen.identify_batch(units, output, jobs=1)
    assert sum(unit.kept for unit in done.units) == kept
    assert tree(output) == whole


# -- processes that die, and a cluster ---------------------------------------------------------------------------------


def deadly(task: Task) -> UnitResult:
    """Work that kills the process for one unit."""
    if task.unit == "u2":
        os.kill(os.getpid(), signal.SIGKILL)
    return UnitResult(task.unit)


def test_a_unit_that_kills_its_process_stops_no_other() -> None:
    tasks = (Task(f"u{k}", (), (), {}, None) for k in range(9))
    answers = {result.unit: result.message for result in workers.on_this_machine(tasks, 2, deadly)}
    assert answers.pop("u2") == workers.DIED
    assert answers == {f"u{k}": "" for k in range(9) if k != 2}


def interrupted(task: Task) -> UnitResult:
    """Work interrupted by Ctrl-C, which reaches every process of a terminal."""
    os.kill(os.getpid(), signal.SIGINT)
    return UnitResult(task.unit, "done")


def test_processes_leave_ctrl_c_to_the_one_that_started_them() -> None:
    tasks = (Task(f"u{k}", (), (), {}, None) for k in range(5))
    answers = {result.unit: result.message for result in workers.on_this_machine(tasks, 2, interrupted)}
    assert answers == {f"u{k}": "done" for k in range(5)}


def test_what_is_given_up_is_given_up_silently(recwarn: pytest.WarningsRecorder) -> None:
    results = workers.on_this_machine((Task(f"u{k}", (), (), {}, None) for k in range(50)), 2, interrupted)
    next(results)
    results.close()
    assert [str(warning.message) for warning in recwarn] == []


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    from distributed import LocalCluster

    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as started:
        yield started


def test_a_cluster_of_which_a_worker_dies(
    cluster: Any, units: Path, fleet: Path, tmp_path: Path, run: Run
) -> None:
    """With a scheduler's address, the same command writes the same bytes even though a worker dies."""
    from distributed import Client

    output = tmp_path / "params"
    died = []

    def kill_one() -> None:
        with Client(cluster.scheduler_address, set_as_default=False) as client:
            pids = list(client.run(os.getpid).values())
            while len(list(output.glob(".hystgen/*.json"))) < 2:
                time.sleep(0.01)
            os.kill(pids[0], signal.SIGKILL)
            died.append(len(list(output.glob(".hystgen/*.json"))))

    killer = threading.Thread(target=kill_one, daemon=True)
    killer.start()
    words = ("identify", "--batch", units / "*.csv", "-o", output, "--scheduler", cluster.scheduler_address)
    code, _, err = run(*words)
    killer.join(timeout=20)
    assert (code, len(died)) == (1, 1)
    assert died[0] < SOUND, "it died while units were left"
    assert f"{SOUND} done (0 by an earlier call)" in err
    assert tree(output) == tree(fleet)
    assert f"{SOUND} done ({SOUND} by an earlier call)" in run(*words)[2]


def test_a_scheduler_that_is_not_there(
    few: Path, tmp_path: Path, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(workers, "PATIENCE", 0.5)
    for address in ("tcp://127.0.0.1:1", "nonsense", "tls://127.0.0.1:1", "http://127.0.0.1:1"):
        code, out, err = run("identify", "--batch", few, "-o", tmp_path / "params", "--scheduler", address)
        assert (code, out) == (2, "")
        assert err.startswith(f"error: no Dask scheduler answers at {address}: ")
        assert len(err.splitlines()) == 1
    assert not (tmp_path / "params").exists()


def test_nothing_more_is_said_of_a_scheduler_when_the_program_ends(few: Path, tmp_path: Path) -> None:
    words = ["identify", "--batch", str(few), "-o", str(tmp_path / "params"), "--scheduler", "tls://127.0.0.1:1"]
    program = f"from hystgen.fleet import workers; from hystgen.cli import main; workers.PATIENCE = 0.5; main({words})"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert len(done.stderr.splitlines()) == 1, done.stderr


def test_a_scheduler_that_dies_is_one_message(units: Path, tmp_path: Path) -> None:
    """The tracebacks that Dask logs are not shown."""
    output = tmp_path / "params"
    code = (
        "import os, sys\n"
        "from distributed import LocalCluster\n"
        "if __name__ == '__main__':\n"
        "    with LocalCluster(n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:\n"
        "        print(cluster.scheduler_address, flush=True)\n"
        "        sys.stdin.read()\n"
    )
    (tmp_path / "cluster.py").write_text(code)
    cluster = subprocess.Popen(
        [sys.executable, str(tmp_path / "cluster.py")], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL, text=True, start_new_session=True,
    )  # fmt: skip
    assert cluster.stdout is not None
    address = cluster.stdout.readline().strip()
    words = ["identify", "--batch", str(units), "-o", str(output), "--scheduler", address]
    started = subprocess.Popen(
        [sys.executable, "-m", "hystgen", *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    while started.poll() is None and len(list(output.glob(".hystgen/*.json"))) < 2:
        time.sleep(0.01)
    os.killpg(cluster.pid, signal.SIGKILL)
    cluster.communicate()
    out, err = started.communicate(timeout=120)
    assert (started.returncode, out) == (2, "")
    assert err == "error: the Dask scheduler was lost; the same command resumes from here\n"


def test_without_dask_one_line_says_what_to_install(
    few: Path, tmp_path: Path, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    code, _, err = run("identify", "--batch", few, "-o", tmp_path / "params", "--scheduler", "tcp://127.0.0.1:1")
    assert (code, err) == (2, f"error: a scheduler needs Dask; install it with: {extras.install('fleet')}")


# -- usage -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "printed"),
    [
        (["--batch", "none/*.csv", "-o", "new"], "no file matches none/*.csv"),
        (["--batch", "few", "--batch", "none.csv", "-o", "new"], "no file matches none.csv"),
        (["--batch", "clash", "-o", "new"], "clash/a-1.csv and clash/a_1.csv would both be unit a_1; rename one"),
        (["--batch", "few", "-o", "new", "--holdout", "few/SN-100.csv"], "write {unit} for the unit's name"),
        (["--batch", "few", "-o", "few"], "few contains records"),
        (["--batch", "few", "-o", "few/SN-100.csv"], "few/SN-100.csv: File exists"),
        (["--batch", "few", "-o", "new", "--thresholds", "-1"], "thresholds must be a number of plays"),
        (["--batch", "few", "-o", "new", "--name", "stage"], "--name is for one model"),
        (["--batch", "few", "-o", "new", "--plot", "a.svg"], "--plot is for one model"),
        (["--batch", "few", "-o", "new", "--jobs", "0"], "--jobs"),
        (["few/SN-100.csv", "-o", "a.yaml", "--no-emit"], "--emit is for many units"),
        (["few/SN-100.csv", "-o", "a.yaml", "--jobs", "2"], "--jobs is for many units"),
        (["few/SN-100.csv", "-o", "few"], "is a folder; give the file"),
        (["-o", "a.yaml"], "Missing argument"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_usage(words: list[str], printed: str, few: Path, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(few.parent)
    Path("clash").mkdir()
    for name in ("a-1.csv", "a_1.csv", "b.csv"):
        shutil.copy(few / "SN-100.csv", Path("clash") / name)
    before = tree(few.parent)
    code, out, err = run("identify", *words)
    assert (code, out) == (2, "")
    assert printed in err
    assert "Traceback" not in err
    assert tree(few.parent) == before
    assert not Path("new").exists()


@pytest.mark.parametrize(
    "options", [{"tresholds": 3}, {"name": "a"}, {"model": "preisach"}, {"jobs": 0}, {"skip": -1}], ids=str
)
def test_arguments(options: dict[str, Any], few: Path, tmp_path: Path) -> None:
    with pytest.raises((TypeError, ValueError), match=next(iter(options))):
        hystgen.identify_batch(few, tmp_path / "params", **options)
    assert not (tmp_path / "params").exists()


# -- the measure -------------------------------------------------------------------------------------------------------


def test_modified_scores() -> None:
    # Median 4, deviations 3 2 1 0 1 2 96: MAD 2
    assert outliers.modified_scores([1, 2, 3, 4, 5, 6, 100]) == pytest.approx(
        [0.6745 * x / 2.0 for x in (-3, -2, -1, 0, 1, 2, 96)]
    )
    # Most values are equal, so MAD is 0: mean absolute deviation 1, sqrt(2/pi) = 0.797885
    assert outliers.modified_scores([5.0] * 9 + [15.0]) == pytest.approx([0.0] * 9 + [7.97885], abs=1e-4)
    assert outliers.modified_scores([2.0] * 8) == [0.0] * 8
    assert outliers.modified_scores([2.0, 2.0 + 1e-12] * 4) == [0.0] * 8
    normal = np.random.default_rng(3).normal(20.0, 3.0, 20001)
    assert np.std(outliers.modified_scores(normal.tolist())) == pytest.approx(1.0, abs=0.02)


def test_a_figure_that_is_missing_or_perfect_is_no_outlier() -> None:
    figures = {"gain": 1.0, "width": 2.0, "p_0": 0.5}
    errors = [None, 1e-14, 3e-11, 0.0, 1e-9, 1e-12, 0.0, 1e-13, 1e-10]
    assert outliers.find({f"u{k}": {**figures, "held_out_rms_percent": x} for k, x in enumerate(errors)}) == {}
    assert outliers.find({f"u{k}": figures for k in range(outliers.FEWEST - 1)}) is None
