"""Effects over seconds to minutes behind the hysteresis: creep, ageing, heat."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from ..bench import Bench
from . import Array, Effect, Kind, Surroundings, between, pick, values

SLOW = ("static", "mixed")

# -- creep: a continuous spectrum of relaxations, given by the creep compliance it makes -------------------------------

SPECTRUM = 28


def draw_creep(rng: np.random.Generator, bench: Bench) -> Effect:
    form = pick(rng, "logarithmic", "logarithmic", "power", "stretched")
    per_decade = between(rng, 0.006, 0.022)
    first = between(rng, 2.0, 10.0) / bench.rates[0]
    last = bench.long * between(rng, 3.0, 30.0)
    shape = rng.uniform(0.1, 0.3) if form == "power" else rng.uniform(0.45, 0.7)
    time = bench.long * between(rng, 0.02, 0.15)
    share = rng.uniform(0.0, 1.0) if rng.uniform() < 0.25 else 0.0
    numbers = values(first=first, last=last, exponent=shape, time=time, domain_share=share)
    return Effect("creep", form, per_decade, numbers)


def creep(effect: Effect, h: Array, around: Surroundings) -> Array:
    """Creep behind the hysteresis; a share `domain_share` follows only the response's curved part, as domains do."""
    if effect.strength == 0.0:
        return h
    taus, weights = spectrum(effect)
    bench = around.bench
    slope = bench.span_out / bench.span
    domains = 2.0 * (h - 0.5 * slope * around.drive)
    share = effect.values["domain_share"]
    source = (1.0 - share) * h + share * domains
    return np.asarray(h + _relax(source, around.dt, taus, weights))


def spectrum(effect: Effect) -> tuple[Array, Array]:
    """Relaxation times [s] and their weights [1]."""
    numbers = effect.values
    if effect.form == "stretched":
        # weights of 1 - exp(-(t/T)^b) from its slope over log t, in a range wide enough for b = 0.4
        taus = np.geomspace(numbers["time"] * 1e-3, numbers["time"] * 30.0, SPECTRUM)
        x = (taus / numbers["time"]) ** numbers["exponent"]
        weights = numbers["exponent"] * x * np.exp(-x)
        return taus, 3.0 * effect.strength * weights / weights.sum()
    taus = np.geomspace(numbers["first"], numbers["last"], SPECTRUM)
    decades = math.log10(numbers["last"] / numbers["first"]) / (SPECTRUM - 1)
    weights = np.full(SPECTRUM, decades)
    if effect.form == "power":
        rise = (taus / math.sqrt(numbers["first"] * numbers["last"])) ** numbers["exponent"]
        weights = weights * rise / rise.mean()
    return taus, effect.strength * weights


@njit(cache=True)
def _relax(h: Array, dt: Array, taus: Array, weights: Array) -> Array:
    state = np.full(len(taus), h[0])
    share = np.empty(len(taus))
    known = -1.0
    out = np.empty_like(h)
    for k in range(len(h)):
        if k and abs(dt[k] - known) > 1e-9 * known:
            share[:] = 1.0 - np.exp(-dt[k] / taus)
            known = dt[k]
        middle = 0.5 * (h[k] + h[k - 1]) if k else h[0]
        total = 0.0
        for j in range(len(taus)):
            if k:
                state[j] += share[j] * (middle - state[j])
            total += weights[j] * state[j]
        out[k] = total
    return out


# -- ageing: fatigue with travelled distance ---------------------------------------------------------------------------


def draw_ageing(rng: np.random.Generator, bench: Bench) -> Effect:
    form = pick(rng, "stretched", "logarithmic", "power")
    numbers = values(scale=bench.span * between(rng, 8.0, 60.0), exponent=rng.uniform(0.5, 1.0))
    return Effect("ageing", form, between(rng, 0.01, 0.08), numbers)


def ageing(effect: Effect, h: Array, around: Surroundings) -> Array:
    return np.asarray(h * (1.0 - effect.strength * _loss(effect, around) / _loss(effect, around.scale)[-1]))


def _loss(effect: Effect, around: Surroundings) -> Array:
    travel = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(around.drive)))))
    x = travel / effect.values["scale"]
    if effect.form == "stretched":
        return np.asarray(1.0 - np.exp(-(x ** effect.values["exponent"])))
    if effect.form == "logarithmic":
        return np.log1p(x)
    return np.asarray(x ** (0.6 * effect.values["exponent"]))


# -- thermal: a room whose temperature is logged, or the stack's own loss ----------------------------------------------


def draw_thermal(rng: np.random.Generator, bench: Bench) -> Effect:
    form = pick(rng, "room", "friction_heat")
    sign = 1.0 if rng.uniform() < 0.7 else -1.0
    numbers = values(
        offset_share=rng.uniform(-0.5, 0.5),
        curved=rng.uniform(-0.1, 0.1),
        time=bench.long * between(rng, 0.4, 3.0),
    )
    return Effect("thermal", form, sign * between(rng, 0.01, 0.05), numbers)


def thermal(effect: Effect, h: Array, around: Surroundings) -> Array:
    """Gain and offset due to the excess temperature, scaled so that the largest change of the gain is `strength`."""
    peak = float(np.abs(_excess(effect, around.scale)).max())
    if peak == 0.0:
        return h
    x = _excess(effect, around) / peak
    gain = effect.strength * (x + effect.values["curved"] * x * x)
    offset = 0.3 * effect.strength * effect.values["offset_share"] * around.bench.span_out * x
    return np.asarray(h * (1.0 + gain) + offset)


def _excess(effect: Effect, around: Surroundings) -> Array:
    """Temperature rise since the start of the first session."""
    if effect.form == "room":
        return around.temperature - around.scale.temperature[0]
    return np.asarray(_heat(around.drive, around.dt, effect.values["time"], around.bench.span))


@njit(cache=True)
def _heat(v: Array, dt: Array, tau: float, span: float) -> Array:
    """Rise above room temperature, up to a factor, due to the friction of three sliders on one thermal mass."""
    limits = span * np.array([0.03, 0.1, 0.22])
    stretch = np.zeros(3)
    heat = 0.0
    out = np.empty_like(v)
    for k in range(len(v)):
        lost = 0.0
        move = v[k] - v[k - 1] if k else 0.0
        for i in range(3):
            e = stretch[i] + move
            held = min(max(e, -limits[i]), limits[i])
            lost += limits[i] * abs(e - held)
            stretch[i] = held
        heat = heat * math.exp(-dt[k] / tau) + lost
        out[k] = heat
    return out


KINDS = {
    "creep": Kind(draw_creep, SLOW, "slow"),
    "ageing": Kind(draw_ageing, SLOW, "gain"),
    "thermal": Kind(draw_thermal, ("static",), "gain"),
}
