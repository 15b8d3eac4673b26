"""The sequence that erases the memory, against plays in plain Python, other histories, and the C."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import cffi
import numpy as np
import pytest

import hystgen
from hystgen import degaussing
from hystgen.arithmetic import ARITHMETICS
from hystgen.basics.problems import FormatError, PlanError
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters
from hystgen.verification import compilers

SECONDS = 1e-3
FILE = """\
hystgen: 1
name: m
sample_time: 1.0e-3
input_range: [{low}, {high}]
model:
  pi: {{thresholds: {r}, weights: {p}, initial_state: {start}}}{more}
emit: {{degauss: {options}}}
"""
TIMED = """
  effects:
    - {name: creep, time_constants: [0.05, 0.3], weights: [0.02, 0.015]}
    - {name: lag, time_constant: 4.0e-3}
    - {name: slew_limit, rate: 1500.0}"""


def model(
    r: Sequence[float], p: Sequence[float], ends: tuple[float, float] = (-50.0, 100.0), start: float = 0.0,
    more: str = "", options: str = "{}",
) -> Model:
    low, high = ends
    given = {"low": low, "high": high, "r": list(r), "p": list(p), "start": start, "more": more, "options": options}
    return Model(parse_parameters(FILE.format(**given)))


def moved(plays: list[float], r: Sequence[float], w: float) -> list[float]:
    """Each play holds its value until its input is a threshold away: the definition."""
    return [max(w - each, min(w + each, z)) for z, each in zip(plays, r, strict=True)]


@pytest.mark.parametrize("seed", range(30))
def test_plays_keep_nothing_of_any_history(seed: int) -> None:
    """Plays whose turn lies in range end at the last drive; the others where the ends of the range leave them."""
    rng = np.random.default_rng(seed)
    low = float(rng.uniform(-80, 20))
    high = low + float(rng.uniform(1, 120))
    r = [0.0, *np.cumsum(rng.uniform(0.02, 0.3, int(rng.integers(0, 12))) * (high - low)).tolist()]
    end = float(rng.choice([low, high, rng.uniform(low, high)]))
    one = model(r, [1.0] * len(r), (low, high), start=float(rng.uniform(low, high)))
    found = hystgen.degauss(one, end=end)
    memories = set()
    for _ in range(20):
        plays = [float(each) for each in one.cascade.pi.start]
        drive = low
        for drive in rng.uniform(low, high, int(rng.integers(1, 30))).tolist():
            plays = moved(plays, r, drive)
        sequence = found.drives(drive).tolist()
        assert len(sequence) <= found.samples
        assert low <= min(sequence)
        assert max(sequence) <= high
        assert max(abs(b - a) for a, b in zip([drive, *sequence], sequence, strict=False)) <= (high - low) / 50 * 1.001
        for each in sequence:
            plays = moved(plays, r, each)
        memories.add(tuple(plays))
    assert len(memories) == 1
    memory = memories.pop()
    assert memory == pytest.approx(found.memory.tolist(), abs=1e-9 * (high - low))
    assert memory[0] == pytest.approx(end, abs=1e-9 * (high - low))
    room = min(end - low, high - end)
    for z, each in zip(memory, r, strict=True):
        if each <= room:
            assert z == pytest.approx(end, abs=1e-9 * (high - low))


def recursion(drives: Sequence[float], r: Sequence[float], p: Sequence[float]) -> float:
    """Displacement after the drives, in small steps of a held drive: a separate way to compute lag, plays and creep."""
    fine, lag, creep, taus, weights = 8, drives[0], [0.0, 0.0], (0.05, 0.3), (0.02, 0.015)
    plays, drive, h = [0.0] * len(r), drives[0], 0.0
    for target in drives:
        for k in range(1, fine + 1):
            v = drive + (target - drive) * k / fine
            lag += (v - lag) * -math.expm1(-SECONDS / fine / 4e-3)
        plays = moved(plays, r, lag)
        h = sum(a * b for a, b in zip(p, plays, strict=True))
        creep = [x + (h - x) * -math.expm1(-SECONDS / tau) for x, tau in zip(creep, taus, strict=True)]
        drive = target
    return h + sum(a * b for a, b in zip(weights, creep, strict=True))


def test_effects_with_memory_in_time_keep_no_more_than_stated() -> None:
    """After histories of all kinds, of which two rest at an end for twenty time constants."""
    r, p = [0.0, 8.0, 20.0, 45.0], [0.3, 0.1, 0.05, 0.03]
    found = hystgen.degauss(model(r, p, more=TIMED), end=20.0, within=0.003)
    rng = np.random.default_rng(5)
    ends = []
    for k in range(8):
        if k < 2:
            history = [(-50.0, 100.0)[k]] + [(100.0, -50.0)[k]] * 6000
        else:
            history = np.repeat(rng.uniform(-50, 100, 40), rng.integers(1, 60, 40)).tolist()
        ends.append(recursion([*history, *found.drives(history[-1]).tolist()], r, p))
    spread = max(ends) - min(ends)
    low, high = found.model.cascade.output_range
    assert 0.5 * found.residual < spread <= found.residual * 1.02  # 2 %: the recursion's own steps
    assert found.residual <= 0.003 * (high - low)
    drives = found.drives(-50.0)
    assert np.max(np.abs(np.diff(drives))) <= 1500.0 * SECONDS


HARNESS = """
#include "m.h"
void erase(m_real_t start, m_real_t *drives, unsigned *done, size_t count);
void erase(m_real_t start, m_real_t *drives, unsigned *done, size_t count) {
    m_degauss_t self;
    size_t i;
    m_degauss_init(&self, start);
    for (i = 0; i < count; ++i) {
        drives[i] = m_degauss_step(&self);
        done[i] = m_degauss_done(&self);
    }
}
/* Answers to probes after a history that the inverse has not seen, and the sequence. */
void after(const m_real_t *history, size_t count, const m_real_t *probe, m_real_t *answers, size_t probes);
void after(const m_real_t *history, size_t count, const m_real_t *probe, m_real_t *answers, size_t probes) {
    m_degauss_t sequence;
    m_forward_t stage;
    m_inverse_t self;
    size_t i;
    m_forward_init(&stage);
    m_inverse_init(&self);
    for (i = 0; i < count; ++i) {
        (void)m_forward_step(&stage, history[i]);
    }
    m_degauss_init(&sequence, history[count - 1]);
    while (!m_degauss_done(&sequence)) {
        const m_real_t v = m_degauss_step(&sequence);
        (void)m_forward_step(&stage, v);
        (void)m_inverse_step(&self, M_OUTPUT_MIN);
        m_inverse_commit(&self, v);
    }
    for (i = 0; i < probes; ++i) {
        answers[2 * i] = m_forward_step(&stage, probe[i]);
        answers[2 * i + 1] = m_inverse_step(&self, answers[2 * i]);
        m_inverse_commit(&self, probe[i]);
    }
}
"""


class Erasing:
    """The emitted C in a library."""

    def __init__(self, one: Model, arithmetic: str, folder: Path, engine: str = "auto") -> None:
        hystgen.emit(one, folder, arithmetic=arithmetic, operator="both", engine=engine)
        (folder / "harness.c").write_text(HARNESS)
        files = [folder / "m.c", folder / "harness.c"]
        compilers.available()[0].shared_library(files, folder / "m.so", compilers.STRICT)
        self.ffi = cffi.FFI()
        self.number = ARITHMETICS[arithmetic].number
        real = ARITHMETICS[arithmetic].c_type
        self.ffi.cdef(
            f"void erase({real}, void *, void *, size_t); void after(void *, size_t, void *, void *, size_t);"
        )
        self.lib = self.ffi.dlopen(str(folder / "m.so"))

    def at(self, array: np.ndarray) -> object:
        return self.ffi.cast("void *", array.ctypes.data)

    def drives(self, start: float, count: int) -> tuple[np.ndarray, np.ndarray]:
        found, done = np.zeros(count, self.number), np.zeros(count, np.uint32)
        self.lib.erase(start, self.at(found), self.at(done), count)
        return found, done

    def after(self, history: np.ndarray, probe: np.ndarray) -> np.ndarray:
        given, asked = history.astype(self.number), probe.astype(self.number)
        answers = np.zeros(2 * len(probe), self.number)
        self.lib.after(self.at(given), len(given), self.at(asked), self.at(answers), len(asked))
        return answers


@pytest.mark.slow(one_in=2)
@pytest.mark.parametrize("arithmetic", ["float32", "q31", "float64", "q15"])
@pytest.mark.parametrize("more", ["", TIMED], ids=["plain", "timed"])
def test_drives_of_the_c_have_the_bits_of_the_reference(more: str, arithmetic: str, tmp_path: Path) -> None:
    one = model([0.0, 8.0, 20.0, 45.0], [0.3, 0.1, 0.05, 0.03], more=more, options="{end: 21.3, within: 0.05}")
    found = degaussing.of(one, arithmetic)
    c, rng = Erasing(one, arithmetic, tmp_path), np.random.default_rng(3)
    starts = rng.uniform(-60, 110, 6) / found.lsb
    if arithmetic.startswith("q"):
        most = np.iinfo(c.number).max
        starts = np.append(np.clip(np.rint(starts), -most, most), [-most - 1, most]).astype(int)
    else:
        starts = np.append(starts.astype(c.number), [np.nan, np.inf, -np.inf, -0.0])
    for start in starts.tolist():
        made, done = c.drives(start, found.samples + 3)
        wanted = found.drives(start)
        assert np.array_equal(made[: len(wanted)], wanted)
        assert np.all(made[len(wanted) :] == wanted[-1])
        assert list(done).index(1) == len(wanted) - 1
    assert f"#define M_DEGAUSS_SAMPLES {found.samples}u" in (tmp_path / "m.h").read_text()


@pytest.mark.parametrize(("arithmetic", "engine"), [
    ("float32", "corners"), ("float64", "loop"), ("q31", "loop"), ("q15", "corners"),
])
def test_an_instance_that_steps_along_shares_the_memory(arithmetic: str, engine: str, tmp_path: Path) -> None:
    """Whatever the history of the stage, which the compensator has not seen, both then answer alike."""
    one = model([0.0, 8.0, 20.0, 45.0], [0.3, 0.1, 0.05, 0.03], start=12.0)
    c, rng = Erasing(one, arithmetic, tmp_path, engine), np.random.default_rng(4)
    lsb = degaussing.of(one, arithmetic).lsb
    probe = rng.uniform(-49, 99, 40) / lsb
    found = [c.after(np.rint(rng.uniform(-50, 100, 25) / lsb), probe) for _ in range(25)]
    assert all(np.array_equal(each, found[0]) for each in found)
    assert np.max(np.abs(found[0][1::2].astype(float) - probe)) * lsb < 0.01


def test_what_cannot_be_made_is_refused() -> None:
    r, p = [0.0, 8.0], [0.3, 0.1]
    with pytest.raises(PlanError, match=r"(?s)the end 400 is outside.*within is 2.*max rate is -1"):
        hystgen.degauss(model(r, p), end=400.0, within=2.0, max_rate=-1.0)
    with pytest.raises(PlanError, match="finer than q15"):
        hystgen.degauss(model(r, p), arithmetic="q15", max_rate=0.5)
    slow = "\n  effects: [{name: creep, time_constants: [1.0e+5], weights: [0.5]}]"
    with pytest.raises(PlanError, match="allow more within"):
        hystgen.degauss(model(r, p, more=slow))
    with pytest.raises(FormatError, match=r"emit\.degauss"):
        hystgen.emit(model(r, p, more=slow), "nowhere")


def test_the_command_writes_the_table(run: Callable[..., tuple[int, str, str]], tmp_path: Path) -> None:
    file, table = tmp_path / "m.yaml", tmp_path / "d.csv"
    file.write_text(FILE.format(low=-5, high=5, r=[0, 1, 2], p=[1, 1, 1], start=0, more="", options="{end: 0.5}"))
    code, out, err = run("degauss", file, "--start", 3.0, "-o", table)
    assert (code, out.strip()) == (0, str(table))
    assert "initial_state: [0.5, 0.5, 0.5]" in err
    t, v = np.loadtxt(table, delimiter=",", skiprows=1, unpack=True)
    assert np.array_equal(v, hystgen.degauss(str(file)).drives(3.0))
    assert t == pytest.approx(np.arange(len(v)) * SECONDS)
    assert run("degauss", file, "--end", 7, "-o", table)[0] == 2
    file.write_text(file.read_text().replace("end: 0.5", "end: 9"))
    code, _, err = run("degauss", file, "-o", table)
    assert code == 2
    assert "emit.degauss.end: 9 is outside input_range" in err
