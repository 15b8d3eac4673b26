"""Base hysteresis of the plants: four kinds, which a fine play sum can represent but none of which is computed as one.

Every kind starts from a continuous density p(r) of half widths, scaled to a wanted loop width:

* `everett`: the continuous operator itself, evaluated by its branch function B(d) = p0 d + int p(r) max(d - 2r, 0) dr
  on a stack of reversals that are removed as they are passed;
* `maxwell`: some hundred parallel spring-slider elements with random yield points and stiffnesses;
* `relays`: a lattice of two-state relays, in which every half width has its own shifted row of centres;
* `bouc_wen`: `maxwell` with a small fraction of a Bouc-Wen variable, which no play sum represents exactly.

`relays` can depend on the centre and `maxwell` can have nonlinear springs (not congruent); `maxwell` sliders can be
viscous (rate dependent).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

KINDS = ("everett", "maxwell", "relays", "bouc_wen")

DENSITY_POINTS = 2000
LEAST_P0_SHARE = 0.25
ROWS = 160
"""Rows of relays, one per half width."""
COLUMNS = 1500
"""Number of relays in a row across the drive span."""


@dataclass(frozen=True)
class Base:
    """Hysteresis before any effect: output rises by `span_out` when the drive sweeps from `low` to `high`."""

    kind: str
    low: float
    high: float
    p0: float
    radii: Array
    """Half widths in the middle of the density's cells."""
    masses: Array
    """Weight of each cell; the masses and p0 add up to the slope after a long move."""
    yields: Array = field(default_factory=lambda: np.empty(0))
    stiffnesses: Array = field(default_factory=lambda: np.empty(0))
    phases: Array = field(default_factory=lambda: np.empty(0))
    bouc_wen: tuple[float, float, float, float] = (0.0, 1.0, 0.5, 1.0)
    """Contribution in output per input, saturation length, ratio gamma/beta, exponent."""

    @property
    def span(self) -> float:
        return self.high - self.low


def draw(rng: np.random.Generator, low: float, high: float, span_out: float, kind: str) -> Base:
    """A base of the given kind with a random density; the loop is 2 to 15 % of the output range wide."""
    span = high - low
    reach = span * rng.uniform(0.18, 0.48)
    edges = np.linspace(0.0, reach, DENSITY_POINTS + 1)
    radii = 0.5 * (edges[1:] + edges[:-1])
    x = radii / reach
    shape = int(rng.integers(4))
    if shape == 0:
        density = np.exp(-rng.uniform(1.0, 4.0) * x)
    elif shape == 1:
        density = (x + 0.02) ** rng.uniform(0.2, 1.2) * np.exp(-rng.uniform(2.0, 6.0) * x)
    elif shape == 2:
        density = 0.3 + np.cos(0.5 * math.pi * x) ** 2
    else:
        density = np.exp(-0.5 * ((x - rng.uniform(0.1, 0.3)) / 0.12) ** 2) + 0.6 * np.exp(
            -0.5 * ((x - rng.uniform(0.5, 0.75)) / 0.15) ** 2
        )
    density *= np.clip((1.0 - x) / 0.05, 0.0, 1.0)
    masses = density / density.sum()
    mean = float(masses @ radii)
    width = rng.uniform(0.02, 0.15)
    most = 1.0 / LEAST_P0_SHARE - 1.0
    # Loop width over output range, 2 c mean / (span + c (span - 2 mean)), solved for the total weight c if p0 = 1
    below = 2.0 * mean * (1.0 + width) - width * span
    total = min(width * span / below, most) if below > 0.0 else most
    out = span * (1.0 + total) - 2.0 * total * mean
    scale = span_out / out
    base = Base(kind, low, high, scale, radii, scale * total * masses)
    if kind in ("maxwell", "bouc_wen"):
        number = int(rng.integers(300, 500))
        cumulative = np.concatenate(([0.0], np.cumsum(masses)))
        where = (np.arange(number) + rng.uniform(0.0, 1.0, number)) / number
        yields = np.interp(where, cumulative, edges)
        stiffnesses = rng.lognormal(0.0, 0.5, number)
        base = replace(base, yields=yields, stiffnesses=scale * total * stiffnesses / stiffnesses.sum())
    if kind == "relays":
        base = replace(base, phases=rng.uniform(0.0, 1.0, ROWS))
    if kind == "bouc_wen":
        share = scale * rng.uniform(0.001, 0.01)
        base = replace(base, bouc_wen=(share, span * rng.uniform(0.05, 0.2), rng.uniform(-0.3, 0.6), 1.0))
    return base


