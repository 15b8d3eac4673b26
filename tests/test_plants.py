"""The blind plants themselves: they behave as their labels say, and the score counts correctly.

Their physics is checked against closed solutions and loops written here; only their files are read by the package.
"""

from __future__ import annotations

import ast
import json
import math
import sys
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.plants import base, bench, case, effects, foreign, labels, refit, rivals, run, score, session, track
from benchmarks.plants.__main__ import main
from benchmarks.plants.effects import Effect, Surroundings, drive_side, output_side, slow
from benchmarks.plants.plant import Plant
from hystgen.parameters.files import load_parameters
from hystgen.records import read_record

pytestmark = pytest.mark.thorough

Array = NDArray[np.float64]

PLANTS = Path(__file__).parents[1] / "benchmarks" / "plants"
NAMES = case.in_turn()
BENCH = bench.Bench("dynamic", 0.0, 100.0, 40.0, (1000.0, 1000.0), 1000)


def surroundings(t: Array, drive: Array | None = None, temperature: Array | None = None) -> Surroundings:
    none = np.zeros(len(t))
    drive = none if drive is None else drive
    return Surroundings(t, np.diff(t, prepend=t[0]), drive, none if temperature is None else temperature, BENCH)


def files(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture(scope="module")
def made() -> Callable[[str, int], case.Case]:
    known: dict[tuple[str, int], case.Case] = {}

    def make(kind: str, seed: int) -> case.Case:
        if (kind, seed) not in known:
            known[kind, seed] = case.make(kind, seed)
        return known[kind, seed]

    return make


Made = Callable[[str, int], case.Case]


class TestApart:
    """The generator does not use the package, and the workflow does not see the labels."""

    def test_names_are_the_catalogue(self) -> None:
        from hystgen.parameters.checks import EFFECT_NAMES

        assert {*NAMES, case.OPEN} == set(effects.catalogue())
        assert set(EFFECT_NAMES) == {*effects.catalogue(), "influence"}, "benchmarks/influences.py has its own plants"
        assert set(rivals.RIVALS) == set(effects.catalogue())

    def test_no_import_of_the_package(self) -> None:
        sources = sorted(PLANTS.rglob("*.py"))
        assert len(sources) > 10
        for path in sources:
            for node in ast.walk(ast.parse(path.read_text())):
                names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
                if isinstance(node, ast.ImportFrom):
                    names = [node.module or ""]
                called = isinstance(node, ast.Constant) and isinstance(node.value, str) and "from hystgen" in node.value
                assert not any(name.split(".")[0] == "hystgen" for name in names), path
                assert not called or path.name == "run.py", path

    def test_same_seed_same_bytes(self, tmp_path: Path) -> None:
        for kind, seed in (("single", 5), ("pair", 3), ("foreign", 4), ("poor", 12)):
            for folder in ("a", "b"):
                labels.write(case.make(kind, seed, 400), tmp_path / folder, with_rivals=False)
        first, second = files(tmp_path / "a"), files(tmp_path / "b")
        assert len(first) > 4 * 4
        assert first == second

    def test_another_seed_another_case(self) -> None:
        a, b = case.make("none", 1, 400), case.make("none", case.REPORT + 1, 400)
        assert a.name != b.name
        assert not np.array_equal(a.measured[0]["y"][:50], b.measured[0]["y"][:50])

    def test_no_leak_into_what_the_workflow_reads(self, tmp_path: Path) -> None:
        for kind in case.KINDS:
            home = labels.write(case.make(kind, 6, 300), tmp_path, with_rivals=False)
            spec = files(home)
            assert all(name in ("params.yaml", "session.json") or name.startswith("r") for name in spec)
            assert set(json.loads(spec["session.json"])) == {"fit", "holdout", "history", "rest"}
            texts = spec["session.json"] + spec["params.yaml"] + home.name.encode()
            words = [*NAMES, *foreign.FAULTS, *case.KINDS, "noise", "seed", "effects"]
            assert not [word for word in words if word.encode() in texts]
            for name, content in spec.items():
                if name.endswith(".csv"):
                    assert content.split(b"\n")[0] in (b"t,v,y", b"t,v,y,temperature")
        assert {path.name for path in tmp_path.iterdir()} == {"cases", "labels"}
        labelled = {path.stem for path in (tmp_path / "labels").iterdir()}
        assert labelled == {path.name for path in (tmp_path / "cases").iterdir()}

    def test_the_package_reads_every_file(self, tmp_path: Path) -> None:
        for kind, seed in (("single", 12), ("pair", 1), ("none", 0), ("poor", 0)):
            made = case.make(kind, seed, 400)
            home = labels.write(made, tmp_path, with_rivals=False)
            spec = json.loads((home / "session.json").read_text())
            assert spec["fit"]
            assert spec["holdout"]
            assert (spec["history"] is None) == (spec["rest"] is None)
            assert sorted(path.name for path in home.glob("*.csv")) == sorted(spec["fit"] + spec["holdout"])
            for name in spec["fit"] + spec["holdout"]:
                record = read_record(home / name)
                columns = made.measured[int(name[1:3]) - 1]
                assert record.notes == ()
                assert record.y is not None
                assert np.allclose(record.y, columns["y"], rtol=0, atol=1e-8)
                assert np.allclose(np.diff(record.t), record.sample_time, rtol=1e-4)
            parameters = load_parameters(home / "params.yaml")
            assert parameters.input_range == (made.session.bench.low, made.session.bench.high)


class TestHysteresis:
    """Every kind agrees with a play sum written as a loop."""

    @pytest.mark.parametrize(("kind", "close"), [("everett", 1e-5), ("maxwell", 1e-12), ("relays", 1e-3)])
    def test_is_the_play_sum_of_its_density(self, kind: str, close: float) -> None:
        rng = np.random.default_rng(3)
        model = base.draw(rng, -20.0, 120.0, 30.0, kind)
        turns = rng.uniform(-20.0, 120.0, 60)
        v = np.concatenate([np.linspace(a, b, 40) for a, b in pairwise(turns)])
        radii, weights = model.radii.reshape(-1, 4).mean(axis=1), model.masses.reshape(-1, 4).sum(axis=1)
        if kind == "maxwell":
            radii, weights = model.yields, model.stiffnesses
        expected = model.p0 * v
        for r, weight in zip(radii.tolist(), weights.tolist(), strict=True):
            state, states = v[0] - r, np.empty_like(v)
            for k, x in enumerate(v.tolist()):
                state = max(x - r, min(x + r, state))
                states[k] = state
            expected += weight * states
        error = base.run(model, v, np.ones_like(v)) - expected
        assert np.ptp(error) < close * 30.0

    def test_widths_are_those_of_real_stages(self) -> None:
        x = np.concatenate((np.linspace(0, 100, 500), np.linspace(100, 0, 500), np.linspace(0, 100, 500)))
        widths = []
        for seed in range(30):
            kind = base.KINDS[seed % 4]
            y = base.run(base.draw(np.random.default_rng(seed), 0.0, 100.0, 12.0, kind), x, np.ones_like(x))
            up, down = y[1000:], y[999:499:-1]
            widths.append(np.max(np.abs(up - down)) / np.ptp(up))
            assert np.ptp(up) == pytest.approx(12.0, rel=0.02)
        assert 0.01 < min(widths) < 0.06
        assert 0.09 < max(widths) < 0.2

    def test_a_fine_play_sum_leaves_less_than_the_noise_of_effect_free_cases(self, made: Made) -> None:
        kinds = set()
        for seed in range(8):
            free = made("none", seed)
            kinds.add(free.plant.hysteresis.kind)
            assert free.remainder <= 0.3 * free.noise()
            assert np.array_equal(np.concatenate(free.clean), np.concatenate(free.twin))
        assert len(kinds) > 2


class TestEffects:
    """Each effect follows its own law and is large enough to be found."""

    @pytest.mark.slow(one_in=2)
    @pytest.mark.parametrize("seed", range(13), ids=NAMES)
    def test_leaves_what_no_play_sum_absorbs(self, made: Made, seed: int) -> None:
        found = made("single", seed)
        (item,) = found.present
        assert item.effect.name == NAMES[seed]
        truth = labels.label(found, with_rivals=False)
        assert truth["effects"][0]["ratio"] == pytest.approx(item.unabsorbed / found.noise())
        assert truth["visible"]
        assert item.unabsorbed > 3.0 * found.noise()
        # Another set of plays and another solver agree on the residual
        assert self.left(found) == pytest.approx(item.unabsorbed, rel=0.15)

    @staticmethod
    def left(found: case.Case, records: NDArray[np.bool_] | None = None) -> float:
        from scipy.optimize import lsq_linear

        course = refit.track(found.session)
        record = course.record[course.seen]
        columns = refit.plays(course.v, np.linspace(0.0, 0.5 * found.session.bench.span, 40))[course.seen]
        offsets = (record[:, None] == np.arange(len(found.clean))[None, :]).astype(float)
        matrix = np.hstack((columns, offsets))
        lower = np.concatenate((np.zeros(40), np.full(offsets.shape[1], -np.inf)))
        y = np.concatenate(found.clean)
        if records is not None:
            matrix, y = matrix[records[record]], y[records[record]]
        x = lsq_linear(matrix, y, (lower, np.inf)).x
        return float(np.sqrt(np.mean((y - matrix @ x) ** 2)))

    def test_loops_that_stay_open_leave_what_no_play_sum_absorbs(self, made: Made) -> None:
        found = made("open", 0)
        (item,) = found.present
        assert item.effect.name == case.OPEN
        assert item.unabsorbed > 3.0 * found.noise()
        assert self.left(found) == pytest.approx(item.unabsorbed, rel=0.15)

    @pytest.mark.parametrize("seed", range(13), ids=NAMES)
    def test_vanishes_at_strength_zero(self, made: Made, seed: int) -> None:
        found = made("single", seed)
        off = Plant(found.plant.hysteresis, (found.present[0].effect.scaled(0.0),)).respond(found.session)
        without = Plant(found.plant.hysteresis).respond(found.session)
        if found.present[0].effect.name in ("noncongruent", "rate_dependence"):
            assert np.array_equal(off, without)
        else:
            assert np.allclose(off, without, rtol=0, atol=1e-9 * found.session.bench.span_out)

    def test_lag_of_a_ramp_and_a_step(self) -> None:
        t = np.linspace(0.0, 1.0, 4001)
        lag = Effect("lag", "rc_network", 1.0, {"time": 0.05, "second": 1e-6})
        assert drive_side.lag(lag, 3.0 * t, surroundings(t))[-1] == pytest.approx(3.0 * (1.0 - 0.05), abs=1e-4)
        step = np.where(t > 0.1, 1.0, 0.0)
        out = drive_side.lag(lag, step, surroundings(t))
        assert np.interp(0.15, t, out) == pytest.approx(1.0 - math.exp(-1.0), abs=4e-3)

    def test_delay_moves_by_a_part_of_a_step(self) -> None:
        t = np.linspace(0.0, 1.0, 101)
        out = drive_side.delay(Effect("delay", "transport", 1.0, {"time": 0.0234}), t, surroundings(t))
        assert np.allclose(out[10:], t[10:] - 0.0234)

    def test_slew_limits_each_way_by_itself(self) -> None:
        t = np.linspace(0.0, 10.0, 2001)
        x = np.where((t > 1.0) & (t < 5.0), 8.0, 0.0)
        slew = Effect("slew_limit", "current", 1.0, {"rising": 4.0, "falling": 2.0})
        rates = np.diff(drive_side.slew(slew, x, surroundings(t))) / np.diff(t)
        assert rates.max() == pytest.approx(4.0)
        assert rates.min() == pytest.approx(-2.0)

    def test_creep_gains_the_same_in_every_decade(self) -> None:
        t = np.concatenate((np.linspace(0, 1e-3, 20), np.geomspace(1.1e-3, 200.0, 4000)))
        h = np.where(t > 0.0, 10.0, 0.0)
        numbers = {"first": 0.01, "last": 1000.0, "exponent": 0.0, "time": 1.0, "domain_share": 0.0}
        y = slow.creep(Effect("creep", "logarithmic", 0.015, numbers), h, surroundings(t))
        gains = np.diff(np.interp([0.1, 1.0, 10.0, 100.0], t, y)) / 10.0
        assert np.allclose(gains, 0.015, rtol=0.06)

    def test_resonance_rings_at_its_frequency_and_fades(self) -> None:
        t = np.arange(40000) * 1e-5
        h = np.where(t > 0.01, 1.0, 0.0)
        numbers = {"frequency": 120.0, "damping": 0.02, "second": 400.0, "second_damping": 0.02, "second_share": 0.0}
        y = output_side.resonance(Effect("resonance", "modes", 1.0, numbers), h, surroundings(t))
        w = 2.0 * math.pi * 120.0
        x = np.maximum(t - 0.01, 0.0)
        wd = w * math.sqrt(1.0 - 0.02**2)
        exact = 1.0 - np.exp(-0.02 * w * x) * (np.cos(wd * x) + 0.02 * w / wd * np.sin(wd * x))
        assert np.max(np.abs(y - np.where(t > 0.01, exact, 0.0))) < 0.01

    def test_ageing_stands_still_at_rest(self) -> None:
        t = np.arange(400.0)
        drive = np.concatenate((50.0 + 50.0 * np.sin(0.3 * t[:150]), np.full(250, 70.0)))
        ageing = Effect("ageing", "stretched", 0.05, {"scale": 500.0, "exponent": 0.8})
        gain = slow.ageing(ageing, np.ones(400), surroundings(t, drive))
        assert gain[0] == 1.0
        assert gain[-1] == pytest.approx(0.95)
        assert np.ptp(gain[155:]) == 0.0

    def test_thermal_gain_follows_the_room(self) -> None:
        t = np.arange(50.0)
        numbers = {"offset_share": 0.0, "curved": 0.0, "time": 1.0}
        thermal = Effect("thermal", "room", 0.04, numbers)
        out = slow.thermal(thermal, np.full(50, 20.0), surroundings(t, temperature=20.0 + 0.1 * t))
        assert np.allclose(out, 20.0 * (1.0 + 0.04 * t / t[-1]))

    def test_own_heat_needs_a_moving_drive(self) -> None:
        t = np.arange(3000) * 0.01
        drive = np.where(t < 15.0, 50.0 + 50.0 * np.sin(12.0 * t), 50.0)
        numbers = {"offset_share": 0.0, "curved": 0.0, "time": 5.0}
        out = slow.thermal(Effect("thermal", "friction_heat", 0.04, numbers), np.ones(3000), surroundings(t, drive))
        assert out[1490] == pytest.approx(1.04, abs=0.002)
        assert (out[2000] - 1.0) / (out[1500] - 1.0) == pytest.approx(math.exp(-1.0), rel=0.02)

    def test_pairs_leave_both(self, made: Made) -> None:
        for seed in range(3):
            pair = made("pair", seed)
            assert len({item.effect.name for item in pair.present}) == 2
            assert all(item.unabsorbed > 2.5 * pair.noise() for item in pair.present)

    def test_held_out_records_alone_show_no_effect(self, made: Made) -> None:
        """The residual after a refit to the records to fit alone is that of another solver, and exceeds the noise."""
        for kind, seed in (("single", NAMES.index("slew_limit")), ("pair", 2)):
            found = made(kind, seed)
            held_out = np.array([record.held_out for record in found.session.records])
            for item, spec in zip(found.present, labels.label(found, with_rivals=False)["effects"], strict=True):
                alone = Plant(found.plant.hysteresis, (item.effect,))
                fine = alone.respond(found.session)
                clean = tuple(found.session.sampled(fine, record) for record in found.session.records)
                assert self.left(replace(found, clean=clean), ~held_out) == pytest.approx(item.to_fit, rel=0.15)
                assert spec["ratio_fit"] == pytest.approx(item.to_fit / found.noise(False))
                assert spec["ratio_fit"] > 1.5

    def test_strength_is_wanted_in_both_groups_of_records(self) -> None:
        effect = Effect("slew_limit", "current", 1.0, {})
        assert case._off(case.Present(effect, 10.0, 9.0, 8.0), 10.0) == 0.0
        assert case._off(case.Present(effect, 10.0, 30.0, 4.0), 10.0) == pytest.approx(math.log(5.0 / 4.0))
        assert case._off(case.Present(effect, 10.0, 0.5, 12.0), 10.0) == pytest.approx(math.log(10.0))
        assert case._off(case.Present(effect, 20.0, 20.0, 20.0), 10.0) == pytest.approx(math.log(2.0))

    def test_what_held_out_records_alone_show_is_not_visible(self, made: Made) -> None:
        found = made("pair", 2)
        first, second = found.present
        for share, visible in ((1.6, True), (1.4, False)):
            weak = replace(second, to_fit=share * found.noise(False))
            assert labels.label(replace(found, present=(first, weak)), with_rivals=False)["visible"] is visible


class TestRecords:
    def test_both_channels_are_quantised(self, made: Made) -> None:
        for seed in range(4):
            found = made("none", seed)
            converters = found.converters
            for columns in found.measured:
                for name, step in (("v", converters.drive_step), ("y", converters.output_step)):
                    codes = columns[name] / step
                    assert np.allclose(codes, np.round(codes), atol=1e-6)
            assert converters.output_step < 1.0 * found.noise()
            assert found.noise() == pytest.approx(converters.noise, rel=0.25)

    def test_colours_of_noise(self) -> None:
        from benchmarks.plants.measure import coloured

        rng = np.random.default_rng(0)
        for colour, least, most in (("white", -0.02, 0.02), ("mixed", 0.35, 0.6), ("pink", 0.4, 0.8)):
            x = coloured(rng, 40000, colour, 10.0)
            assert np.std(x) == pytest.approx(1.0, abs=0.05)
            assert least < float(np.mean(x[1:] * x[:-1])) < most

    def test_a_known_history_is_what_was_driven(self, made: Made) -> None:
        known = [found for found in (made("none", seed) for seed in range(8)) if found.session.history]
        assert known
        for found in known:
            stage = found.session
            assert stage.history is not None
            for record in stage.records:
                before = stage.v[: record.first]
                assert before[-1] == pytest.approx(stage.history[-1])
                assert stage.t[record.first] - stage.t[record.first - 50] == pytest.approx(stage.rest, rel=0.02)
                for turn in stage.history:
                    assert np.any(np.isclose(before[-130 - 80 * len(stage.history) :], turn))

    def test_poor_excitation_is_one_waveform(self, made: Made) -> None:
        for seed in range(3):
            found = made("poor", seed)
            assert len({record.waveform for record in found.session.records}) == 1
            assert not found.rich


class TestForeign:
    @pytest.mark.parametrize("seed", range(len(foreign.FAULTS)), ids=list(foreign.FAULTS))
    def test_is_in_the_records(self, made: Made, seed: int) -> None:
        found = made("foreign", seed)
        assert found.fault is not None
        name, numbers = found.fault
        assert name == list(foreign.FAULTS)[seed]
        assert not found.present
        changed = [
            columns["y"] - clean - added
            for columns, clean, added in zip(found.measured, found.clean, found.added, strict=True)
        ]
        noise = found.noise()
        everywhere = np.concatenate(changed)
        if name == "hum":
            k = int(np.argmax([len(x) / record.rate for x, record in zip(changed, found.session.records, strict=True)]))
            t = found.session.times(found.session.records[k])
            turn = np.exp(-2j * math.pi * numbers["frequency"] * t)
            assert 2.0 * abs(np.mean(changed[k] * turn)) == pytest.approx(numbers["amplitude"], rel=0.35)
        elif name in ("glitches", "dropouts", "held_samples"):
            share = np.mean(np.abs(everywhere) > 2.0 * noise)
            assert 0.0005 < share < 0.2
        elif name == "stick_slip":
            assert numbers["jumps"] > 20
            assert 1.0 < np.std(everywhere) / noise < 60.0
        elif name == "ripple":
            assert np.std(everywhere) == pytest.approx(numbers["amplitude"] / math.sqrt(2.0), rel=0.3)
        elif name == "full_scale":
            y = np.concatenate([columns["y"] for columns in found.measured])
            assert np.count_nonzero(y == y.max()) > 50
        elif name == "swapped":
            wrong = [k for k, columns in enumerate(found.measured) if np.std(columns["v"] - found.clean[k]) < 2 * noise]
            assert wrong == ([numbers["record"]] if numbers["record"] >= 0 else list(range(len(found.measured))))
        else:
            factor = [
                float(np.ptp(columns["y"]) / np.ptp(clean))
                for columns, clean in zip(found.measured, found.clean, strict=True)
            ]
            wrong = [k for k, x in enumerate(factor) if not 0.9 < x < 1.1]
            assert wrong == ([numbers["record"]] if name == "units_one" else list(range(len(factor))))


class TestRivals:
    def test_tell_a_lag_from_what_is_slow_but_not_from_itself(
        self, made: Made, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        found = made("single", NAMES.index("lag"))
        kept = {name: rivals.RIVALS[name] for name in ("lag", "drift", "asymmetry", "delay")}
        monkeypatch.setattr(rivals, "RIVALS", kept)
        against = labels.compared(found, found.plant)
        assert 0.9 < against["lag"] < 1.3
        assert against["drift"] > 3.0
        assert against["asymmetry"] > 3.0
        assert against["delay"] > rivals.ALIKE

    def test_an_output_that_falls_while_the_drive_rises(self, made: Made, monkeypatch: pytest.MonkeyPatch) -> None:
        found = made("single", NAMES.index("sensor_nonlinearity"))
        clean = [found.session.sampled(found.plant.respond(found.session), k) for k in found.session.records]
        falling = replace(found, added=tuple(-2.0 * y for y in clean))  # so that no play has a positive weight
        monkeypatch.setattr(rivals, "RIVALS", {"sensor_nonlinearity": rivals.RIVALS["sensor_nonlinearity"]})
        assert 0.0 < labels.compared(falling, found.plant)["sensor_nonlinearity"] < math.inf

    def test_a_slow_record_leaves_lag_and_delay_open(self, monkeypatch: pytest.MonkeyPatch) -> None:
        from benchmarks.plants import drives, measure

        rng = np.random.default_rng(1)
        stand = bench.Bench("dynamic", 0.0, 100.0, 40.0, (2000.0, 2000.0), 900)
        sines = [("sine", drives.sine(6.0), False), ("sine", drives.sine(6.0), False), ("sine", drives.sine(6.0), True)]
        stage = session.plan(rng, stand, True, sines)
        model = base.draw(rng, 0.0, 100.0, 40.0, "everett")
        lag = Effect("lag", "rc_network", 1.0, {"time": 0.0008, "second": 1e-6})
        found = replace(
            case.make("poor", NAMES.index("lag"), 300),
            session=stage,
            plant=Plant(model, (lag,)),
            twin=tuple(stage.sampled(Plant(model).respond(stage), record) for record in stage.records),
            added=tuple(measure.coloured(rng, 900, "white", 1.0) * 0.05 for _ in stage.records),
            measured=(),
        )
        monkeypatch.setattr(rivals, "RIVALS", {name: rivals.RIVALS[name] for name in ("lag", "delay", "drift")})
        against = labels.compared(found, found.plant)
        assert against["delay"] < rivals.ALIKE
        assert against["lag"] < rivals.ALIKE
        assert against["drift"] > 1.5


def outcome(
    kind: str = "single",
    true: tuple[str, ...] = ("lag",),
    names: tuple[str, ...] = ("lag",),
    groups: tuple[tuple[str, ...], ...] = (),
    alike: tuple[str, ...] = (),
    residual: float = 1.05,
    **more: Any,
) -> score.Outcome:
    listed = [{"name": n, "form": "x", "ratio": more.get("ratio", 8.0), "indistinguishable": list(alike)} for n in true]
    label = {
        "case": "case_x",
        "kind": kind,
        "seed": 1,
        "block": "tune",
        "bench": "static",
        "effects": listed,
        "foreign": {"name": more["fault"]} if "fault" in more else None,
        "noise": {"rms": 2.0, "holdout": 2.0},
        "visible": more.get("ratio", 8.0) >= 3.0,
    }
    found = {
        "verdict": "effects_found" if names else more.get("verdict", "nothing_missing"),
        "effects": [{"name": name} for name in names],
        "not_separable": [list(group) for group in groups],
        "unexplained": more.get("unexplained", []),
        "gap": {"after": {"holdout": 2.0 * residual}},
    }
    ran = {"exit": more.get("exit", 0), "seconds": 1.0, "stderr": more.get("said", "r01.csv:3:1: error: no number\n")}
    return score.Outcome(label, None if more.get("missing") else found, ran)


class TestScore:
    def test_right_wrong_and_alike(self) -> None:
        assert outcome().exact
        assert not outcome(names=("delay",)).first_right
        # Indistinguishable by the label, but not reported as such
        assert not outcome(names=("delay",), alike=("delay",)).first_right
        said = outcome(names=("delay",), alike=("delay",), groups=(("lag", "delay"),))
        assert said.exact
        assert said.column == score.ALIKE
        # Reported as indistinguishable, but not by the label
        excuse = outcome(names=("delay",), groups=(("lag", "delay"),))
        assert not excuse.first_right
        assert excuse.confident_wrong == []
        # A group that holds a third, separable name
        assert not outcome(names=("delay",), alike=("delay",), groups=(("lag", "delay", "creep"),)).first_right
        assert outcome(names=(), alike=("delay",), groups=(("lag", "delay"),)).first_right
        assert not outcome(names=()).first_right
        extra = outcome(names=("lag", "creep"))
        assert extra.first_right
        assert not extra.exact
        assert extra.wrong == ["creep"]

    def test_pairs_need_both_names(self) -> None:
        assert outcome("pair", ("lag", "creep"), ("creep", "lag")).exact
        assert not outcome("pair", ("lag", "creep"), ("creep",)).all_named
        three = outcome("pair", ("lag", "creep"), ("creep", "lag", "drift"))
        assert three.all_named
        assert not three.exact

    def figures(self, *outcomes: score.Outcome) -> dict[str, score.Figure]:
        return {figure.what: figure for figure in score.figures(outcomes)}

    def test_limits(self) -> None:
        good = [outcome() for _ in range(97)]
        kept = self.figures(*good, *[outcome(names=("delay",))] * 3)
        assert kept["single: right name first"].value == pytest.approx(0.97)
        assert kept["single: right name first"].kept
        assert not self.figures(*good, *[outcome(names=("delay",))] * 4)["single: right name first"].kept
        # Effects too weak to be expected do not count
        assert self.figures(*good, *[outcome(names=(), ratio=2.9)] * 50)["single: right name first"].value == 1.0
        free = self.figures(*[outcome("none", (), ())] * 9, outcome("none", ()))
        assert free["effect-free: cases with a name"].value == 1.0
        assert not free["effect-free: cases with a name"].kept
        odd = self.figures(
            outcome("foreign", (), (), fault="hum", verdict="unexplained"),
            outcome("foreign", (), (), fault="hum", missing=True, exit=2),
            outcome("foreign", (), (), fault="hum"),
            outcome("foreign", (), (), fault="hum", missing=True, exit=2, said="Usage: hystgen [OPTIONS]"),
            outcome("foreign", (), fault="hum", unexplained=[{"kind": "line"}]),
        )
        assert odd["foreign: cases with a name"].value == 1.0
        assert odd["foreign: flagged"].value == pytest.approx(0.6)
        assert odd["cases without a result"].value == 1.0
        poor = self.figures(
            outcome("poor", names=("creep",)), outcome("poor", names=("delay",), groups=(("lag", "delay"),))
        )
        assert poor["poor excitation: confident wrong name"].value == 1.0
        missing = self.figures(outcome(missing=True, exit=1), outcome())
        assert missing["cases without a result"].value == 1.0
        assert missing["single: right name first"].value == 0.5

    def test_leaving_all_open_is_seen(self) -> None:
        wide = outcome(groups=(("lag", "delay", "creep"),), alike=("delay",))
        assert wide.overcautious
        assert not outcome(groups=(("lag", "delay"),), alike=("delay",)).overcautious
        refused = outcome("foreign", (), (), fault="hum", missing=True, exit=2)
        some = [wide, outcome(), outcome("poor", names=()), refused]
        found = score.asides(some)
        assert found["single: left open though separable"] == 0.5
        assert found["poor excitation: nothing named"] == 1.0
        assert found["foreign: refused as bad input"] == 1.0

    def test_residual_over_noise(self) -> None:
        found = self.figures(*[outcome(residual=x) for x in (1.0, 1.1, 1.2, 1.3, 5.0)])
        assert found["held-out residual over noise, median"].value == pytest.approx(1.2)
        assert not found["held-out residual over noise, median"].kept
        assert not found["held-out residual over noise, 90 %"].kept

    def test_curve_and_confusion(self) -> None:
        some = [
            outcome("snr", ratio=0.7, names=()),
            outcome("snr", ratio=0.8),
            outcome("single", ratio=4.0, names=("creep",)),
            outcome("none", (), ()),
        ]
        rows = {row["from"]: row for row in score.curve(some)}
        assert rows[0.5] == {"from": 0.5, "to": 1.0, "cases": 2, "right": 0.5, "wrong": 0.0, "silent": 0.5}
        assert rows[3.0]["wrong"] == 1.0
        table = score.confusion(some)
        assert table["lag"] == {"creep": 1}
        assert table["none"] == {score.NOTHING: 1}
        assert "creep" in score.text(some, score.figures(some))

    def test_what_is_not_visible_is_reported_but_not_counted(self) -> None:
        hidden = outcome("pair", ("lag", "creep"), (), ratio=2.0)
        some = [hidden, *[outcome("pair", ("lag", "creep"), ("lag", "creep"))] * 3]
        (figure,) = [figure for figure in score.figures(some) if figure.what == "pair: both names"]
        assert (figure.value, figure.cases) == (1.0, 3)
        assert score.asides(some)["pair: not visible, not counted"] == 0.25


FAKE = """
import json, pathlib, sys
words = sys.argv[1:]
here = pathlib.Path.cwd()
lost = [str(p) for p in [here, here.parent] for p in p.iterdir() if "label" in p.name]
seen = {"words": words, "files": sorted(p.name for p in here.iterdir()), "labels": lost}
pathlib.Path("out").mkdir()
pathlib.Path("out/diagnosis.json").write_text(json.dumps({
    "verdict": "nothing_missing", "effects": [], "not_separable": [], "unexplained": [],
    "gap": {"after": {"holdout": 1.0}}, "seen": seen}))
"""


class TestCommands:
    def test_generate_run_score(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        words = ["generate", "--block", "report", "--kind", "single", "--seeds", "5:6", "--no-rivals"]
        assert main([*words, "-o", str(tmp_path)]) == 0
        (truth,) = [json.loads(path.read_text()) for path in (tmp_path / "labels").iterdir()]
        assert (truth["seed"], truth["block"]) == (case.REPORT + 5, "report")
        home = tmp_path / "cases" / truth["case"]
        results = tmp_path / "results"
        assert run.diagnose(home, results, 60.0, (sys.executable, "-c", FAKE)) == 0
        seen = json.loads((results / home.name / "diagnosis.json").read_text())["seen"]
        spec = json.loads((home / "session.json").read_text())
        assert seen["labels"] == []
        assert seen["files"] == sorted(path.name for path in home.iterdir())
        assert seen["words"][: len(spec["fit"]) + 4] == ["diagnose", "params.yaml", *spec["fit"], "-o", "out"]
        assert [seen["words"][k + 1] for k, w in enumerate(seen["words"]) if w == "--holdout"] == spec["holdout"]
        history = [w.removeprefix("--history=") for w in seen["words"] if w.startswith("--history=")]
        assert [[float(x) for x in h.split(",")] for h in history] == ([spec["history"]] if spec["history"] else [])
        kept = (results / home.name / "run.json").read_text()
        assert json.loads(kept)["exit"] == 0
        # A case with a result is not run again, so the package is not called
        assert main(["run", str(tmp_path / "cases"), "-o", str(results)]) == 0
        assert (results / home.name / "run.json").read_text() == kept
        report = tmp_path / "score.json"
        given = ["score", *(str(tmp_path / name) for name in ("cases", "labels", "results")), "--json", str(report)]
        assert main(given) == 1
        shown = capsys.readouterr().out
        assert "1 cases of the report block" in shown
        assert "MISSED single: right name first" in shown
        assert json.loads(report.read_text())["blocks"] == ["report"]

    def test_a_command_that_hangs_is_a_case_without_a_result(self, tmp_path: Path) -> None:
        home = labels.write(case.make("none", 0, 300), tmp_path, with_rivals=False)
        hang = (sys.executable, "-c", "import time; time.sleep(60)")
        assert run.diagnose(home, tmp_path / "results", 0.5, hang) == -1
        assert not (tmp_path / "results" / home.name / "diagnosis.json").exists()

    def test_tune_seeds_do_not_reach_the_report_block(self, capsys: pytest.CaptureFixture[str]) -> None:
        with pytest.raises(SystemExit):
            main(["generate", "--block", "tune", "--kind", "none", "--seeds", "9999:10002", "-o", "x"])
        assert "tune" in capsys.readouterr().err


class TestActivatedFriction:
    """A slider that needs `y (1 + s asinh(slip/c))` to slip: y = 10, s = 0.04, c = 50 in input units and seconds."""

    WIDTH, STRENGTH, RATE = 10.0, 0.04, 50.0

    def stretch(self, v: Array, dt: float) -> Array:
        """Stretch of the spring."""
        y, one = np.array([self.WIDTH]), np.ones(1)
        return np.asarray(v - base._activated(v, np.full(len(v), dt), y, one, self.STRENGTH, self.RATE))

    @pytest.mark.parametrize("speed", [0.5, 50.0, 5e4])
    def test_at_constant_speed_all_of_it_slips(self, speed: float) -> None:
        dt = 0.05 / speed
        there = np.arange(2000) * 0.05
        v = np.concatenate([there, there[-2::-1]])
        expected = self.WIDTH * (1.0 + self.STRENGTH * math.asinh(speed / self.RATE))
        stretch = self.stretch(v, dt)
        assert stretch[1999] == pytest.approx(expected, rel=1e-6)
        assert stretch[-1] == pytest.approx(-expected, rel=1e-6)
        sticks = np.abs(stretch) < self.WIDTH * (1.0 - 1e-9)
        # after the turn, from one limit to the other
        assert abs(np.count_nonzero(sticks) - 2.0 * self.WIDTH / 0.05) <= 2
        assert np.diff(stretch)[sticks[1:]] == pytest.approx(np.diff(v)[sticks[1:]], abs=1e-12)

    def test_finer_steps_change_little(self) -> None:
        """Implicit Euler is of first order: half the step, half the error, on a drive that slows down and turns."""
        outs = []
        for finer in (1, 2, 4):
            t = np.arange(2000 * finer + 1) * (1e-3 / finer)
            outs.append(self.stretch(60.0 * np.sin(2 * np.pi * 1.5 * t), 1e-3 / finer)[::finer])
        coarse, fine = (np.max(np.abs(a - b)) for a, b in pairwise(outs))
        assert coarse < 0.1 * self.WIDTH * self.STRENGTH
        assert fine < 0.65 * coarse


@pytest.mark.thorough
def test_a_diagnosed_plant_follows_a_reference() -> None:
    """The inverse of its diagnosed model leaves an eighth of the error of plays alone; `make track` runs more."""
    row = track.track("delay", 1)
    assert row.named
    assert row.whole < 0.12 * row.plays < 0.12 * row.line
