"""The noise gain of the emitted inverse and the averages that limit it, measured on the bit-exact reference itself."""

from __future__ import annotations

import math
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from modelfiles import BRANCHES, CREEP, chain

import hystgen
from hystgen.basics import jit
from hystgen.basics.problems import FormatError, UnsupportedEffectsError
from hystgen.cli import main
from hystgen.compensator.chain import noise, tables
from hystgen.compensator.chain.layout import Compiled
from hystgen.compensator.chain.run import answers
from hystgen.compensator.chained import Compensator
from hystgen.effects import Run
from hystgen.emission.calls import emit_options, emitted_files
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters
from hystgen.parameters.schema import Compensation

T = 1e-3
LAG = "name: lag, time_constant: 0.01"
MODE, DELAY = "name: resonance, frequency: 30, damping: 0.05", "name: delay, time: 2.6e-3"
RELAXING = "name: rate_dependence, shape: relaxation, time_constant: 5.0e-3"
DILATED = "name: rate_dependence, betas: [1.0e-4, 1.0e-4, 1.0e-4, 3.0e-4, 3.0e-4, 3.0e-4]"


def model(*effects: str, front: str = "", **options: Any) -> Model:
    one = parse_parameters(chain("noisy", *effects, front=front), "noisy.yaml")
    how = one.emit.compensation.model_copy(update=Compensation(**options).model_dump(exclude_unset=True))
    return Model(one.model_copy(update={"emit": one.emit.model_copy(update={"compensation": how})}))


def compiled(one: Model, arithmetic: str = "float64") -> Compiled:
    return tables.build(one.chain, arithmetic, T, one.parameters.emit.compensation)


def measured(one: Model) -> float:
    """Largest gain from a small impulse on a ramp to the drive, relative to that of the plays, all of which move."""
    numbers = compiled(one)
    n = 400
    u = np.linspace(-7.0, 7.5, n)
    moved = u.copy()
    moved[330] += 1e-6
    with jit.plain():
        plain, other = (answers(numbers, Run(np.arange(n) * T, each, {}), True) for each in (u, moved))
    end = n - 8  # after it the reference stops and repeats its last sample
    assert np.max(np.abs(plain[:end])) < 4.0, "nothing is limited"
    gain = np.abs(np.fft.rfft((other - plain)[:end], 1 << 15)) / 1e-6
    return float(np.max(gain)) * one.cascade.pi.slopes[-1]


@pytest.mark.slow(one_in=2)
@pytest.mark.parametrize(
    ("effects", "options"),
    [
        ((LAG,), {}), ((RELAXING,), {}), ((DILATED,), {}), ((LAG, MODE, DELAY, RELAXING), {"noise_gain": 1e9}),
        ((LAG,), {"noise_gain": 5.0}), ((RELAXING,), {"noise_gain": 2.0}), ((DILATED,), {"noise_gain": 1.2}),
        ((LAG, MODE, DELAY, RELAXING), {"noise_gain": 9.0}), ((LAG, MODE), {"noise_gain": 30.0, "preview": 0}),
        ((LAG, MODE), {"noise_gain": 30.0, "preview": 2, "corner": 2, "taps": 5}),
    ],
)  # fmt: skip
def test_the_printed_gain_is_the_largest_of_the_bit_reference(effects: tuple[str, ...], options: Any) -> None:
    one = model(*effects, **options)
    text = emitted_files(one)["noisy.h"]
    found = re.search(r"NOISY_NOISE_GAIN ([0-9.e+]+)f", text)
    assert found
    printed = float(found[1])
    assert measured(one) == pytest.approx(printed, rel=2e-4)
    assert printed <= options.get("noise_gain", math.inf) * (1.0 + 1e-6)
    assert ("Noise: references are averaged" in text) == (options.get("noise_gain", 1e9) < 1e9)


def rows(times: int, width: float, centred: bool) -> np.ndarray[Any, Any]:
    """Weights of `times` averages over a box of `width`, by definition: the share of the box in each sample."""
    low = -0.5 * width if centred else -0.5
    cells = np.arange(-30, 31)
    one = np.clip(np.minimum(low + width, cells + 0.5) - np.maximum(low, cells - 0.5), 0.0, None) / width
    one = one[np.flatnonzero(one)[0] : np.flatnonzero(one)[-1] + 1]
    row = np.ones(1)
    for _ in range(times):
        row = np.convolve(row, one)
    return row[::-1]