def spread(base: Base, rows: int) -> tuple[Array, Array]:
    """The density as `rows` half widths of equal weight, and that weight."""
    cumulative = np.cumsum(base.masses)
    total = float(cumulative[-1])
    wanted = (np.arange(rows) + 0.5) / rows * total
    return np.interp(wanted, cumulative - 0.5 * base.masses, base.radii), np.full(rows, total / rows)


@dataclass(frozen=True)
class Viscosity:
    """Sliders that slip with a delay. `law` power: excess decays as x' = -(x/unit)^exponent unit/tau_i with
    tau_i = tau (r_i/mean r)^slant; `law` activated: yield points grow by r_i strength asinh(slip rate/rate), thermally
    activated friction (Prandtl, Eyring), solved for the end of each time step."""

    law: str
    tau: float = 0.0
    exponent: float = 1.0
    slant: float = 0.0
    unit: float = 1.0
    strength: float = 0.0
    rate: float = 1.0


@dataclass(frozen=True)
class Centre:
    """Density of relays times 1 + strength shape((centre - middle)/width); `bend`: nonlinear springs instead."""

    shape: str
    strength: float
    middle: float
    width: float


def run(base: Base, v: Array, dt: Array, viscosity: Viscosity | None = None, centre: Centre | None = None) -> Array:
    """Output for a drive `v` with time steps `dt` (dt[0] is ignored), starting as if the drive came from far below."""
    if viscosity is not None:
        return _run_viscous(base, v, dt, viscosity)
    if centre is not None:
        return _run_bent(base, v, centre) if centre.shape == "bend" else _run_relays(base, v, centre)
    if base.kind == "everett":
        return _run_everett(base, v)
    if base.kind == "relays":
        return _run_relays(base, v, None)
    out = base.p0 * v + _sliders(v, *_elements(base))
    if base.kind == "bouc_wen":
        out = out + base.bouc_wen[0] * friction(v, *base.bouc_wen[1:])
    return np.asarray(out)


def _elements(base: Base) -> tuple[Array, Array]:
    if len(base.yields):
        return base.yields, base.stiffnesses
    return spread(base, 350)


def _run_everett(base: Base, v: Array) -> Array:
    farthest = 2.2 * base.span + 4.0 * float(base.radii[-1])
    moves = np.linspace(0.0, farthest, 8000)
    # Two cumulative sums give int p(r) max(d - 2r, 0) dr for every d at once
    weight = np.concatenate(([0.0], np.cumsum(base.masses)))
    moment = np.concatenate(([0.0], np.cumsum(base.masses * base.radii)))
    step = float(base.radii[1] - base.radii[0])
    edges = np.arange(len(base.masses) + 1) * step
    half = np.minimum(0.5 * moves, edges[-1])
    branch = base.p0 * moves + np.interp(half, edges, weight) * moves - 2.0 * np.interp(half, edges, moment)
    return np.asarray(_everett(v, branch, farthest / (len(moves) - 1), base.low - base.span))


