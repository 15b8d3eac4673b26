"""The watch over the model's error: its bits against plain arithmetic, its false alarms, its cost, what is refused."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import signal, stats

import hystgen
from benchmarks import health as blind
from hystgen.arithmetic import ARITHMETICS, FIXED
from hystgen.basics.problems import FormatError, ParameterError
from hystgen.compensator.health import MODEL_LEFT, Band, FixedWatch, FloatWatch, f_tail
from hystgen.emission import module
from hystgen.emission.calls import emit_options, emitted_files
from hystgen.identification import quality
from hystgen.model import Model
from hystgen.parameters.files import canonical_json, parse_parameters

ARITHMETIC = ("float32", "float64", "q31", "q15")
RESIDUAL = "residual: {rms: 0.01, correlation: 0.002, samples: 300}\n"
TEXT = """\
hystgen: 1
name: m
units: {input: V, output: um}
sample_time: 5.0e-5
input_range: [0.0, 100.0]
model:
  pi:
    thresholds: [0, 5, 10, 20]
    weights: [0.1, 0.02, 0.01, 0.005]
"""
EFFECTS = TEXT + "  effects:\n    - {name: creep, time_constants: [0.1, 1.0], weights: [0.02, 0.01]}\n"


def model(more: str = RESIDUAL, text: str = TEXT) -> Model:
    return Model(parse_parameters(text + more))


def short(window: int = 64, **more: Any) -> str:
    """A residual, and short windows."""
    keys = "".join(f", {key}: {value}" for key, value in more.items())
    return RESIDUAL + f"emit: {{health: {{window: {window}{keys}}}}}\n"


@pytest.mark.parametrize("p", [0.05, 1e-3, 5e-7])
@pytest.mark.parametrize(("n", "m"), [(1.0, 8.0), (1.0, 2500.0), (100.0, 20.5), (3000.0, 400.0)])
def test_quantiles_are_those_of_the_f_distribution(n: float, m: float, p: float) -> None:
    assert f_tail(n, m, p) == pytest.approx(stats.f.isf(p, n, m), rel=1e-8)


@pytest.mark.parametrize("name", ARITHMETIC)
def test_the_reference_is_plain_arithmetic(name: str) -> None:
    """Against sums of the language's whole numbers, and of numpy's scalars one by one."""
    rng = np.random.default_rng(3)
    band = Band(8, 0.3, 0.5, None, 8.0)
    number = ARITHMETICS[name].number
    watch = FixedWatch(band, 0.01, FIXED[name].code_bits) if name in FIXED else FloatWatch(band, ARITHMETICS[name])
    scale = 100.0 if name in FIXED else 1.0
    expected, measured = ((scale * rng.normal(0, 0.4, (2, 400))).astype(number))
    if name in FIXED:
        expected[10], measured[10], measured[11] = np.iinfo(number).min, np.iinfo(number).max, np.iinfo(number).min
    else:
        measured[[10, 60, 61]], expected[[90, 61]] = (np.nan, np.inf, np.inf), (-np.inf, np.inf)
        measured[200], expected[200] = 1e38, -1e38
    found = watch.update(expected, measured)
    total, squares, count = (0, 0, 0) if name in FIXED else (number.type(0), number.type(0), 0)
    answer: tuple[Any, Any, Any] = (0, 0, 0)
    seen = set()
    with np.errstate(over="ignore", invalid="ignore"):
        for k, (a, b) in enumerate(zip(expected, measured, strict=True)):
            if name in FIXED:
                halved, bits = (2, 3) if name == "q31" else (1, 0)  # 2^31 / 2, and 31 + 31 + 3 - 62 bits too many
                error = int(b) // halved - int(a) // halved
                part = error // 2 ** -(-bits // 2)
            else:
                error = part = b - a
                if not np.isfinite(error):
                    assert [each[k] for each in found] == list(answer)
                    continue
            total, squares, count = total + error, squares + part * part, count + 1
            if count == 8:
                if name in FIXED:
                    lsb = 0.01 * halved
                    mean, square, rms = total // 8, squares, (squares / 8) ** 0.5 * 2 ** -(-bits // 2) * lsb
                    left = abs(total / 8 * lsb) > 0.3, rms > 0.5
                else:
                    mean, square = total * number.type(0.125), squares * number.type(0.125)
                    left = abs(float(mean)) > 0.3, float(square) > 0.25
                answer = (MODEL_LEFT if any(left) else 0, mean, square)
                near = name in FIXED and (abs(mean * lsb) < 0.34) and (rms < 0.53)  # a code wider, and rounded up
                if near:
                    answer = (found[0][k], mean, square)
                seen.add(int(answer[0]))
                total, squares, count = type(total)(0), type(squares)(0), 0
            assert [each[k] for each in found] == list(answer), k
    assert seen == {0, MODEL_LEFT}


@pytest.mark.parametrize(("name", "layout", "text"), [
    ("float32", "single-header", EFFECTS), ("float64", "self-contained", TEXT), ("q31", "shared-runtime", TEXT),
    ("q15", "self-contained", EFFECTS),
])
def test_the_c_has_the_bits_of_the_reference(name: str, layout: str, text: str) -> None:
    report = hystgen.verify(
        model(short(), text), arithmetic=name, layout=layout, compiler=["gcc"], length=900, health=True
    )
    assert report.ok, report.table()
    rows = [row for row in report.rows if row.operator == "health"]
    assert [row.samples for row in rows] == [900, 900]


@pytest.mark.parametrize("name", ["float32", pytest.param("q31", marks=pytest.mark.slow), "q15"])
def test_forty_instructions_and_forty_bytes(name: str) -> None:
    report = hystgen.verify(
        model(short()), arithmetic=name, operator="forward", compiler=["gcc"], targets=["cortex-m4f"],
        target_length=300, health=True,
    )
    rows = [row for row in report.rows if row.operator == "health"]
    if not rows:
        (pytest.fail if os.environ.get("CI") else pytest.skip)(report.table())
    assert report.ok, report.table()
    assert all(row.max_instructions is not None and 15 < row.max_instructions <= 40 for row in rows)


@pytest.mark.parametrize("name", ARITHMETIC)
def test_an_instance_takes_forty_bytes_at_most(name: str) -> None:
    one = model()
    cost = module.of(one, emit_options(one, arithmetic=name, health=True)).cost
    assert 0 < dict(cost.memory.instances)["health"] <= 40


def test_without_the_option_nothing_changes() -> None:
    plain, watched = emitted(False), emitted(True)
    assert not any("health" in text.lower() for text in plain.values())
    assert "--health" in watched["m.h"]
    assert "M_STATUS_MODEL_LEFT 64u" in watched["m.h"]
    assert canonical_json(model("").parameters) == canonical_json(model("emit: {operator: inverse}\n").parameters)


def emitted(health: bool) -> dict[str, str]:
    return emitted_files(model(), health=health)


def test_check_knows_the_option(run: Callable[..., tuple[int, str, str]], tmp_path: Path) -> None:
    file = tmp_path / "m.yaml"
    file.write_text(TEXT + RESIDUAL)
    assert run("emit", file, "-o", tmp_path / "c", "--health", "--manifest")[0] == 0
    assert run("emit", file, "-o", tmp_path / "c", "--health", "--manifest", "--check")[0] == 0
    assert run("emit", file, "-o", tmp_path / "c", "--check")[0] == 1
    assert '"operator": "health"' in (tmp_path / "c" / "m_manifest.json").read_text()


@pytest.mark.parametrize(("more", "text", "place", "words"), [
    ("", TEXT, "emit.health", "band: 0.05"),
    (RESIDUAL, TEXT.replace("sample_time: 5.0e-5\n", ""), "sample_time", "add `sample_time: SECONDS`"),
    ("emit: {health: {band: 1.0e-25}}\n", TEXT, "emit.health", "in smaller units"),
])
def test_what_cannot_be_watched_is_refused(more: str, text: str, place: str, words: str) -> None:
    with pytest.raises(FormatError) as wrong:
        module.of(one := model(more, text), emit_options(one, health=True))
    assert place in str(wrong.value)
    assert words in str(wrong.value)


def test_a_band_for_left_out_effects_has_to_be_given() -> None:
    text = TEXT + "  effects:\n    - {name: drift, rate: 0.001}\n"
    with pytest.raises(FormatError, match="leaves out effects"):
        emitted_files(model(RESIDUAL, text), allow_partial=True, health=True)


@pytest.mark.parametrize(("keys", "words"), [
    ("window: 100", "give 64 or 128"), ("false_alarms: 0.5", "false_alarms"), ("band: 0", "band"),
])
def test_wrong_keys_are_refused(keys: str, words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        model(f"emit: {{health: {{{keys}}}}}\n")


@pytest.mark.slow  # minutes without compiled functions
@pytest.mark.parametrize("colour", [0.0, 0.9])
def test_false_alarms_of_coloured_noise_are_those_stated(colour: float) -> None:
    """A residual of AR(1) noise, and 3000 windows of more of it, each with a zero from a window of its own: the band is
    an estimate from 400 000 samples, which moves the rate by a few per cent; 4 standard deviations of the count, and a
    quarter for windows of which only some tens of samples are independent, so that their sums are not quite normal."""
    p, rng = 0.05, np.random.default_rng(7)
    noise = signal.lfilter([np.sqrt(1 - colour**2)], [1, -colour], rng.normal(size=400_000 + 6000 * 512))
    found = quality.residual([noise[:400_000]], 1e-3)
    assert found is not None
    more = f"residual: {{rms: {found.rms}, correlation: {found.correlation}, samples: {found.samples}}}\n"
    text = TEXT.replace("5.0e-5", "1.0e-3") + more + f"emit: {{health: {{window: 512, false_alarms: {p}}}}}\n"
    watch = FloatWatch(Band.of(parse_parameters(text)), ARITHMETICS["float32"])
    before, windows = np.swapaxes(noise[400_000:].reshape(3000, 2, 512), 0, 1)
    status, *_ = watch.update(np.zeros(3000 * 512), (windows - before.mean(axis=1, keepdims=True)).ravel())
    count = int(np.sum(status[511::512] == MODEL_LEFT))
    wanted = p * 3000
    assert 0.5 * wanted < count < 1.25 * wanted + 4.0 * wanted**0.5


@pytest.mark.slow  # identification without compiled functions takes minutes
@pytest.mark.parametrize("seed", [0, 1])
def test_a_healthy_stage_raises_no_alarm_and_a_changed_one_does(seed: int) -> None:
    """A stage of relays, which the package does not know; `benchmarks.health` does the same for 300 sessions."""
    one, stage = blind.identified(seed)
    sessions = [blind.errors(one, stage, 100 + seed)]
    wrong, windows = blind.alarms(one, sessions, 0.001)
    assert windows >= 2
    assert wrong == 0
    found, windows = blind.alarms(one, [(e, 1.05 * m) for e, m in sessions], 0.001)
    assert found == windows
