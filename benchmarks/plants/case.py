"""The case of a seed: bench, session, plant, noise, the nominal model, and the strength of its effects.

Seeds below REPORT are for tuning and the others for reporting; the two blocks differ in nothing else.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from . import base, bench, foreign, measure, refit, session
from .effects import Effect, between, catalogue
from .plant import Plant

Array = NDArray[np.float64]

KINDS = ("single", "pair", "none", "foreign", "poor", "snr", "open")
REPORT = 10_000
"""First seed of the report block."""

OPEN = "bouc_wen"
"""The effect of the kind `open`, whose minor loops stay open. It is in no other kind: each seed keeps its effects."""

NOISE = (2.0e-4, 2.0e-3)
"""Noise rms as a fraction of the output range: smallest, largest."""

PURE = 0.25
"""Largest rms residual of a fine play sum fitted to a plant without effects, in units of the noise."""

VISIBLE = 3.0
"""Smallest rms residual due to an effect, in units of the noise, for its name to be required."""

SHOWN = 0.5
"""Fraction of the strength that the held-out records and the records to fit must each show."""

CLOSE = 0.25
"""Largest logarithm of the ratio between the wanted and the achieved strength."""

SMALL, LARGE = 1300, 5200
"""Samples per record."""

MOST = {
    "creep": 0.035,
    "ageing": 0.3,
    "thermal": 0.15,
    "drift": 0.3,
    "asymmetry": 0.2,
    "saturation": 0.25,
    "sensor_nonlinearity": 0.12,
    "noncongruent": 0.8,
    "bouc_wen": 0.24,
}
"""Largest strength that an effect of a real stage has; 20 for effects not listed."""

LEAST = {"resonance": 0.6, "slew_limit": 0.6, "delay": 0.3, "lag": 0.3}
"""Smallest strength at which the bench's samples resolve an effect."""


@dataclass(frozen=True)
class Present:
    """An effect of the plant, and the rms residual that it alone causes after a fine play sum is refitted [output], in
    all records and in the held-out ones; `to_fit`: in the others, after a refit to only these."""

    effect: Effect
    unabsorbed: float
    held_out: float
    to_fit: float


@dataclass(frozen=True)
class Case:
    """Everything about one case; only `measured`, `nominal` and the session's known history go to the workflow.

    `clean`: noise-free output of the plant for each record, before any foreign fault; `twin`: the same for the plant
    without its effects; `measured`: columns of each record by name; `added`: error that the converters added to
    `clean`; `unabsorbed`, `remainder`: rms residual of a fine play sum with and without the effects.
    """

    kind: str
    seed: int
    session: session.Session
    plant: Plant
    present: tuple[Present, ...]
    fault: tuple[str, dict[str, float]] | None
    converters: measure.Converters
    clean: tuple[Array, ...]
    twin: tuple[Array, ...]
    measured: tuple[dict[str, Array], ...]
    nominal: Nominal
    unabsorbed: float
    remainder: float
    session_time: bool
    rich: bool
    added: tuple[Array, ...]

    @property
    def name(self) -> str:
        """A name that reveals nothing about the content of the case."""
        return "case_" + hashlib.sha256(f"{self.kind}:{self.seed}".encode()).hexdigest()[:10]

    def noise(self, held_out: bool | None = None) -> float:
        """Rms error of the converters [output] without any fault, over the held-out records, the others, or all."""
        rows = [k for k, r in enumerate(self.session.records) if held_out is None or r.held_out == held_out]
        return float(np.sqrt(np.mean(np.concatenate([self.added[k] for k in rows]) ** 2)))


@dataclass(frozen=True)
class Nominal:
    """Parameters of the model given to the workflow: roughly right, from the plant without effects."""

    thresholds: tuple[float, ...]
    weights: tuple[float, ...]
    offset: float


