"""What `identify` says about its model: the next step, and the exit code with `--strict`."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import hystgen
from hystgen.identification import UselessError

Array = NDArray[np.float64]
Run = Callable[..., tuple[int, str, str]]

T = np.arange(3000) * 0.005
DRIVE = 50.0 + 30.0 * np.sin(3.0 * T) + 20.0 * np.sin(11.0 * T + 1.0)


def backlashes(v: Array) -> Array:
    """Twelve backlashes side by side, sample by sample."""
    reach, held, y = np.linspace(0.5, 30.0, 12), [0.0] * 12, np.empty(len(v))
    for k, x in enumerate(v.tolist()):
        held = [min(max(s, x - r), x + r) for s, r in zip(held, reach, strict=True)]
        y[k] = 0.09 * x + sum(held) * 0.08 / 12
    return y


def lagged(v: Array, share: float = 0.15) -> Array:
    y, x = np.empty(len(v)), v[0]
    for k, drive in enumerate(v):
        x += share * (drive - x)
        y[k] = x
    return y


def noise(deviation: float) -> Array:
    return np.asarray(deviation * np.random.default_rng(1).standard_normal(len(T)))


RECORDS: dict[str, tuple[Array, Array, str, bool]] = {
    "good": (DRIVE, backlashes(DRIVE) + noise(0.01), "good", False),
    "a lag": (DRIVE, backlashes(lagged(DRIVE)) + noise(0.01), "missing", False),
    "exchanged": (backlashes(DRIVE) + noise(0.01), DRIVE, "wrong", True),
    "pure noise": (DRIVE, noise(1.0), "wrong", True),
    "drowned": (DRIVE, 0.17 * DRIVE + noise(2.0), "untold", False),
}


def written(folder: Path, what: str) -> Path:
    v, y, _, _ = RECORDS[what]
    path = folder / "record.csv"
    np.savetxt(path, np.column_stack([T, v, y]), delimiter=",", header="t,v,y", comments="")
    return path


@pytest.mark.parametrize("what", RECORDS)
def test_the_verdict_is_what_the_figures_say(what: str) -> None:
    v, y, kind, useless = RECORDS[what]
    fit = hystgen.identify({"t": T, "v": v, "y": y})
    assert (fit.verdict.kind, fit.verdict.useless) == (kind, useless), fit.verdict.why
    if useless:
        with pytest.raises(UselessError, match="of no use"):
            hystgen.identify({"t": T, "v": v, "y": y}, strict=True)


@pytest.mark.parametrize(("what", "code", "command"), [
    ("good", 0, "hystgen emit {m} -o firmware/"),
    ("a lag", 0, "hystgen diagnose {m} {r} -o diagnosis/"),
    ("pure noise", 1, "hystgen identify {r} -o {m} --report report/"),
    ("exchanged", 1, "hystgen identify {r} --columns v=y,y=v -o {m}"),
    ("drowned", 0, "hystgen diagnose --plan {m} -o plan/"),
])  # fmt: skip
def test_the_next_step_and_the_exit_code(run: Run, tmp_path: Path, what: str, code: int, command: str) -> None:
    record, model = written(tmp_path, what), tmp_path / "m.yaml"
    got, table, said = run("identify", record, "-o", model, "--strict")
    assert got == code, said
    assert f"    {command.format(m=model, r=record)}\n" in table
    assert ("the model is of no use" in said) == bool(code)
    assert run("identify", record, "-o", model)[0] == 0


def test_the_next_command_reads_the_record_as_this_one_did(run: Run, tmp_path: Path) -> None:
    """Each printed command is run: with the columns exchanged, the sign changed, and the options given before."""
    v, y, _, _ = RECORDS["a lag"]
    model = tmp_path / "m.yaml"

    def printed(table: str, command: str) -> list[str]:
        return shlex.split(next(line for line in table.splitlines() if line.startswith(f"    hystgen {command} ")))[1:]

    path = tmp_path / "exchanged.csv"
    np.savetxt(path, np.column_stack([T, y, v]), delimiter=",", header="Zeit,Voltage,Position", comments="")
    code, table, said = run("identify", path, "-o", model, "--skip", "0.5")
    assert code == 0, said
    exchanged = printed(table, "identify")
    assert exchanged[-6:] == ["--skip", "0.5", "--columns", "v=y,y=v", "-o", str(model)]
    code, table, said = run(*exchanged)
    assert code == 0
    assert "v = Position, y = Voltage" in said
    assert printed(table, "diagnose")[3:7] == ["--skip", "0.5", "--columns", "v=y,y=v"]
    path = tmp_path / "falls.csv"
    np.savetxt(path, np.column_stack([T, v, -y]), delimiter=",", header="Zeit,Kanal A,Kanal B", comments="")
    names = ("--columns", "t=Zeit,v=Kanal A,y=-Kanal B")
    code, _, said = run("identify", path, "-o", model, "--columns", "t=Zeit,v=Kanal A,y=Kanal B")
    assert code == 2
    assert "change the sign of y (--columns y=-y)" in said
    code, table, said = run("identify", path, "-o", model, *names)
    assert code == 0
    assert "y = Kanal B with its sign changed" in said
    assert printed(table, "diagnose")[3:5] == list(names)
    signed = hystgen.records.read_record(str(path), columns={"v": "#2", "y": "-#3"})
    np.testing.assert_array_equal(signed.y, np.loadtxt(path, delimiter=",", skiprows=1)[:, 2] * -1.0)
