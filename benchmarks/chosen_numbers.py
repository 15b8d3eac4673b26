"""Runs behind chosen numbers that no test of a model can set: what other values would cost or break.

    python benchmarks/chosen_numbers.py [lag] [newton] [decades] [sweeps] [unknown] [exact] [lengths] [visits]
        [quiet] [averages] [shifts] [branches] [noisy] [fast] [samples] [tries] [secants]

lag: `effects.lag.compensator.LONG_STEP`; newton: `effects.gains.MOST_CHANGE`; decades:
`effects.ageing.compensator.DECADES`; sweeps: `emission.worth.SWEEPS`; unknown: `tracking.MOST_UNKNOWN`; exact:
`diagnosis.data.signals.UNMEASURED`; lengths: `diagnosis.findings.content.LENGTHS`; visits: `chain.chain.VISIT_SAMPLES`;
quiet: `compensator.chain.layout.QUIET`; averages: `compensator.chain.noise.MOST_TIMES`; shifts: the bounds of
`compensator.chain.moving.found_shifted`; branches: `effects.lag.compensator.MOST_LED`; noisy: `model.MOST_GAIN` and
`emission.doubts.NOISY`; fast: `emission.doubts.FAST`; samples: `compensator.chain.measured.SAMPLES`; tries:
`effects.plays.NEWTON_TRIES`; secants: `effects.plays.SECANTS`. Each takes some seconds, shifts a minute; random numbers
have fixed seeds.
"""

from __future__ import annotations

import argparse
import itertools
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
from numpy.typing import NDArray

import hystgen
from hystgen import plants
from hystgen.basics import jit
from hystgen.chain import chain
from hystgen.compensator import reference
from hystgen.compensator.chain import layout, measured, moving, moving_fixed, moving_float, noise, preview, tables
from hystgen.compensator.chain.layout import SAMPLES_A_SWEEP
from hystgen.compensator.chain.parts import BENDS, MOVES
from hystgen.compensator.chain.run import answers as reference_answers
from hystgen.compensator.chained import STANDARD
from hystgen.diagnosis.data import signals
from hystgen.diagnosis.data.items import Item
from hystgen.diagnosis.findings import content
from hystgen.effects.ageing import compensator as ageing
from hystgen.effects.ageing.model import LogarithmicAgeing
from hystgen.effects.base import Run
from hystgen.effects.lag import compensator as led
from hystgen.effects.lag.compensator import UnevenLag
from hystgen.effects.lag.model import Lag
from hystgen.parameters.files import parse_parameters
from hystgen.parameters.schema import Compensation
from hystgen.plays import slots
from hystgen.records import Record

EXAMPLES = Path(__file__).parents[1] / "examples"
WITH_EFFECT = """\
hystgen: 1
name: stage_x
sample_time: 1.0e-3
input_range: [-4, 4]
model:
  pi: {{thresholds: [0, 0.45, 0.9], weights: [0.72, 0.6, 0.48]}}
  effects:
    - {{{effect}}}
"""
EFFECTS = (
    "name: creep, time_constants: [0.1, 1.0], weights: [0.02, 0.01]",
    "name: lag, time_constant: 2.0e-3",
    "name: resonance, frequency: 120, damping: 0.02",
    "name: ageing, shape: logarithmic, loss: 0.01, travel: 1.0e4",
    "name: slew_limit, rate: 2000",
)


MOVING_PLAYS = (
    "name: rate_dependence, betas: [1.0e-4, 2.0e-4]",
    "name: rate_dependence, shape: relaxation, time_constant: 5.0e-3, exponent: 2",
    "name: noncongruent, coefficients: [[0.02, 0.01], [0.02, 0.05]]",
    "name: noncongruent, shape: centre, amplitude: 0.4, centre: 1, width: 0.8",
)