def make(kind: str, seed: int, samples: int = SMALL, given: Sequence[session.Given] = ()) -> Case:
    """The case of a kind and seed, with about `samples` per record; `given`: drives to be used unchanged."""
    streams = [
        np.random.Generator(np.random.PCG64(s))
        for s in np.random.SeedSequence([KINDS.index(kind), seed, samples]).spawn(6)
    ]
    names, fault = contents(kind, seed)
    stage, hysteresis, rich, session_time = _set_up(streams[0], kind, names, fault, samples, seed, given)
    course = refit.track(stage)
    span_out = stage.bench.span_out
    twin = _seen(stage, Plant(hysteresis))
    remainder = refit.unabsorbed(course, np.concatenate(twin), stage.bench.span).everywhere
    noise = max(between(streams[1], *NOISE) * span_out, remainder / PURE)
    colour = measure.COLOURS[(0, 0, 0, 1, 2)[int(streams[1].integers(5))]]
    if kind == "none":
        colour = measure.COLOURS[seed % 3]
    present, noise = _effects(streams[2], kind, names, stage, course, hysteresis, noise, remainder)
    plant = Plant(hysteresis, tuple(item.effect for item in present))
    clean = _seen(stage, plant)
    unabsorbed = refit.unabsorbed(course, np.concatenate(clean), stage.bench.span).everywhere
    converters = measure.draw(streams[3], noise, span_out, stage.bench.span, colour)
    v = [converters.drive(streams[4], stage.sampled(stage.v, item)) for item in stage.records]
    y = [converters.output(streams[4], part) for part in clean]
    added = tuple(seen - part for seen, part in zip(y, clean, strict=True))
    numbers: dict[str, float] = {}
    if fault:
        scenes = [
            foreign.Scene(stage.times(item), v[k], clean[k], noise, span_out) for k, item in enumerate(stage.records)
        ]
        numbers = foreign.FAULTS[fault](streams[5], scenes, v, y)
        if fault in ("hum", "stick_slip", "ripple"):
            y = [measure.quantised(part, converters.output_step) for part in y]
    logged = _logs_temperature(streams[5], stage, present)
    measured = []
    for k, item in enumerate(stage.records):
        t = stage.times(item)
        columns = {"t": t if session_time else t - t[0], "v": v[k], "y": y[k]}
        if logged:
            columns["temperature"] = _thermometer(streams[5], stage, item)
        measured.append(columns)
    nominal = _nominal(streams[5], course, np.concatenate(twin), stage.bench.span)
    return Case(
        kind,
        seed,
        stage,
        plant,
        tuple(present),
        (fault, numbers) if fault else None,
        converters,
        tuple(clean),
        tuple(twin),
        tuple(measured),
        nominal,
        unabsorbed,
        remainder,
        session_time,
        rich,
        added,
    )


def in_turn() -> list[str]:
    """Names of the effects that cases with a single effect take in turn."""
    return sorted(name for name in catalogue() if name != OPEN)


def contents(kind: str, seed: int) -> tuple[list[str], str | None]:
    """Names of the effects, and of a foreign fault."""
    kinds = catalogue()
    names = in_turn()
    if kind == "open":
        return [OPEN], None
    if kind == "foreign":
        faults = list(foreign.FAULTS)
        return [], faults[seed % len(faults)]
    if kind == "none":
        return [], None
    if kind != "pair":
        return [names[seed % len(names)]], None
    pairs = [
        [a, b]
        for k, a in enumerate(names)
        for b in names[k + 1 :]
        if kinds[a].family != kinds[b].family and set(kinds[a].benches) & set(kinds[b].benches)
        # viscous and centre-dependent elements need two different kinds of base
    ]
    pairs = [pair for pair in pairs if pair != ["noncongruent", "rate_dependence"]]
    return pairs[(seed * 7) % len(pairs)], None


def _set_up(
    rng: np.random.Generator,
    kind: str,
    names: list[str],
    fault: str | None,
    samples: int,
    seed: int,
    given: Sequence[session.Given],
) -> tuple[session.Session, base.Base, bool, bool]:
    if given:
        stage = session.replayed(rng, between(rng, 2.0, 100.0), given)
        return stage, _hysteresis(rng, stage.bench), True, True
    kinds = catalogue()
    able = [k for k in bench.KINDS if all(k in kinds[name].benches for name in names)]
    if fault == "hum":
        able = ["dynamic", "mixed"]
    chosen = able[int(rng.integers(len(able)))]
    stand = bench.draw(rng, chosen, samples)
    if fault == "hum":
        stand = replace(stand, rates=(stand.rates[0], min(stand.rates[1], 5000.0)))
        if chosen == "dynamic":
            stand = replace(stand, rates=(stand.rates[1], stand.rates[1]))
    known = bool(rng.uniform() < 0.5) if kind != "none" else seed % 2 == 0
    rich = kind != "poor"
    waveforms = session.rich(rng, int(rng.integers(9, 12))) if rich else session.poor(rng)
    stage = session.plan(rng, stand, known, waveforms)
    hysteresis = _hysteresis(rng, stand)
    session_time = chosen != "dynamic" or bool(rng.uniform() < 0.5)
    return stage, hysteresis, rich, session_time


def _hysteresis(rng: np.random.Generator, stand: bench.Bench) -> base.Base:
    return base.draw(rng, stand.low, stand.high, stand.span_out, base.KINDS[int(rng.integers(len(base.KINDS)))])


