"""Effects behind the actuator: its mechanics, the stage's stops, the sensor, the slow shift of the frame."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from ..bench import Bench
from . import Array, Effect, Kind, Surroundings, between, pick, values

FAST = ("dynamic", "mixed")
ANY = ("static", "dynamic", "mixed")

# -- resonance: equations of motion of two modes, integrated by Runge-Kutta --------------------------------------------


def draw_resonance(rng: np.random.Generator, bench: Bench) -> Effect:
    frequency = bench.rates[1] / between(rng, 12.0, 40.0)
    numbers = values(
        frequency=frequency,
        damping=between(rng, 0.006, 0.06),
        second=frequency * rng.uniform(2.3, 4.0),
        second_damping=between(rng, 0.01, 0.06),
        second_share=rng.uniform(0.0, 0.03),
    )
    return Effect("resonance", "modes", 1.0, numbers)


def resonance(effect: Effect, h: Array, around: Surroundings) -> Array:
    if effect.strength <= 0.0:
        return h
    x = effect.values
    share = x["second_share"]
    first = _mode(h, around.dt, 2.0 * math.pi * x["frequency"] / effect.strength, x["damping"])
    second = _mode(h, around.dt, 2.0 * math.pi * x["second"] / effect.strength, x["second_damping"])
    return np.asarray((1.0 - share) * first + share * second)


@njit(cache=True)
def _mode(h: Array, dt: Array, w: float, damping: float) -> Array:
    out = np.empty_like(h)
    q, p = h[0], 0.0
    out[0] = q
    for k in range(1, len(h)):
        if dt[k] * w * damping > 20.0 and h[k] == h[k - 1]:
            q, p = h[k], 0.0
        else:
            parts = int(dt[k] * w / 0.15) + 1
            s = dt[k] / parts
            for m in range(parts):
                begin = h[k - 1] + (h[k] - h[k - 1]) * m / parts
                rise = (h[k] - h[k - 1]) / parts
                f0, f1, f2 = begin, begin + 0.5 * rise, begin + rise
                a1 = w * w * (f0 - q) - 2.0 * damping * w * p
                q2, p2 = q + 0.5 * s * p, p + 0.5 * s * a1
                a2 = w * w * (f1 - q2) - 2.0 * damping * w * p2
                q3, p3 = q + 0.5 * s * p2, p + 0.5 * s * a2
                a3 = w * w * (f1 - q3) - 2.0 * damping * w * p3
                q4, p4 = q + s * p3, p + s * a3
                a4 = w * w * (f2 - q4) - 2.0 * damping * w * p4
                q += s * (p + 2.0 * p2 + 2.0 * p3 + p4) / 6.0
                p += s * (a1 + 2.0 * a2 + 2.0 * a3 + a4) / 6.0
        out[k] = q
    return out


# -- saturation behind the hysteresis: a stage that meets round stops, by Hertz's law ----------------------------------


def stops(effect: Effect, y: Array, around: Surroundings) -> Array:
    if effect.form != "stops" or effect.strength <= 0.0:
        return y
    bench = around.bench
    slope = bench.span_out / bench.span
    cut = effect.strength * bench.span_out
    give = effect.values["softness"]
    top = slope * bench.high - cut
    y = y - _taken(y - top, cut, give)
    if bench.two_sided:
        bottom = slope * bench.low + cut * effect.values["unlike"]
        y = y + _taken(bottom - y, cut, give)
    return y


def _taken(beyond: Array, depth: float, give: float) -> Array:
    """Travel that a stop takes from a stage that would go `beyond` it: at `depth`, all but the fraction `give`.

    The force on a ball, which grows like its indentation to the power 3/2, equals the stage's stiffness times the
    travel taken; solved by bisection.
    """
    stiffness = (1.0 - give) * depth / (give * depth) ** 1.5
    low, high = np.zeros_like(beyond), np.maximum(beyond, 0.0)
    for _ in range(60):
        middle = 0.5 * (low + high)
        more = stiffness * middle**1.5 < beyond - middle
        low, high = np.where(more, middle, low), np.where(more, high, middle)
    return np.asarray(np.maximum(beyond, 0.0) - low)


# -- sensor nonlinearity -----------------------------------------------------------------------------------------------


def draw_sensor(rng: np.random.Generator, bench: Bench) -> Effect:
    form = pick(rng, "capacitive_gap", "bridge", "arc")
    sign = 1.0 if form == "arc" or rng.uniform() < 0.5 else -1.0
    return Effect("sensor_nonlinearity", form, sign * between(rng, 0.01, 0.06), values(off=rng.uniform(-0.3, 0.3)))


def sensor(effect: Effect, y: Array, around: Surroundings) -> Array:
    bench = around.bench
    half = 0.5 * bench.span_out
    x = (y - bench.middle * bench.span_out / bench.span) / half - effect.values["off"]
    s = effect.strength
    if effect.form == "capacitive_gap":
        seen = x / (1.0 - s * x)
    elif effect.form == "bridge":
        seen = x * (1.0 + s * x) / (1.0 + s * s * x * x)
    else:
        reach = math.sqrt(6.0 * s)
        seen = np.sin(reach * x) / reach if s > 0.0 else x
    return np.asarray(y + half * (seen - x))


# -- drift: the frame warms up, the target slides ----------------------------------------------------------------------


def draw_drift(rng: np.random.Generator, bench: Bench) -> Effect:
    sign = 1.0 if rng.uniform() < 0.5 else -1.0
    return Effect("drift", "frame", sign * between(rng, 0.01, 0.1), values(curved=rng.uniform(-0.08, 0.08)))


def drift(effect: Effect, y: Array, around: Surroundings) -> Array:
    x = (around.t - around.t[0]) / (around.scale.t[-1] - around.scale.t[0])
    shift = x + effect.values["curved"] * (x * x - x)
    return np.asarray(y + effect.strength * around.bench.span_out * shift)


KINDS = {
    "resonance": Kind(draw_resonance, FAST, "rate"),
    "sensor_nonlinearity": Kind(draw_sensor, ANY, "curve"),
    "drift": Kind(draw_drift, ("static", "mixed"), "slow"),
}