def lag() -> None:
    """Largest gain from reference to drive and error on a sine of 40 steps, for both inverses of a lag of 1 s."""
    print("lag: step / time constant, pole of the exact inverse, its gain and that of the lead, error of the lead, %")
    for step in (0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0):
        block = UnevenLag(Lag(name="lag", time_constant=1.0))
        block.advance(step)
        pole = -float(block.table.inverted.early[1] / block.table.inverted.late[1])

        def drives(reference: NDArray[np.float64], exact: bool, block: UnevenLag = block) -> tuple[Any, Any]:
            block.rest(0.0)
            block.exact = exact
            pairs = [(x := block.solve(y), block.absorb(x)) for y in reference.tolist()]
            return tuple(np.array(each) for each in zip(*pairs, strict=True))

        impulse = np.eye(1, 400)[0]
        gains = [float(np.sum(np.abs(drives(impulse, exact)[0]))) for exact in (True, False)]
        sine = np.sin(2.0 * np.pi * np.arange(200) / 40.0)
        error = 100.0 * float(np.max(np.abs(drives(sine, False)[1] - sine)[80:]))
        print(f"  {step:5.2f} {pole:7.3f} {gains[0]:9.3g} {gains[1]:9.3g} {error:9.3g}")


def newton() -> None:
    """Number of Newton steps from the reciprocal of the old gain to that of the new gain."""
    print("newton: change of the gain in one step, iterations to 2^-24 and to 2^-53")
    for change in (0.1, 0.25, 0.5, 0.75, 0.9):
        iterations = [
            next(n for n in itertools.count(1) if change ** (2**n) < roundoff) for roundoff in (2.0**-24, 2.0**-53)
        ]
        print(f"  {change:5.2f} {iterations[0]:4} {iterations[1]:4}")


def decades() -> None:
    """The table of a logarithmic gain that loses 5 % per decade: its pieces, bytes in float32, and gain at the end."""
    print("decades: decades, pieces, bytes, gain at the end")
    effect = LogarithmicAgeing(name="ageing", loss=0.05, travel=1.0)
    whole = ageing.pieces(effect)
    for power in (2, 3, 4, 5, 6):
        count = int(np.sum(whole.begin < 10.0**power))
        print(f"  {power:3} {count:4} {24 * count:6} {ageing.gain(effect, 10.0**power):7.3f}")


def sweeps() -> None:
    """Rms contribution of an effect to the output over a number of sweeps, relative to that over 64 sweeps."""
    counts = (1, 2, 4, 8, 16, 32)
    print("sweeps: effect, worth over", *counts, "sweeps / over 64")
    for effect in EFFECTS:
        model = hystgen.Model(parse_parameters(WITH_EFFECT.format(effect=effect), "stage_x.yaml"))
        place = np.arange(64 * SAMPLES_A_SWEEP + 1) / SAMPLES_A_SWEEP
        v = -4.0 + 8.0 * np.abs(place % 2.0 - 1.0)
        missing = model.simulate(v) - model.without(model.effects).simulate(v)
        rms = [math.sqrt(float(np.mean(missing[: n * SAMPLES_A_SWEEP + 1] ** 2))) for n in (*counts, 64)]
        print(f"  {model.effects[0].name:12}", *(f"{each / rms[-1]:7.3f}" for each in rms[:-1]))


