"""Effects of the hysteresis itself: how its sliders slip, and how its relays are spread."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .. import base
from ..bench import Bench
from . import Effect, Kind, between, pick, values

Array = NDArray[np.float64]


def draw_rate(rng: np.random.Generator, bench: Bench) -> Effect:
    form = pick(rng, "viscous", "viscous", "activated")
    fastest = bench.short / 25.0
    if form == "activated":
        speed = 2.0 * bench.span / bench.long * between(rng, 0.3, 3.0)
        return Effect("rate_dependence", form, between(rng, 0.01, 0.06), values(rate=speed))
    exponent = (1.0, 1.0, 1.25, 1.5)[int(rng.integers(4))]
    tau = fastest * between(rng, 0.01, 0.08) * (0.3 if exponent > 1.0 else 1.0)
    numbers = values(tau=tau, exponent=exponent, slant=rng.uniform(-0.4, 0.4), unit=0.1 * bench.span)
    return Effect("rate_dependence", form, 1.0, numbers)


def viscosity(effect: Effect) -> base.Viscosity | None:
    if effect.strength <= 0.0:
        return None
    numbers = effect.values
    if effect.form == "activated":
        return base.Viscosity("activated", strength=effect.strength, rate=numbers["rate"])
    tau = effect.strength * numbers["tau"]
    return base.Viscosity("power", tau, numbers["exponent"], numbers["slant"], numbers["unit"])


def draw_noncongruent(rng: np.random.Generator, bench: Bench) -> Effect:
    form = pick(rng, "gauss", "lorentz", "tilt", "bend")
    sign = 1.0 if rng.uniform() < 0.5 else -1.0
    strength = between(rng, 0.1, 0.4) * (0.6 if form == "bend" else 1.0)
    middle = bench.low + bench.span * rng.uniform(0.3, 0.7)
    numbers = values(middle=middle, width=bench.span * rng.uniform(0.12, 0.3))
    return Effect("noncongruent", form, sign * strength, numbers)


def centre(effect: Effect) -> base.Centre | None:
    if effect.strength == 0.0:
        return None
    return base.Centre(effect.form, effect.strength, effect.values["middle"], effect.values["width"])


def draw_open(rng: np.random.Generator, bench: Bench) -> Effect:
    """An element of friction; with a positive strength the output leads."""
    form = pick(rng, "dahl", "dahl", "bouc_wen", "sharp")
    sign = 1.0 if rng.uniform() < 0.3 else -1.0
    strength = sign * between(rng, 0.03, 0.2)
    ratio = 0.0 if form == "dahl" else rng.uniform(-0.4, 0.9)
    exponent = rng.uniform(1.2, 3.0) if form == "sharp" else 1.0
    numbers = values(length=bench.span * between(rng, 0.04, 0.3), ratio=ratio, exponent=exponent)
    return Effect("bouc_wen", form, strength, numbers)


def parallel(effect: Effect, x: Array, bench: Bench) -> Array:
    """The element's output; the strength is its slope at a reversal, over the output range per drive range."""
    numbers = effect.values
    element = base.friction(x, numbers["length"], numbers["ratio"], numbers["exponent"])
    return np.asarray(effect.strength * bench.span_out / bench.span * element)


KINDS = {
    "rate_dependence": Kind(draw_rate, ("dynamic", "static", "mixed"), "rate"),
    "noncongruent": Kind(draw_noncongruent, ("dynamic", "static", "mixed"), "curve"),
    "bouc_wen": Kind(draw_open, ("dynamic", "static", "mixed"), "open"),
}