def _seen(stage: session.Session, plant: Plant) -> list[Array]:
    fine = plant.respond(stage)
    return [stage.sampled(fine, item) for item in stage.records]


def _effects(
    rng: np.random.Generator,
    kind: str,
    names: list[str],
    stage: session.Session,
    course: refit.Track,
    hysteresis: base.Base,
    noise: float,
    remainder: float,
) -> tuple[list[Present], float]:
    """Effects of realistic strength, with noise and strength adjusted to a wanted ratio."""
    least = max(NOISE[0] * stage.bench.span_out, remainder / PURE)
    most = max(NOISE[1] * stage.bench.span_out, least)
    present: list[Present] = []
    for name in names:
        wanted = between(rng, 0.3, 12.0) if kind == "snr" else between(rng, 1.3 * VISIBLE, 30.0)
        best: Present | None = None
        for _ in range(5):
            effect = catalogue()[name].draw(rng, stage.bench)
            item = _alone(stage, course, hysteresis, effect)
            if not present:
                noise = min(max(item.unabsorbed / wanted, least), most)
            item = _scaled(stage, course, hysteresis, item, wanted * noise)
            if best is None or _off(item, wanted * noise) < _off(best, wanted * noise):
                best = item
            if _off(item, wanted * noise) < CLOSE:
                break
        assert best is not None
        present.append(best)
    return present, noise


def _alone(stage: session.Session, course: refit.Track, hysteresis: base.Base, effect: Effect) -> Present:
    output = np.concatenate(_seen(stage, Plant(hysteresis, (effect,))))
    least = 1e-12 * stage.bench.span_out
    left = refit.unabsorbed(course, output, stage.bench.span)
    return Present(effect, max(left.everywhere, least), max(left.held_out, least), max(left.to_fit, least))


def _off(item: Present, wanted: float) -> float:
    """Log distance from the wanted strength; the held-out records and the records to fit must each show half of it."""
    shown = min(item.held_out, item.to_fit)
    return max(abs(math.log(item.unabsorbed / wanted)), math.log(SHOWN * wanted / shown))


def _scaled(
    stage: session.Session, course: refit.Track, hysteresis: base.Base, item: Present, wanted: float
) -> Present:
    limit = MOST.get(item.effect.name, 20.0)
    if item.effect.form == "soft_rails":
        limit = 1.1
    for _ in range(4):
        size = abs(item.effect.strength)
        factor = float(np.clip(wanted / item.unabsorbed, 0.25, 4.0))
        factor = min(max(factor, LEAST.get(item.effect.name, 0.0) / size), limit / size)
        if abs(math.log(item.unabsorbed / wanted)) < CLOSE or abs(factor - 1.0) < 0.02:
            break
        item = _alone(stage, course, hysteresis, item.effect.scaled(factor))
    return item


def _logs_temperature(rng: np.random.Generator, stage: session.Session, present: list[Present]) -> bool:
    # Some benches log the temperature although nothing depends on it
    decoy = bool(rng.uniform() < 0.25) and stage.bench.kind == "static"
    return decoy or any(item.effect.form == "room" for item in present)


def _thermometer(rng: np.random.Generator, stage: session.Session, item: session.Planned) -> Array:
    true = stage.sampled(stage.temperature, item)
    return measure.quantised(true + 0.01 * rng.standard_normal(len(true)), 0.01)


def _nominal(rng: np.random.Generator, course: refit.Track, output: Array, span: float) -> Nominal:
    number = int(rng.integers(8, 16))
    even = refit.radii(0.9 * span, number + 1)[1:]
    thresholds = np.concatenate(([0.0], np.sort(rng.uniform(0.9, 1.1, number) * even)))
    record = course.record[course.seen]
    columns = refit.plays(course.v, thresholds)[course.seen]
    y = refit.centred(output, record)
    weights = refit.fit(refit.centred(columns, record), y)
    weights[0] = max(weights[0], 0.05 * weights.sum())
    weights = weights * rng.uniform(0.97, 1.03) * (1.0 + 0.04 * rng.standard_normal(len(weights)))
    weights = np.maximum(weights, 0.0)
    thresholds = thresholds * rng.uniform(0.97, 1.03)
    offset = float(np.mean(output) - np.mean(columns @ weights))
    # Two thresholds may become equal when rounded for the file
    written, first = np.unique([float(f"{x:.5g}") for x in thresholds], return_index=True)
    weights = np.add.reduceat(weights, first)
    return Nominal(tuple(written.tolist()), tuple(float(f"{x:.5g}") for x in weights), float(f"{offset:.4g}"))