@njit(cache=True)
def _everett(v: Array, branch: Array, step: float, far: float) -> Array:
    def climb(distance: float) -> float:
        x = distance / step
        k = min(int(x), len(branch) - 2)
        return branch[k] + (x - k) * (branch[k + 1] - branch[k])

    capacity = 20000
    points = np.empty(capacity)
    values = np.empty(capacity)
    points[0], values[0], top = far, 0.0, 0
    out = np.empty(len(v))
    last, rising = far, True
    for k in range(len(v)):
        x = v[k]
        if (x > last) != rising and x != last:
            side = 1.0 if rising else -1.0
            value = values[top] + side * climb(side * (last - points[top]))
            top += 1
            points[top], values[top] = last, value
            rising = not rising
        # the move removes a pair of reversals that it passes
        while top >= 2 and ((rising and x >= points[top - 1]) or (not rising and x <= points[top - 1])):
            top -= 2
        side = 1.0 if rising else -1.0
        out[k] = values[top] + side * climb(max(side * (x - points[top]), 0.0))
        last = x
    return out


def _run_relays(base: Base, v: Array, centre: Centre | None) -> Array:
    radii, weights = spread(base, ROWS)
    margin = float(radii[-1])
    pitch = base.span / COLUMNS
    number = int((base.span + 2.0 * margin) / pitch) + 2
    phases = base.phases if len(base.phases) else (np.arange(ROWS) * 0.6180339887) % 1.0
    origin = base.low - margin + phases * pitch
    centres = origin[:, None] + pitch * np.arange(number)[None, :]
    density = np.ones_like(centres)
    if centre is not None:
        x = (centres - centre.middle) / centre.width
        bump = {"gauss": np.exp(-0.5 * x * x), "lorentz": 1.0 / (1.0 + x * x), "tilt": np.tanh(x)}[centre.shape]
        density = np.maximum(1.0 + centre.strength * bump, 0.0)
    totals = np.zeros((ROWS, number + 1))
    totals[:, 1:] = np.cumsum(density * pitch * weights[:, None], axis=1)
    return np.asarray(base.p0 * v + _relays(v, radii, origin, pitch, totals))


@njit(cache=True)
def _relays(v: Array, radii: Array, origin: Array, pitch: float, totals: Array) -> Array:
    rows, most = totals.shape[0], totals.shape[1] - 1
    # in a row of equal widths, the relays with the lowest centres are always the ones that are up
    up = np.zeros(rows, np.int64)
    out = np.empty(len(v))
    for k in range(len(v)):
        total = 0.0
        for i in range(rows):
            switched_up = math.floor((v[k] - radii[i] - origin[i]) / pitch) + 1
            still_up = math.floor((v[k] + radii[i] - origin[i]) / pitch) + 1
            count = min(max(up[i], switched_up), still_up)
            count = min(max(count, 0), most)
            up[i] = count
            total += totals[i, count]
        out[k] = total
    return out


@njit(cache=True)
def _sliders(v: Array, yields: Array, stiffnesses: Array) -> Array:
    """Weighted slip of the sliders, on springs of `stiffnesses` that are stretched by v minus the slip."""
    stretch = yields.copy()
    out = np.empty(len(v))
    for k in range(len(v)):
        move = v[k] - v[k - 1] if k else 0.0
        total = 0.0
        for i in range(len(yields)):
            e = stretch[i] + move
            if e > yields[i]:
                e = yields[i]
            elif e < -yields[i]:
                e = -yields[i]
            stretch[i] = e
            total += stiffnesses[i] * (v[k] - e)
        out[k] = total
    return out


@njit(cache=True)
def friction(v: Array, length: float, ratio: float, exponent: float) -> Array:
    """Wen's variable in units of the drive, from 0, by Euler steps of a twentieth of the saturation length."""
    z = 0.0
    out = np.empty(len(v))
    for k in range(len(v)):
        move = v[k] - v[k - 1] if k else 0.0
        parts = max(1, int(abs(move) / (0.05 * length)) + 1)
        for _ in range(parts):
            d = move / parts
            z += d - (abs(d) * z + ratio * d * abs(z)) * abs(z / length) ** (exponent - 1.0) / (length * (1.0 + ratio))
        out[k] = z
    return out