@pytest.mark.slow(one_in=2)
@pytest.mark.parametrize(
    ("effects", "limit", "preview"),
    [
        ((LAG,), 12.0, None), ((LAG,), 3.0, 0), ((MODE,), 4.0, None), ((MODE, LAG), 100.0, 1),
        ((LAG, MODE, RELAXING), 25.0, None),
    ],
)  # fmt: skip
def test_no_narrower_averages_hold_the_gain(effects: tuple[str, ...], limit: float, preview: int | None) -> None:
    """Compared with all widths in steps of 0.05, whose responses are the spectra of their weights."""
    one = compiled(model(*effects, noise_gain=limit, preview=preview))
    plain = compiled(model(*effects))
    found = one.smoothing
    assert found is not None
    n = 1 << 10
    alone = noise.Gain(plain.static, plain.parts, T, plain.taps or noise.Taps(0, np.ones(1)))
    base = alone(np.maximum(np.linspace(0.0, np.pi, n // 2 + 1), 1e-9))
    least = math.inf
    for times in (1, 2, 3, 4):
        for width in np.arange(1.0, 20.0, 0.05):
            row = rows(times, float(width), found.centred)
            if np.max(base * np.abs(np.fft.rfft(row, n))) <= limit:
                at = np.arange(len(row))
                least = min(least, float(row @ (at - row @ at) ** 2))
                break
    assert 0.9 * least <= found.variance <= 1.001 * least
    np.testing.assert_allclose(found.row, rows(found.times, found.width, found.centred), atol=1e-12)


@pytest.mark.slow(one_in=2)
@pytest.mark.parametrize("preview", [None, 0, 1, 4, 30])
def test_the_motion_is_as_late_as_printed(preview: int | None) -> None:
    """On a ramp, the delay is measured against the motion without averages."""
    effects = LAG, MODE.replace("0.05", "0.5")
    one = model(*effects, noise_gain=40.0, preview=preview)
    numbers = compiled(one)
    n = 240
    u = np.concatenate([np.full(60, -3.0), np.linspace(-3.0, 6.0, n - 60)])
    t = np.arange(n) * T
    with jit.plain():
        y = one.simulate(answers(numbers, Run(t, u, {}), True), t=t)
        plain = one.simulate(answers(compiled(model(*effects)), Run(t, u, {}), True), t=t)
    late = (plain - y)[180:200] / (u[-1] - u[-2])
    assert numbers.smoothing is not None
    assert (numbers.late > 0.5) == (preview in (0, 1, 4))
    np.testing.assert_allclose(late, numbers.late, atol=5e-3)  # the mode rings where plays turn, and fades
    text = emitted_files(one)["noisy.h"]
    assert (f"which is {numbers.late:.4g} late" in text) == (numbers.late > 0.0)


@pytest.mark.parametrize(("period", "loss"), [(50, "1.5"), (200, "0.093")])
def test_a_sine_loses_what_is_printed(period: int, loss: str) -> None:
    one = model(LAG, noise_gain=5.0)
    assert re.search(rf"{re.escape(loss)} % at {period} samples", emitted_files(one)["noisy.h"].replace("\n * ", " "))
    numbers = compiled(one)
    t = np.arange(8 * period) * T
    u = 1.5 + 3.0 * np.sin(2.0 * np.pi * np.arange(len(t)) / period)
    with jit.plain():
        y, plain = (one.simulate(answers(each, Run(t, u, {}), True), t=t) for each in (numbers, compiled(model(LAG))))
    tone = np.exp(-2j * np.pi * np.arange(4 * period) / period)
    passed = np.abs(np.sum(tone * y[3 * period : 7 * period]) / np.sum(tone * plain[3 * period : 7 * period]))
    assert 100.0 * (1.0 - passed) == pytest.approx(float(loss), abs=0.06 if period == 50 else 0.006)


@pytest.mark.slow(one_in=3)
@pytest.mark.parametrize("arithmetic", ["float32", "q31", "q15"])
def test_averages_have_the_bits_and_the_bounds_of_the_rest(arithmetic: str) -> None:
    """Errors are taken against the compensator in double precision, given the averaged reference."""
    one = model(DELAY, MODE, CREEP, noise_gain=7.3)
    with jit.plain():
        report = hystgen.verify(one, arithmetic, compiler=["gcc"], length=150)
    assert report.ok, report.table()
    numbers = compiled(one, arithmetic)
    codes = numbers.codes
    drive, output = (1.0, 1.0) if codes is None else (float(codes.drive_lsb), float(codes.output_lsb))
    rng = np.random.default_rng(3)
    u = np.rint((1.0 + 6.0 * np.sin(np.cumsum(rng.uniform(0.0, 0.03, 900)))) / output * 64.0) / 64.0
    u = np.rint(u) if codes else u
    t = np.arange(len(u)) * T
    with jit.plain():
        v = answers(numbers, Run(t, u, {}), True).astype(float)
    assert numbers.smoothing is not None
    half = (len(numbers.smoothing.row) - 1) // 2
    averaged = np.convolve(np.pad(u * output, half, mode="edge"), numbers.smoothing.row, mode="valid")
    wanted = Compensator(one.chain).drives(Run(t, averaged, {}), one.cascade.input_range) / drive
    left = np.max(np.abs(v - wanted)[: len(u) - numbers.ahead])
    assert left <= (codes.inverse_error if codes else float(header(one, "INVERSE_MAX_ERROR")))


def header(one: Model, macro: str) -> str:
    found = re.search(rf"#define NOISY_{macro} ([^ f]+)", emitted_files(one)["noisy.h"])
    assert found
    return found[1]


def test_what_no_average_holds_is_refused_with_the_least_gain() -> None:
    with pytest.raises(UnsupportedEffectsError, match=r"over 1000 samples .* leave a noise gain of 1\.0\d+, more than"):
        emit_options(model(CREEP, LAG, noise_gain=1.0))
    emit_options(model(CREEP, LAG, noise_gain=1.06))


def test_what_needs_no_average_has_none() -> None:
    plain = emitted_files(model(LAG, CREEP, front=BRANCHES))
    allowed = emitted_files(model(LAG, CREEP, front=BRANCHES, noise_gain=1e3))
    bare = [re.sub(r"sha256 \w+|SHA256 .*", "", text) for text in (plain["noisy.c"], allowed["noisy.c"])]
    assert bare[0] == bare[1]
    assert compiled(model(CREEP)).tables.limits.output.low[0] < 0.0


HEAD = "hystgen: 1\nname: noisy\nunits: {input: V, output: um}\nsample_time: %s\ninput_range: [0, 100]\nmodel:\n"
STAGE = "  pi: {thresholds: [0, 5, 10], weights: [0.1, 0.02, 0.01]}\n  effects:\n"


def of(*effects: str, seconds: str = "1.0e-3", front: str = "", emit: str = "") -> Model:
    """A model with a slope of 0.1 um/V after a turn; `front` and `emit` are further lines of its file."""
    listed = "".join(f"    - {{{effect}}}\n" for effect in effects)
    return Model(parse_parameters(HEAD % seconds + front + STAGE + listed + emit, "noisy.yaml"))


def told(one: Model, **options: Any) -> list[str]:
    """The warnings of an emission; its banner has the same sentences."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        text = emitted_files(one, **options)["noisy.h"].replace("\n * ", " ")
    said = [str(each.message).removeprefix("noisy: ") for each in caught]
    assert all(each in text for each in said)
    return said


def shown_noise(one: Model, arithmetic: str, size: float) -> float:
    """Rms noise of the drive in V for noise of `size` um at half the sample rate, on a still reference after a turn."""
    numbers = compiled(one, arithmetic)
    drive, output = (float(x.drive_lsb), float(x.output_lsb)) if (x := numbers.codes) else (1.0, 1.0)
    u = np.concatenate([np.linspace(3.0, 7.0, 100), np.linspace(7.0, 6.8, 50), np.full(450, 6.8)])
    u[250:] += size * (-1.0) ** np.arange(350)
    u = np.rint(u / output) if numbers.codes else u
    with jit.plain():
        v = answers(numbers, Run(np.arange(len(u)) * T, u, {}), True).astype(float) * drive
    return float(np.std(v[350:]))


@pytest.mark.parametrize("arithmetic", ["float64", "q31"])
def test_the_figure_of_the_noise_is_that_of_the_drive(arithmetic: str) -> None:
    """A sine at the stated frequency, small enough not to move the plays, gives the stated noise of the drive."""
    one = of("name: lag, time_constant: 0.004")
    (said, *_) = told(one, arithmetic=arithmetic)
    found = re.match(
        r"Noise in the reference is amplified up to ([0-9.]+) times as much as slow motion, most at ([0-9.]+) Hz: "
        r"there, ([0-9.e-]+) um rms of it moves the drive by (?:([0-9.e-]+) V rms|one code rms)",
        said,
    )
    assert found, said
    gain, hertz, size = (float(found[k]) for k in (1, 2, 3))
    decay = math.exp(-1.0 / 4.0)
    theta = 4.0 - decay / (1.0 - decay)
    assert gain == pytest.approx((1.0 + 2.0 * theta) * (1.0 + decay) / (1.0 - decay), rel=5e-3)  # of the lead, by hand
    assert hertz == 500.0
    form = compiled(one, arithmetic).codes
    drive = float(found[4]) if form is None else float(form.drive_lsb)
    scale = 0.5 / drive  # to half a volt, which does not move the plays
    assert shown_noise(one, arithmetic, scale * size) == pytest.approx(0.5, rel=1e-2)


def test_little_noise_is_not_told() -> None:
    assert told(of("name: creep, time_constants: [0.1], weights: [0.05]")) == []


def test_more_noise_than_anyone_wants_has_to_be_allowed() -> None:
    loud = "name: lag, time_constant: 0.03"
    for arithmetic in ("float32", "float64", "q31"):
        with pytest.raises(UnsupportedEffectsError, match=r"noise gain is 119\.\d, above 100: .* 1 um rms at 500 Hz"):
            emit_options(of(loud), arithmetic=arithmetic)
        with pytest.raises(UnsupportedEffectsError, match=r"noise_gain: 120$"):
            hystgen.verify(of(loud), arithmetic)
        emit_options(of(loud, emit="emit: {compensation: {noise_gain: 120}}\n"), arithmetic=arithmetic)
        emit_options(of(loud, emit="emit: {compensation: {noise_gain: 10}}\n"), arithmetic=arithmetic)
        emit_options(of(loud), arithmetic=arithmetic, operator="forward")
        emit_options(of("name: lag, time_constant: 0.025"), arithmetic=arithmetic)


@pytest.mark.parametrize(
    "effect",
    [
        "name: lag, time_constant: 0.99", "name: delay, time: 0.99",
        "name: creep, time_constants: [0.01, 0.99], weights: [0.02, 0.03]",
        "name: creep, shape: logarithmic, per_decade: 0.02, t_min: 0.01, t_max: 0.99",
        "name: rate_dependence, shape: relaxation, time_constant: 0.99",
        "name: rate_dependence, betas: [0.5, 0.99]", "name: slew_limit, rate: 101.1, falling_rate: 300",
        "name: resonance, frequency: 1.0, damping: 0.1608", "name: resonance, frequency: 0.5, damping: 1.71",
    ],
)  # fmt: skip
def test_effects_that_are_over_within_a_sample_are_told(effect: str) -> None:
    """Effects just below a 50th of a sample are reported; slower effects, or those next to a slow one, are not."""
    (said,) = (each for each in told(of(effect, seconds="50.0")) if each.startswith("Effects die out"))
    name = effect.partition(",")[0].removeprefix("name: ")
    assert f"the slowest, {name}, takes 0.9" in said
    assert "5e-05 for 50 us" in said
    slow = "name: lag, time_constant: 20" if name == "creep" else CREEP
    for other in (of(effect, seconds="49.0"), of(effect, slow, seconds="50.0")):
        assert not any(each.startswith("Effects die out") for each in told(other))


def test_an_inverse_without_a_bound_states_the_error_found() -> None:
    one = of("name: lag, time_constant: 1.0e-3")
    found = float(header(one, "INVERSE_MEASURED_ERROR"))
    assert told(one) == [
        f"Accuracy: no bound of the inverse's error is known; the largest found in 4800 samples is {found:.2g} V"
    ]
    text = emitted_files(one)["noisy.h"]
    assert "INVERSE_MAX_ERROR" not in text
    assert "no bound: the largest found in 4800 samples" in text
    assert told(one, operator="forward") == []


def test_sizes_of_codes_are_refused_where_there_are_no_codes(tmp_path: Path) -> None:
    path = tmp_path / "noisy.yaml"
    path.write_text(HEAD % "1.0e-3" + STAGE.replace("  effects:\n", "") + "emit: {drive_lsb: 0.1, output_lsb: 0.1}\n")
    for command in ("emit", "verify"):
        done = CliRunner().invoke(main, [command, str(path), *(["-o", str(tmp_path / "fw")] * (command == "emit"))])
        assert done.exit_code == 2
        assert [line.split(": is the size of a code")[0] for line in done.output.splitlines()] == [
            f"{path}:8:19: error: emit.drive_lsb", f"{path}:8:36: error: emit.output_lsb"
        ]  # fmt: skip
    assert not (tmp_path / "fw").exists()
    assert CliRunner().invoke(main, ["show", str(path)]).exit_code == 0
    emitted_files(hystgen.load(path), arithmetic="q15")
    quiet = "emit: {drive_lsb: 0.1, compensation: {quiet: true}}\n"
    emit_options(of("name: lag, time_constant: 0.002", emit=quiet))  # drive_lsb is the step of its converter
    with pytest.raises(FormatError, match=r"emit\.drive_lsb: is the size of a code, and float32 has no codes"):
        emit_options(of("name: lag, time_constant: 0.002", emit=quiet), operator="forward")
