"""Records without a history: estimated start memories, loops that run the other way, points without a time."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from numpy.typing import NDArray
from recordings import brute_output, brute_plays, noisy, record

import hystgen
from hystgen.identification import IdentificationError, pi, reduction, start

Array = NDArray[np.float64]

PLACES = tuple(np.linspace(0.0, 36.0, 10).tolist())
WEIGHTS = (1.0, *(0.2 * np.exp(-np.arange(9) / 4.0)).tolist())


@pytest.fixture(scope="module")
def bench() -> ModuleType:
    """The module benchmarks/start_memory.py."""
    path = Path(__file__).resolve().parents[1] / "benchmarks" / "start_memory.py"
    spec = importlib.util.spec_from_file_location("bench_start_memory", path)
    assert spec
    assert spec.loader
    made = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = made
    sys.path.insert(0, str(path.parent))  # as for a program, which imports modules next to it
    try:
        spec.loader.exec_module(made)
    finally:
        sys.path.remove(str(path.parent))
    return made


def legs(turns: list[float], step: float = 1.5) -> Array:
    """A drive that goes straight from turn to turn."""
    along = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(turns)))])
    return np.interp(np.arange(0.0, along[-1], step), along, turns)


def growing() -> Array:
    """Amplitudes around a drive that is not 0, growing to the end."""
    return legs([45.0, *(x for k in range(1, 10) for x in (45.0 + 5.0 * k, 45.0 - 4.0 * k))])


def never_twice() -> Array:
    """Turns at random: no extreme is visited again, the largest and the least come late."""
    return legs([50.0, 70.0, 35.0, 62.0, 20.0, 81.0, 44.0, 58.0, 12.0, 90.0, 31.0, 66.0, 5.0, 98.0, 60.0])


class TestMemory:
    @pytest.mark.parametrize("seed", range(8))
    def test_turns_lead_virgin_plays_to_the_memory(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        r = np.concatenate([[0.0], np.cumsum(rng.uniform(0.1, 4.0, 9))])
        slopes = np.clip(rng.uniform(-1.6, 1.6, 9), -1.0, 1.0)
        states = rng.uniform(-30.0, 30.0) + np.concatenate([[0.0], np.cumsum(slopes * np.diff(r))])
        turns = [*start.turns_of(r, states), float(states[0])]
        assert brute_plays(turns, r, 0.0)[-1] == pytest.approx(states, abs=1e-9)

    @pytest.mark.parametrize("seed", range(4))
    def test_what_a_memory_leaves(self, seed: int) -> None:
        """With known weights: the root sum of squares of a brute-force run from that memory, with the best offset."""
        rng = np.random.default_rng(seed)
        v = (growing if seed % 2 else never_twice)()
        y = rng.standard_normal(len(v))
        y[rng.uniform(size=len(y)) < 0.1] = np.nan
        r, begin = np.array(PLACES), int(rng.integers(0, 40))
        course = reduction.Course("random", v, y, None, begin, len(v), begin=begin)
        slopes = rng.uniform(-1.0, 1.0, len(r) - 1)
        states = v[0] + np.concatenate([[0.0], np.cumsum(slopes * np.diff(r))])
        errors = (y - brute_output(v, PLACES, WEIGHTS, states))[begin:]
        expected = np.sqrt(np.nansum((errors - np.nanmean(errors)) ** 2))
        assert start._System.of(course, r).left(slopes, np.array(WEIGHTS)) == pytest.approx(expected, rel=1e-12)

    @pytest.mark.thorough(but_one_in=3)
    @pytest.mark.parametrize("before", [(), (100.0,), (110.0, -5.0), (-20.0, 75.0, 30.0)])
    @pytest.mark.parametrize("drive", [growing, never_twice])
    def test_costs_no_more_than_a_tenth(self, drive: object, before: tuple[float, ...]) -> None:
        """Models fitted with and without the true history are compared on a held-out record of known history."""
        v = drive()  # type: ignore[operator]
        memory = brute_plays([*before, v[0]], PLACES, 0.0)[-1]
        y = noisy(brute_output(v, PLACES, WEIGHTS, memory), 0.2)
        w = np.clip(legs([0.0, *np.random.default_rng(3).uniform(0.0, 100.0, 20)]), v.min(), v.max())
        z = noisy(brute_output(w, PLACES, WEIGHTS, 0.0), 0.2, 4)
        errors = []
        for history in (before, None):
            fit = hystgen.identify(record(v, y), history=history)
            assert fit.rows[-1].ignored == 0
            assert fit.parameters.input_range == (v.min(), v.max())
            errors.append(np.std(fit.predict(record(w, z), history=[], free_offset=True) - z))
        assert errors[1] <= 1.1 * errors[0]
        assert fit.along(record(v, y), fit.used[0]) == pytest.approx(y, abs=1.2)
        (found,) = fit.used[0].starts
        assert found is not None
        off = np.array(WEIGHTS) @ (brute_plays([*found.turns, v[0]], PLACES, 0.0)[-1] - memory)
        assert abs(off) < max(5.0 * found.uncertainty, 1.0)

    @pytest.mark.thorough(but_one_in=2)
    @pytest.mark.parametrize("drive", ["one way", "never twice"])
    def test_costs_no_more_than_a_tenth_of_other_hysteresis(self, drive: str, bench: ModuleType) -> None:
        """The plants are not play sums; held-out loops stay inside the fitted range, or cover all of it.

        The cost was 1.8 and 4.1 times when only plays that move there and back from a start at rest were fitted.
        """
        found = []
        for seed in range(3):
            made = bench.case(drive, seed)
            (_, known), (_, unknown) = bench.fitted(made, made.before), bench.fitted(made, None)
            found.append([bench.ratio(unknown[name], known[name]) for name in made.held])
        assert np.max(np.median(found, axis=0)) <= bench.COST

    def test_of_an_actuator_that_came_from_a_wider_range(self) -> None:
        """The widest plays move only once: if the model has none for them, what they add to the output is left."""
        places, weights, noise = np.linspace(0.0, 60.0, 13), (1.0, *[0.04] * 12), 0.05
        v = growing()
        memory = brute_plays([-100.0, 120.0, 20.0, v[0]], places, 0.0)[-1]
        y = noisy(brute_output(v, places, weights, memory), noise)
        for count in (None, 8):
            fit = hystgen.identify(record(v, y), thresholds=count)
            assert count is None or len(fit.parameters.model.pi.thresholds) == count + 1
            assert fit.rows[-1].rms < 2.0 * noise  # 1.3 times; without such plays 4.2

    def test_of_plays_that_seldom_turn(self) -> None:
        """The widest plays move down by a few volts at the end, and up once after the unknown start."""
        v = legs([0.0, 90.0, 30.0, 70.0, 20.0, 80.0, 40.0, 60.0, 3.0, 80.0, 10.0, 98.0, 0.0, 50.0])
        places, weights = (0.0, 5.0, 15.0, 30.0, 41.0), (1.0, 0.2, 0.2, 0.15, 0.15)
        fit = hystgen.identify(record(v, noisy(brute_output(v, places, weights, 0.0), 0.1)))
        assert (fit.rows[-1].ignored, fit.used[0].starts[0] is None) == (0, False)
        assert fit.rows[-1].rms < 0.15

    def test_a_known_start_has_none(self) -> None:
        v = growing()
        fit = hystgen.identify(record(v, brute_output(v, PLACES, WEIGHTS, 0.0)), history=())
        assert fit.used[0].starts == (None,)

    def test_no_effect_is_named(self, tmp_path: Path) -> None:
        v = growing()
        y = noisy(brute_output(v, PLACES, WEIGHTS, brute_plays([100.0, v[0]], PLACES, 0.0)[-1]), 0.2)
        hystgen.identify(record(v, y)).write(tmp_path / "a.yaml")
        assert hystgen.diagnose(tmp_path / "a.yaml", record(v, y)).verdict == "nothing_missing"


class TestHeldOutPart:
    def test_growing_amplitudes_hold_out_a_part_inside(self) -> None:
        """The last quarter goes far beyond what is fitted; the quarter before it does not."""
        v = growing()
        fit = hystgen.identify(record(v, noisy(brute_output(v, PLACES, WEIGHTS, 0.0), 0.2)))
        fitted, held = fit.rows[:2]
        assert (fitted.part, held.part) == ("fit", "held out")
        assert held.samples == round(len(v) / 4)
        assert fitted.samples == len(v) - held.samples
        assert held.rms < 0.3


def ahead(v: Array) -> Array:
    """A force ahead of its displacement: loops that run clockwise, whatever the drive."""
    return np.asarray(1.5 * v - brute_output(v, (0.0, 10.0), (0.0, 1.0), v[0]))


def behind(v: Array) -> Array:
    """Plays with positive weights, whose loops run counterclockwise."""
    return brute_output(v, PLACES, WEIGHTS, v[0])


def iron(v: Array) -> Array:
    """Magnetization that saturates, over the field."""
    return hystgen.plants.JilesAtherton(Ms=100.0, a=5.0, k=20.0, c=0.1).simulate(v)


SWEEP = legs([0.0, 100.0, -100.0, 100.0, -60.0, 80.0, -100.0, 100.0], 0.5)
"""Settled loops with turns inside them, after a first loading."""

DRIVES = {
    "loops": SWEEP,
    "random turns": never_twice(),
    "one loop": legs([0.0, 100.0, 0.0], 0.5),
    "a part of a loop": legs([0.0, 100.0, 30.0], 0.5),
    "few samples": legs([0.0, 100.0, 0.0, 100.0], 9.0),
}


def clockwise(v: Array, y: Array) -> bool:
    return pi.runs_clockwise([reduction.Course("one", v, y, None, 0, len(v))])


class TestDirection:
    """Recorded loops whose direction is known from the plant that made them."""

    @pytest.mark.parametrize("drive", DRIVES)
    def test_of_loops_with_noise(self, drive: str) -> None:
        v = DRIVES[drive]
        for scale in (0.0, 1.0):
            assert not clockwise(v, noisy(behind(v), scale))
            assert clockwise(v, noisy(ahead(v), scale))
            assert clockwise(behind(v), v), "exchanged columns"
            assert not clockwise(ahead(v), v)
            assert not clockwise(v, noisy(iron(v), scale)), "saturates"
        shaken = noisy(v, 1.0)
        assert not clockwise(shaken, behind(v))
        assert clockwise(shaken, ahead(v))

    @pytest.mark.parametrize("drive", ["loops", "random turns", "few samples"])
    @pytest.mark.parametrize("share", [-0.5, 0.5])
    def test_of_loops_that_drift(self, drive: str, share: float) -> None:
        v = DRIVES[drive]
        drift = share * np.ptp(v) * np.linspace(0.0, 1.0, len(v))
        assert not clockwise(v, behind(v) + drift)
        assert clockwise(v, ahead(v) + drift)
        assert not clockwise(v, v + drift)

    @pytest.mark.parametrize("late", [-5, -3, 3, 5, 10])
    def test_of_loops_beside_a_lag(self, late: int) -> None:
        """Fast loops are wide only because of the lag and run its way; slow loops show the way of the hysteresis."""
        t = np.linspace(0.0, 10.0, 4000)
        v = 100.0 * np.sin(2.0 * np.pi * (0.2 * t + 0.2 * t**2))
        k = np.arange(len(t))
        assert not clockwise(v, np.interp(k - late, k, behind(v)))
        assert clockwise(v, np.interp(k - late, k, ahead(v)))

    def test_of_lines_and_curves(self) -> None:
        """There is no hysteresis, so any direction would be one of the noise."""
        for seed in range(30):
            noise = np.random.default_rng(seed).standard_normal(len(SWEEP))
            for y in (SWEEP, 100.0 * np.tanh(SWEEP / 30.0)):
                assert not clockwise(SWEEP, y + noise)

    @pytest.mark.parametrize("drive", ["loops", "random turns"])
    @pytest.mark.parametrize("way", [behind, ahead, iron])
    def test_of_a_butterfly(self, drive: str, way: Callable[[Array], Array]) -> None:
        """The wings of a butterfly run opposite ways."""
        v = DRIVES[drive] - np.mean(DRIVES[drive])
        assert not clockwise(v, way(v) ** 2)

    def test_without_a_turn(self) -> None:
        v = np.linspace(0.0, 1.0, 50)
        assert not clockwise(v, v)
        assert not clockwise(np.zeros(50), v)
        assert not clockwise(v, np.full(50, np.nan))


class TestSense:
    def test_clockwise_loops_are_told(self) -> None:
        """A force ahead of its displacement is reported, and its columns fit well when exchanged."""
        x = never_twice()
        force = noisy(1.5 * x - brute_output(x, (0.0, 10.0), (0.0, 1.0), 50.0), 0.05)
        fit = hystgen.identify(record(x, force))
        assert any("the loops run clockwise" in text and "exchange the columns" in text for text in fit.warnings)
        assert any("no hysteresis was found" in text for text in fit.warnings)
        exchanged = hystgen.identify(record(force, x))
        assert not any("clockwise" in text or "no hysteresis" in text for text in exchanged.warnings)
        assert exchanged.rows[-1].rms < 0.1 * fit.rows[-1].rms * np.ptp(x) / np.ptp(force)

    def test_loops_that_saturate_are_not_clockwise(self) -> None:
        """Weights of either sign model the saturation, so negative ones say nothing about the direction."""
        loops = []
        for top in (32.0, 160.0):
            v = np.append(0.0, top * np.cos(np.linspace(0.0, 4.0 * np.pi, 513)))
            loops.append(record(v[257:], iron(v)[257:]))
        assert not any("clockwise" in text for text in hystgen.identify(loops).warnings)

    def test_falling_outputs_are_refused_with_what_to_do(self) -> None:
        v = never_twice()
        with pytest.raises(IdentificationError, match="change the sign of y"):
            hystgen.identify(record(v, -brute_output(v, PLACES, WEIGHTS, 0.0)))


class TestPoints:
    def test_without_a_time(self, tmp_path: Path) -> None:
        """120 points are fitted; an effect that does not depend on time is found, and none that does is sought."""
        v = legs([20.0, 80.0, 0.0, 100.0, 10.0, 90.0, 20.0, 80.0, 0.0, 100.0], 6.0)
        bent = 100.0 * np.expm1(v / 60.0) / np.expm1(100.0 / 60.0)
        y = noisy(brute_output(bent, (0.0, 5.0, 15.0), (1.0, 0.4, 0.3), bent[0]), 0.2)
        path = tmp_path / "points.csv"
        path.write_text("v,y\n" + "\n".join(f"{a!r},{b!r}" for a, b in zip(v.tolist(), y.tolist(), strict=True)))
        fit = hystgen.identify(path)
        assert any("no time: read as points" in text for text in fit.warnings)
        fit.write(tmp_path / "a.yaml")
        found = hystgen.diagnose(tmp_path / "a.yaml", path)
        assert [each["name"] for each in found.content["effects"]][:1] in (["asymmetry"], ["noncongruent"])
        assert any("time-dependent effects are not tried" in note for note in found.notes)


    @pytest.mark.parametrize("name", ["Time", "timestamp", "Zeit [ms]"])
    def test_a_time_by_another_name_is_one(self, tmp_path: Path, name: str) -> None:
        path = tmp_path / "named.csv"
        path.write_text(f"{name},v,y\n" + "\n".join(f"{0.5 * k},{k % 7},{k % 7}" for k in range(40)))
        (record,) = hystgen.records.read_records([path], points=True)
        assert record.timed
        assert record.sample_time == pytest.approx(5e-4 if "ms" in name else 0.5)

    def test_a_further_column_may_be_the_time(self, tmp_path: Path) -> None:
        path = tmp_path / "further.csv"
        path.write_text("k,v,y\n" + "\n".join(f"{k},{k % 7},{k % 7}" for k in range(40)))
        with pytest.raises(hystgen.records.RecordError, match=r'there is no column "t" among k, v, y; give --sample'):
            hystgen.identify(path)


def test_skip_is_in_seconds() -> None:
    """Samples come every millisecond; the drive of skipped samples still moves the plays."""
    v = never_twice()
    y = brute_output(v, PLACES, WEIGHTS, 0.0)
    y[:100] = -500.0
    fit = hystgen.identify(record(v, y), history=(), skip=0.1, thresholds=PLACES)
    assert len(fit.used[0].skipped) == 100
    assert fit.rows[-1].max < 1e-6


@pytest.mark.parametrize(("left_out", "moves"), [(110.0, 6.0), (98.0, 4.0), (90.0, 0.0)])
def test_a_play_moves_only_where_its_record_is_compared(left_out: float, moves: float) -> None:
    """On the way up to 100, a play of 47 V at 47 V moves from a drive of 94 V on; a converter's limit hides the end."""
    v = np.concatenate([np.linspace(100.0, 0.0, 101), np.linspace(1.0, 100.0, 100)])
    y = np.where((v > left_out) & (np.arange(len(v)) > 100), np.nan, v)
    course = reduction.Course("made", v, y, (0.0,), 100, len(v))
    assert reduction.travel(course, 47.0) == pytest.approx(moves, abs=1e-9)
