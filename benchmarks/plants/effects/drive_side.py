"""Effects between the commanded drive and the hysteresis: transport, amplifier, rails and bent field."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from ..bench import Bench
from . import Array, Effect, Kind, Surroundings, between, pick, values

FAST = ("dynamic", "mixed")
ANY = ("static", "dynamic", "mixed")


# -- delay: a command that waits in a queue, or a bus behind the sensor ------------------------------------------------


def draw_delay(rng: np.random.Generator, bench: Bench) -> Effect:
    return Effect("delay", "transport", 1.0, values(time=between(rng, 0.4, 6.0) / bench.rates[1]))


def delay(effect: Effect, x: Array, around: Surroundings) -> Array:
    return np.interp(around.t - effect.strength * effect.values["time"], around.t, x)


# -- slew limit: an amplifier that charges the stack with a limited current --------------------------------------------


def draw_slew(rng: np.random.Generator, bench: Bench) -> Effect:
    # at strength 1 a full-scale move takes this many samples; step edges take three to eight
    samples = between(rng, 15.0, 60.0)
    rate = bench.span * bench.rates[1] / samples
    return Effect("slew_limit", "current", 1.0, values(rising=rate, falling=rate * rng.uniform(0.7, 1.4)))


def slew(effect: Effect, x: Array, around: Surroundings) -> Array:
    if effect.strength <= 0.0:
        return x
    rising, falling = (effect.values[key] / effect.strength for key in ("rising", "falling"))
    return np.asarray(_slew(x, around.dt, rising, falling))


@njit(cache=True)
def _slew(x: Array, dt: Array, rising: float, falling: float) -> Array:
    out = np.empty_like(x)
    a = x[0]
    for k in range(len(x)):
        a += min(max(x[k] - a, -falling * dt[k]), rising * dt[k])
        out[k] = a
    return out


# -- lag: an amplifier's RC network with a small second pole -----------------------------------------------------------


def draw_lag(rng: np.random.Generator, bench: Bench) -> Effect:
    time = between(rng, 0.6, 10.0) / bench.rates[1]
    return Effect("lag", "rc_network", 1.0, values(time=time, second=time * rng.uniform(0.02, 0.1)))


def lag(effect: Effect, x: Array, around: Surroundings) -> Array:
    for key in ("time", "second"):
        if effect.strength > 0.0:
            x = np.asarray(first_order(x, around.dt, effect.strength * effect.values[key]))
    return x


@njit(cache=True)
def first_order(x: Array, dt: Array, tau: float) -> Array:
    """A first-order lag, settled at the start; exact for an input that is linear between samples."""
    out = np.empty_like(x)
    a = x[0]
    out[0] = a
    for k in range(1, len(x)):
        slope = (x[k] - x[k - 1]) / dt[k]
        a = x[k] - tau * slope + (a - x[k - 1] + tau * slope) * math.exp(-dt[k] / tau)
        out[k] = a
    return out


# -- asymmetry: strain that is not linear in the field -----------------------------------------------------------------


def draw_asymmetry(rng: np.random.Generator, bench: Bench) -> Effect:
    form = pick(rng, "exponential", "polynomial", "two_slopes")
    sign = 1.0 if rng.uniform() < 0.5 else -1.0
    shape = {"exponential": rng.uniform(0.5, 1.5), "polynomial": rng.uniform(-0.25, 0.25)}.get(form, 0.3)
    return Effect("asymmetry", form, sign * between(rng, 0.01, 0.1), values(shape=shape))


def asymmetry(effect: Effect, x: Array, around: Surroundings) -> Array:
    half = 0.5 * around.bench.span
    u = (x - around.bench.middle) / half
    shape = effect.values["shape"]
    if effect.form == "exponential":
        curve = (np.exp(shape * u) - math.cosh(shape) - u * math.sinh(shape)) / (math.cosh(shape) - 1.0)
    elif effect.form == "polynomial":
        curve = (u * u - 1.0) * (1.0 + shape * u)
    else:
        curve = np.sqrt(u * u + shape**2) - math.sqrt(1.0 + shape**2)
    return np.asarray(x + half * effect.strength * curve)


# -- saturation: rails of the amplifier in front, stops of the stage behind --------------------------------------------


def draw_saturation(rng: np.random.Generator, bench: Bench) -> Effect:
    form = pick(rng, "rails", "soft_rails", "stops")
    softness = rng.uniform(4.0, 10.0) if form == "soft_rails" else rng.uniform(0.0, 0.3)
    strength = between(rng, 0.3, 0.8) if form == "soft_rails" else between(rng, 0.03, 0.12)
    return Effect("saturation", form, strength, values(softness=softness, unlike=rng.uniform(0.9, 1.1)))


def saturation(effect: Effect, x: Array, around: Surroundings) -> Array:
    """Rails in front of the hysteresis; `stops` act behind it."""
    if effect.form == "stops" or effect.strength <= 0.0:
        return x
    bench = around.bench
    top = max(bench.high, -bench.low)
    if effect.form == "soft_rails":
        n = effect.values["softness"]
        return np.asarray(x / (1.0 + np.abs(effect.strength * x / top) ** n) ** (1.0 / n))
    cut = effect.strength * bench.span
    lowest = bench.low + cut * effect.values["unlike"] if bench.two_sided else -math.inf
    return np.clip(x, lowest, bench.high - cut)


KINDS = {
    "delay": Kind(draw_delay, FAST, "rate"),
    "slew_limit": Kind(draw_slew, FAST, "rate"),
    "lag": Kind(draw_lag, FAST, "rate"),
    "asymmetry": Kind(draw_asymmetry, ANY, "curve"),
    "saturation": Kind(draw_saturation, ANY, "curve"),
}