def unknown() -> None:
    """The rms error of a fit over parts of a record, relative to that over the whole record."""
    shares = (0.5, 0.2, 0.1, 0.05, 0.02)
    print("unknown: record, length of a part of it, least and largest rms over such a part / over all")
    fit = hystgen.identify(EXAMPLES / "stage_recording.csv")
    for name in ("stage_recording", "stage_holdout"):
        t, v, y = np.loadtxt(EXAMPLES / f"{name}.csv", delimiter=",", skiprows=1, usecols=(0, 1, 2)).T
        error = y - fit.model.simulate(v)
        error -= error.mean()
        whole = math.sqrt(float(np.mean(error**2)))
        for share in shares:
            n = max(2, round(share * len(t)))
            begins = range(0, len(t) - n + 1, max(1, n // 2))
            parts = [math.sqrt(float(np.var(error[at : at + n]))) / whole for at in begins]
            print(f"  {name:16} {share:5.0%} {min(parts):6.2f} to {max(parts):5.2f}")


def exact() -> None:
    """Largest change of held samples and largest bend of interpolated ones after rounding to digits, as fractions of
    the output's range."""
    print("exact: written with digits, offset / range, largest change where nothing was measured: held, interpolated")
    t = np.arange(4001)
    slow = np.arange(0, 4001, 8)
    y = np.sin(0.01 * slow) + 1e-4 * np.random.default_rng(1).normal(size=len(slow))
    for digits, offset in itertools.product((17, 12, 9, 6), (0.0, 10.0, 1000.0)):
        held, line = (np.array([float(f"{x:.{digits}g}") for x in each]) for each in (
            offset + np.repeat(y, 8)[:4001], np.interp(t, slow, offset + y)
        ))  # fmt: skip
        span = float(np.ptp(y))
        between = np.arange(4000) % 8 != 7
        bend = np.arange(1, 4000) % 8 != 0
        largest = [np.max(np.abs(np.diff(held))[between]), np.max(np.abs(np.diff(line, 2))[bend])]
        words = ["found" if len(signals._sampled(each)) < len(each) else "not found" for each in (held, line)]
        print(f"  {digits:3} {offset:6g}", *(f"{x / span:9.2g} {word}" for x, word in zip(largest, words, strict=True)))


def lengths() -> None:
    """Fractions of a play sum's error explained with and without rates, on three rate-independent plants and one with
    creep."""
    print("lengths: plant, error explained without rates / with them, by averages over 0, 2, 3, 4, 6 and 11 distances")
    t = 1e-3 * np.arange(12000)
    v = 4.0 * np.exp(-0.15 * t) * np.sin(2.0 * np.pi * (0.7 * t + 0.05 * t**2))
    every = np.geomspace(content.LENGTHS[0], content.LENGTHS[-1], 11)
    sets: tuple[Any, ...] = ((), every[[0, 10]], every[::5], every[[0, 3, 7, 10]], content.LENGTHS, every)
    stages: dict[str, Callable[[NDArray[np.float64]], NDArray[np.float64]]] = {
        "Bouc-Wen": plants.BoucWen(1.5, 2.0, D=1.3).simulate,
        "Dahl": plants.Dahl(2.0, 1.5).simulate,
        "Jiles-Atherton": plants.JilesAtherton(2.0, 1.0, 0.8, 0.5, 0.2).simulate,
        "creep": hystgen.Model(parse_parameters(WITH_EFFECT.format(effect=EFFECTS[0]), "stage_x.yaml")).simulate,
    }
    for name, simulate in stages.items():
        y = simulate(v)
        record = Record("made", t, v, y)
        error = y - hystgen.identify([record], thresholds=6).model.simulate(v)
        item = Item("made", Run(t, v), y, None, float(np.ptp(y)))
        shares = []
        for each in sets:
            with mock.patch.object(content, "LENGTHS", each):
                shares.append(content.together([item], [error]))
        print(f"  {name:15}", *(f"{free:5.2f}/{rates:4.2f}" for free, rates in shares))


def visits() -> None:
    """How much the output after a history depends on the number of samples per move of that history."""
    samples = (25, 100, chain.VISIT_SAMPLES, 800)
    print(f"visits: effect, largest change, share of the answer's range: {samples} samples a move against 3200")
    v = np.concatenate([np.linspace(1.0, 3.0, 500), np.linspace(3.0, -2.0, 800)])
    run = Run(1e-3 * np.arange(len(v)), v)
    for effect in (
        "name: creep, shape: logarithmic, per_decade: 0.02, t_min: 1.0e-3, t_max: 1.0e4",
        "name: lag, time_constant: 2.0",
        "name: resonance, frequency: 0.5, damping: 0.05",
        "name: thermal, source: self_heating, time_constant: 5, heating: 0.05, gain_per_degree: -0.02",
        "name: rate_dependence, shape: relaxation, time_constant: 0.5, exponent: 0.5",
    ):
        one = hystgen.Model(parse_parameters(WITH_EFFECT.format(effect=effect), "stage_x.yaml"))
        answers = []
        for number in (*samples, 3200):
            with mock.patch.object(chain, "VISIT_SAMPLES", number):
                answers.append(one.chain.simulate([run], [3.5, -3.5, 1.0])[0])
        changes = [np.max(np.abs(each - answers[-1])) / np.ptp(answers[-1]) for each in answers[:-1]]
        print(f"  {effect.partition(',')[0].removeprefix('name: '):15}", *(f"{x:8.1e}" for x in changes))


def quiet() -> None:
    """Error with a quiet drive on slow ramps, behind a lag of 10 samples in q15, and how often the drive changes.

    The error is the rms difference between the output and the rounded reference, in output codes, from 1 s on.
    """
    counts = (2, 8, layout.QUIET, 128)
    print(f"quiet: samples a code of the ramp; error led always, and quiet from {counts} equal references on; changes")
    one = hystgen.Model(parse_parameters(WITH_EFFECT.format(effect="name: lag, time_constant: 0.01"), "stage_x.yaml"))
    for samples in (3, 10, 20, 40, 100, 400):
        u = np.rint(-2000.0 + np.arange(4000) / samples)
        errors, changes = [], []
        for count in (0, *counts):
            with mock.patch.object(layout, "QUIET", count):
                numbers = tables.build(one.chain, "q15", 1e-3, Compensation(quiet=count > 0))
            assert numbers.codes is not None
            v, _ = reference.answers(numbers.tables, True, np.full(len(u), slots.OP_STEP, dtype=np.uint8), u)
            y = one.simulate(v * float(numbers.codes.drive_lsb), t=1e-3 * np.arange(len(u)))
            error = (y / float(numbers.codes.output_lsb) - u)[1000:]
            errors.append(math.sqrt(float(np.mean(error**2))))
            changes.append(int(np.count_nonzero(np.diff(v[1000:]))))
        print(f"  {samples:4}", *(f"{x:6.3f}" for x in errors), " ", *(f"{x:5}" for x in changes))


def averages() -> None:
    """Errors of averages on smooth references, and of poles in front of the lead with the same noise gain.

    References are sines of equal size with 60 to 480 samples a period; errors are rms, in % of the reference. With a
    preview, the poles are advanced by the number of samples that suits them best; without one, averages look back.
    """
    at = 2.0 * np.pi / np.geomspace(60.0, 480.0, 40)
    leads = {
        "lag, 10 samples": (EFFECTS[1].replace("2.0e-3", "0.01"), 1),
        "mode, 50 samples": (EFFECTS[2].replace("120", "20"), 2),
        "lag and mode": ("name: lag, time_constant: 0.01}\n    - {name: resonance, frequency: 20, damping: 0.02", 3),
    }
    print("averages: lead, limit / noise gain; error of 1 .. 5 averages, of poles; without preview both")
    for name, (effects, order) in leads.items():
        model = hystgen.Model(parse_parameters(WITH_EFFECT.format(effect=effects), "stage_x.yaml"))
        one = tables.build(model.chain, "float64", 1e-3)
        gain = noise.Gain(one.static, one.parts, 1e-3, one.taps or preview.PLAIN)
        for share in (0.5, 0.2, 0.05):
            limit = share * noise.largest(gain)
            errors, variances = [], []
            for times in range(1, 6):
                found, _ = noise.narrowest(gain, limit, times, 300.0, True)
                row, ages = found.row, np.arange(len(found.row)) - found.age
                errors.append(_lost(np.exp(1j * np.outer(at, ages)) @ row))
                variances.append(found.variance)
            z, near = np.exp(-1j * at), np.exp(-1j * gain.near)
            low, high = 0.0, 1.0
            for _ in range(60):
                f = 0.5 * (low + high)
                holds = np.max(gain(gain.near) * np.abs((1.0 - f) / (1.0 - f * near)) ** order) <= limit
                low, high = (low, f) if holds else (f, high)
            poles = ((1.0 - high) / (1.0 - high * z)) ** order
            early = min(_lost(poles * np.exp(1j * at * n)) for n in range(100))
            late = noise.least(gain, limit, 900, False)
            row, ages = late.row, np.arange(len(late.row))[::-1]
            errors += [early, _lost(np.exp(-1j * np.outer(at, ages)) @ row), _lost(poles)]
            print(f"  {name:18} {share:5.2f}", *(f"{each:7.3f}" for each in errors), int(np.argmin(variances)) + 1)


def shifts() -> None:
    """How close a search over random sequences of steps, in which plays follow only in part, comes to `found_shifted`.

    For given steps, the largest error over all shifts is `sum |c_ik|`; the factors are computed backwards from the end.
    """
    print("shifts: largest error that a search finds, share of the bound; plays in order of thresholds, or in any")
    rng = np.random.default_rng(9)
    for in_order in (True, False):
        found = []
        for _ in range(12):
            n = int(rng.integers(2, 6))
            p = 10.0 ** rng.uniform(-2.0, 2.0, n + 1)
            steps, most = [(np.arange(n) < k).astype(float) for k in range(n, 0, -1)], 0.0
            for _ in range(2500):
                tried, k = list(steps), int(rng.integers(len(steps)))
                change = rng.random()
                if change < 0.4 and len(tried) < 40:
                    tried[k:k] = [_followed(rng, n, in_order)] if change < 0.3 else [tried[k]] * 3
                elif change < 0.5 and len(tried) > 1:
                    del tried[k]
                else:
                    factors = np.exp(rng.normal(0.0, 0.4, 1 if in_order else n))
                    tried[k] = _followed(rng, n, in_order) if change < 0.7 else np.clip(tried[k] * factors, 0.0, 1.0)
                if (error := _reached(p, tried)) > most:
                    steps, most = tried, error
            found.append(most / moving.found_shifted(p, p, np.ones(n), in_order))
        print(f"  {'in order' if in_order else 'any order':9}", *(f"{each:5.2f}" for each in sorted(found)))


def _followed(rng: np.random.Generator, n: int, in_order: bool) -> NDArray[np.float64]:
    """Fraction (n,) of its move that each play completes in a step; `in_order`: plays with larger thresholds complete
    no larger a fraction."""
    shares = np.where(rng.random(n) < rng.uniform(0.2, 0.9), rng.choice([1.0, 0.3, 0.1, 0.01], n), 0.0)
    return np.sort(shares)[::-1] if in_order else shares


def _reached(p: NDArray[np.float64], steps: Sequence[NDArray[np.float64]]) -> float:
    """Largest `e` with `p_0 e + sum p_i d_i = 0` after the steps, if each step may shift the input by up to 1."""
    factor, total = -p[1:] / p[0], 0.0
    for shares in reversed(steps):
        kept = factor - p[1:] * float(shares @ factor) / float(p[0] + p[1:] @ shares)
        total += float(np.sum(np.abs(shares * kept)))
        factor = (1.0 - shares) * kept
    return total


def branches() -> None:
    """A lag in front of two branches 0.01 V apart, with the move of the lead limited to several multiples of the
    previous move: errors on sines of 100 and 400 samples from rest, and overshoot of a step of 0.2 um after a slow
    ramp."""
    print("branches: times the move before, rms and largest error on sines of 100 and 400 samples, um, overshoot, um")
    curve = "a0: 6, a1: 0.4, a2: 0.1, a3:"
    front = f"  memoryless: {{kind: tanh, ascending: {{{curve} 0.2}}, descending: {{{curve} 0.21}}}}\n  effects:"
    text = WITH_EFFECT.format(effect="name: lag, time_constant: 0.01").replace("  effects:", front)
    model = hystgen.Model(parse_parameters(text, "stage_x.yaml"))
    step = np.concatenate([np.linspace(-2.0, -1.9, 50), np.full(50, -1.7)])

    def error(u: NDArray[np.float64]) -> NDArray[np.float64]:
        t = np.arange(len(u)) * 1e-3
        return np.asarray(model.simulate(model.inverse().simulate(u, t=t, clamp=True), t=t) - u)

    for times in (1.0, 2.0, 4.0, 1e9):
        with mock.patch.object(led, "MOST_LED", times):
            sines = [error(-3.0 * np.cos(2.0 * np.pi * np.arange(2 * n) / n)) for n in (100, 400)]
            found = [x for each in sines for x in (math.sqrt(float(np.mean(each**2))), float(np.max(np.abs(each))))]
            print(f"  {times:6.3g}", *(f"{x:8.4f}" for x in [*found, float(np.max(error(step)[50:]))]))


def noisy() -> None:
    """Noise gain of lags, and drive noise for a reference with white noise, rms 1e-4 of its range: on a slow ramp,
    where all plays follow, and after the ramp turns, when none does."""
    print("noisy: lag / step, noise gain, rms noise of the drive / its range on the ramp, behind its turn")
    rng = np.random.default_rng(1)
    for samples in (0.5, 1.0, 1.2, 2.0, 5.0, 10.0, 20.0, 25.0, 50.0, 250.0):
        effect = f"name: lag, time_constant: {1e-3 * samples:g}"
        model = hystgen.Model(parse_parameters(WITH_EFFECT.format(effect=effect), "stage_x.yaml"))
        numbers = tables.build(model.chain, "float64", 1e-3)
        low, high = model.cascade.output_range
        u = np.concatenate([np.linspace(0.5 * low, 0.5 * high, 2000), np.linspace(0.5 * high, 0.45 * high, 500)])
        loud = u + 1e-4 * (high - low) * rng.standard_normal(len(u))
        quiet, drive = (
            reference_answers(numbers, Run(1e-3 * np.arange(len(u)), each, {}), True) for each in (u, loud)
        )
        moved = (drive - quiet) / (model.cascade.input_range[1] - model.cascade.input_range[0])
        rms = [math.sqrt(float(np.mean(part**2))) for part in (moved[1000:2000], moved[2100:])]
        print(f"  {samples:6.4g} {numbers.noise_gain:8.4g}", *(f"{each:9.2g}" for each in rms))


def fast() -> None:
    """Change in the output, in % of its range, due to effects that settle within a sample, at the fastest rate with a
    stated bound."""
    shapes = ("lag, time_constant", "delay, time", "rate_dependence, shape: relaxation, time_constant")
    print("fast: step / time constant; lag, delay, relaxing plays")
    place = np.arange(8 * SAMPLES_A_SWEEP + 1) / SAMPLES_A_SWEEP
    v = -4.0 + 8.0 * np.abs(place % 2.0 - 1.0)
    for ratio in (2.0, 5.0, 10.0, 50.0, 250.0):
        moved = []
        for shape in shapes:
            effect = f"name: {shape}: {1e-3 / ratio:g}"
            model = hystgen.Model(parse_parameters(WITH_EFFECT.format(effect=effect), "stage_x.yaml"))
            missing = model.simulate(v) - model.without(model.effects).simulate(v)
            moved.append(100.0 * float(np.max(np.abs(missing))) / float(np.ptp(model.simulate(v))))
        print(f"  {ratio:4.3g}", *(f"{each:8.2g}" for each in moved))


def samples() -> None:
    """The largest error found in growing numbers of samples, relative to that found in the most samples."""
    counts = (200, 400, 800, 3000)
    print("samples:", *(f"{n:6}" for n in counts))
    for effect in ("lag, time_constant: 1.0e-3", "lag, time_constant: 1.0e-2",
                   "rate_dependence, shape: threshold, betas: [1.0e-4, 2.0e-4]"):  # fmt: skip
        model = hystgen.Model(parse_parameters(WITH_EFFECT.format(effect=f"name: {effect}"), "stage_x.yaml"))
        for arithmetic in ("float32", "q31", "q15"):
            compiled, found = tables.build(model.chain, arithmetic, 1e-3), []
            for n in counts:
                with mock.patch.object(measured, "SAMPLES", n):
                    found.append(measured.measured(compiled, model.chain, STANDARD).error)
            print(" ", *(f"{each / found[-1]:6.2f}" for each in found), f" {arithmetic}, {effect}")


PLAYS = """\
hystgen: 1
name: stage_x
sample_time: 1.0e-3
input_range: [-10, 10]
model:
  pi: {{thresholds: [0, 1, 1.5, 2.5, 4, 5], weights: [0.5, 0.3, 0.2, 0.1, 0.3, 0.2]}}
  effects:
    - {{{effect}}}
"""


def tries() -> None:
    """Mean and largest number of inputs that a float32 search tries, for several limits on Newton steps."""
    moved, steep = moving_float.MOVES.floating.tried, moving_float.BENDS.floating.steep
    values = (2, 4, 6, 8, 12)
    print("tries:", *(f"{value:8}" for value in values))
    for effect in (
        "rate_dependence, betas: [3.0e-4, 0, 1.0e-4, 4.0e-4, 2.0e-4]",
        "rate_dependence, betas: [0.01, 0, 0.002, 0, 0.1]",
        *(f"rate_dependence, shape: relaxation, time_constant: 2.0e-3, exponent: {m}" for m in (0.6, 2, 4)),
        "noncongruent, coefficients: [[0.1, -0.02], [0.05], [-0.1], [0.02, 0.01, 0.005], [0.03]]",
        *(f"noncongruent, shape: centre, amplitude: {a}, centre: 1, width: 1" for a in (1.5, -0.8)),
    ):
        model = hystgen.Model(parse_parameters(PLAYS.format(effect=f"name: {effect}"), "stage_x.yaml"))
        t: Any = model.tables("float32", "loop")
        tried: list[int] = []

        def sum_at(t: Any, s: Any, w: Any, tried: list[int] = tried) -> tuple[Any, Any, Any]:
            tried[-1] += 1
            p, m = t.plays.weight, t.moving
            total, slope, steady = p[0] * w, p[0], p[0]
            for i in range(1, len(p)):
                moves, z, share = moved(m, t.plays.threshold, i, s.plays, s.lost, True, w)
                value, change = steep(m, t.plays, i, z) if moves else (s.bent[i], p[i] - p[i])
                total = total + p[i] * value
                steady = steady + p[i] * change
                slope = slope + p[i] * change * share
            return total, slope, steady

        rng, k = np.random.default_rng(2), np.arange(300)
        walk = np.clip(np.cumsum(rng.normal(0.0, 0.1, 300)), -1.0, 1.0)
        low, high = t.limits.output[0]
        for name, levels in (("sine", np.sin(0.05 * k)), ("walk", walk), ("jumps", rng.uniform(-1.0, 1.0, 300))):
            found = []
            for value in values:
                with mock.patch.object(moving_float.at, "NEWTON_TRIES", value), jit.plain():
                    search, s = moving_float.search(None, sum_at, None), reference.new_state(t, True)
                    reference.operations(t, True).init(t, s)
                    s.own.moving[0] = 1
                    tried.clear()
                    for h in np.float32(levels):
                        tried.append(0)
                        w = search(t, s, np.float32(low + (0.5 + 0.5 * h) * (high - low)))
                        s.plays.step.level[0] = moving_float.PLAYS[1](t, s, w)
                found.append(f"{np.mean(tried):5.2f} {max(tried):2}")
            print("      ", *found, f" {name}, {effect.partition(', ')[2]}")


def secants() -> None:
    """Mean and largest number of inputs that a fixed-point search tries, for several limits on secant steps."""
    moved, bent = MOVES.coded().moved, BENDS.coded().bent
    values = (2, 4, 6, 8, 10, 12, 20)
    print("secants:", *(f"{each:10}" for each in values))
    for effect, arithmetic in itertools.product(MOVING_PLAYS, ("q31", "q15")):
        model = hystgen.Model(parse_parameters(WITH_EFFECT.format(effect=effect), "stage_x.yaml"))
        t: Any = model.tables(arithmetic, "loop")
        tried: list[int] = []

        def sum_at(t: Any, s: Any, w: int, tried: list[int] = tried) -> int:
            tried[-1] += 1
            m, p, r = t.moving, t.plays.weight, t.plays.threshold
            z = [moved(m, r, i, s.plays, s.lost, w) for i in range(1, len(r))]
            return int(p[0] * w + sum(p[i] * bent(m, t.plays, i, each) for i, each in enumerate(z, 1)))

        rng, k = np.random.default_rng(3), np.arange(150)
        jumps = rng.uniform(-1, 1, 150)
        signals = {
            "sine": np.sin(0.05 * k), "creeping": 1e-7 * np.sin(0.05 * k) + 0.2, "jumps": jumps,
            "both": np.where(k % 10 < 9, 1e-6 * k, jumps),
        }  # fmt: skip
        for signal, levels in signals.items():
            found = []
            for value in values:
                with mock.patch.object(moving_fixed, "SECANTS", value), jit.plain():
                    search, s = moving_fixed.search(sum_at, None, None, None), reference.new_state(t, True)
                    reference.operations(t, True).init(t, s)
                    s.own.moving[0] = 1
                    tried.clear()
                    for h in np.rint(0.25 * float(t.number.largest_level[0]) * levels).astype(np.int64).tolist():
                        tried.append(0)
                        moving_fixed.PLAYS[1](t, s, search(t, s, h << int(t.number.level_drop[0])))
                found.append(f"{np.mean(tried):6.2f} {max(tried):3}")
            print("         ", *found, f" {signal}, {arithmetic}, {effect.partition(' ')[2]}")


def _lost(response: NDArray[np.complex128]) -> float:
    """Rms deviation of a frequency response from 1, in %."""
    return 100.0 * math.sqrt(float(np.mean(np.abs(response - 1.0) ** 2)))


RUNS: dict[str, Callable[[], None]] = {
    each.__name__: each
    for each in (
        lag, newton, decades, sweeps, unknown, exact, lengths, visits, quiet, averages, shifts, branches, noisy, fast,
        samples, tries, secants,
    )
}


def main() -> None:
    """Print the requested tables, or all of them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help=", ".join(RUNS))
    for name in parser.parse_args().names or RUNS:
        RUNS[name]()


if __name__ == "__main__":
    main()