def _run_viscous(base: Base, v: Array, dt: Array, law: Viscosity) -> Array:
    yields, stiffnesses = _elements(base)
    if law.law == "activated":
        return np.asarray(base.p0 * v + _activated(v, dt, yields, stiffnesses, law.strength, law.rate))
    mean = float(stiffnesses @ yields / stiffnesses.sum())
    taus = law.tau * (np.maximum(yields, 1e-3 * mean) / mean) ** law.slant
    return np.asarray(base.p0 * v + _viscous(v, dt, yields, stiffnesses, taus, law.exponent, law.unit))


@njit(cache=True)
def _viscous(
    v: Array, dt: Array, yields: Array, stiffnesses: Array, taus: Array, exponent: float, unit: float
) -> Array:
    stretch = yields.copy()
    decay = np.empty(len(yields))
    known = -1.0
    out = np.empty(len(v))
    for k in range(len(v)):
        move = v[k] - v[k - 1] if k else 0.0
        step = dt[k] if k else 0.0
        if abs(step - known) > 1e-9 * step:
            decay[:] = np.exp(-step / taus)
            known = step
        total = 0.0
        for i in range(len(yields)):
            e = stretch[i] + move
            excess = abs(e) - yields[i]
            if excess > 0.0:
                if exponent == 1.0:
                    # Excess of a ramp: exact for a ramp that is linear within the step
                    excess *= decay[i]
                else:
                    # x' = -(unit/tau)(x/unit)^m has a closed solution
                    x = (excess / unit) ** (1.0 - exponent) + (exponent - 1.0) * step / taus[i]
                    excess = unit * x ** (1.0 / (1.0 - exponent)) if x > 0.0 else 0.0
                e = yields[i] + excess if e > 0.0 else -yields[i] - excess
            stretch[i] = e
            total += stiffnesses[i] * (v[k] - e)
        out[k] = total
    return out


@njit(cache=True)
def _activated(v: Array, dt: Array, yields: Array, stiffnesses: Array, strength: float, rate: float) -> Array:
    stretch = yields.copy()
    out = np.empty(len(v))
    for k in range(len(v)):
        move = v[k] - v[k - 1] if k else 0.0
        slipped = max(dt[k], 1e-12) * rate if k else rate
        total = 0.0
        for i in range(len(yields)):
            e = stretch[i] + move
            if abs(e) > yields[i]:
                # y (1 + strength u) + slipped sinh(u) = |e| is convex: Newton's method descends from above
                u = math.asinh((abs(e) - yields[i]) / slipped)
                for _ in range(50):
                    grows = yields[i] * strength + slipped * math.cosh(u)
                    step = (yields[i] * (1.0 + strength * u) + slipped * math.sinh(u) - abs(e)) / grows
                    u -= step
                    if abs(step) < 1e-9:
                        break
                e = math.copysign(yields[i] * (1.0 + strength * u), e)
            stretch[i] = e
            total += stiffnesses[i] * (v[k] - e)
        out[k] = total
    return out


def _run_bent(base: Base, v: Array, centre: Centre) -> Array:
    yields, stiffnesses = _elements(base)
    return np.asarray(
        base.p0 * v + _bent(v, yields, stiffnesses, centre.strength, centre.middle, centre.width)
    )


@njit(cache=True)
def _bent(v: Array, yields: Array, stiffnesses: Array, strength: float, middle: float, width: float) -> Array:
    slip = v[0] - yields
    out = np.empty(len(v))
    mean = np.sum(yields * stiffnesses) / np.sum(stiffnesses)
    for k in range(len(v)):
        total = 0.0
        for i in range(len(yields)):
            s = min(max(slip[i], v[k] - yields[i]), v[k] + yields[i])
            slip[i] = s
            x = (s - middle) / width
            # wide elements bend more, so no function of the sum gives the same output
            bend = strength * min(yields[i] / mean, 2.0)
            total += stiffnesses[i] * (s + bend * width * (math.sqrt(1.0 + x * x) - 1.0))
        out[k] = total
    return out
