"""Names that the records cannot exclude: the plant refitted with every catalogue form, judged on held-out records.

For each effect by itself on its base hysteresis, with the noise of the case, a simple form of each catalogue name is
fitted to the fit records jointly with a play sum and an offset per record. So is the true form: the play sum on the
plant without the effect, since all parameters of the effect are known. A name whose held-out rms is within 5 % of the
true form's cannot be separated on these records.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.interpolate import Akima1DInterpolator
from scipy.linalg import expm
from scipy.optimize import minimize

from . import refit
from .base import friction
from .effects.drive_side import first_order

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

ALIKE = 1.05
"""Largest ratio of the held-out rms of two forms that count as not separable."""

PLAYS = 24


@dataclass(frozen=True)
class Data:
    """A course with a measured output (seen samples); `clock`: the time within the record, at every sample."""

    course: refit.Track
    clock: Array
    y: Array
    low: float
    high: float
    rate: float
    """Samples per second of the fastest record."""
    temperature: Array | None

    @property
    def span(self) -> float:
        return self.high - self.low

    @property
    def dt(self) -> Array:
        return np.diff(self.course.t, prepend=self.course.t[0])


Columns = tuple[Array, int]
"""Columns on the seen samples, and the number of columns at the end that may have either sign."""

Form = Callable[[Data, Array], Columns]


@dataclass(frozen=True)
class Rival:
    """A form with nonlinear parameters: start values in rows, the best of which is refined; in logs if `positive`."""

    form: Form
    starts: Callable[[Data], Array]
    positive: bool = True


def compared(data: Data, twin: Array) -> dict[str, float]:
    """Held-out rms of every name's form relative to that of the true form, which is a play sum on the output `twin`."""
    true = held_out_rms(data, plain(data, np.empty(0)), twin)
    return {other: min(_best(data, rival) for rival in rivals) / true for other, rivals in RIVALS.items()}


def held_out_rms(data: Data, columns: Columns, y: Array) -> float:
    """Fit to the fit records, then rms error on the held-out ones with a free offset each."""
    return _judge(data, columns, y)[1]


def _judge(data: Data, columns: Columns, y: Array) -> tuple[float, float]:
    course = data.course
    record = course.record[course.seen]
    matrix = refit.centred(columns[0], record)
    target = refit.centred(y, record)
    fitted = course.of(False)
    weights = refit.fit(matrix[fitted], target[fitted], columns[1])
    error = target - matrix @ weights
    return float(np.sqrt(np.mean(error[fitted] ** 2))), float(np.sqrt(np.mean(error[~fitted] ** 2)))


def _best(data: Data, rival: Rival) -> float:
    """Held-out rms with the best-fitting parameters."""
    starts = rival.starts(data)
    begins = np.log(starts) if rival.positive else starts
    reach = 2.0 if rival.positive else 0.5

    def point(x: Array) -> Array:
        # a parameter without effect must not run off to infinity
        x = np.clip(x, begins.min(axis=0) - reach, begins.max(axis=0) + reach)
        return np.exp(x) if rival.positive else x

    def cost(x: Array) -> float:
        return _judge(data, rival.form(data, point(x)), data.y)[0]

    if starts.shape[1] == 0:
        return held_out_rms(data, rival.form(data, starts[0]), data.y)
    costs = [cost(x) for x in begins]
    begin = begins[int(np.argmin(costs))]
    size = 0.25 if rival.positive else 0.03
    simplex = np.vstack((begin, begin + size * np.eye(len(begin))))
    options = {"initial_simplex": simplex, "xatol": 0.01, "fatol": 1e-5 * min(costs), "maxfev": 12 + 16 * len(begin)}
    found = minimize(cost, begin, method="Nelder-Mead", options=options)
    return held_out_rms(data, rival.form(data, point(found.x)), data.y)


# -- forms -------------------------------------------------------------------------------------------------------------


def _plays(data: Data, v: Array) -> Array:
    return np.asarray(refit.plays(np.ascontiguousarray(v), refit.radii(data.span, PLAYS))[data.course.seen])


def plain(data: Data, _: Array) -> Columns:
    return _plays(data, data.course.v), 0


def _front(change: Callable[[Data, Array], Array]) -> Form:
    return lambda data, x: (_plays(data, change(data, x)), 0)


def _lag(data: Data, x: Array) -> Array:
    return np.asarray(first_order(data.course.v, data.dt, float(x[0])))


def _delayed(straight: bool) -> Form:
    """Delay the plays instead of the drive, as they remember corners that fall between a delayed drive's samples.

    Between samples, straight lines suit steep edges, and Akima curves suit sines.
    """

    def form(data: Data, x: Array) -> Columns:
        course = data.course
        columns = refit.plays(course.v, refit.radii(data.span, PLAYS))
        then = np.maximum(course.t[course.seen] - x[0], course.t[0])
        if not straight:
            return np.asarray(Akima1DInterpolator(course.t, columns)(then)), 0
        after = np.clip(np.searchsorted(course.t, then), 1, len(course.t) - 1)
        share = (then - course.t[after - 1]) / (course.t[after] - course.t[after - 1])
        return columns[after - 1] + share[:, None] * (columns[after] - columns[after - 1]), 0

    return form


@njit(cache=True)
def _limited(v: Array, dt: Array, rising: float, falling: float) -> Array:
    out = np.empty_like(v)
    a = v[0]
    for k in range(len(v)):
        a += max(-falling * dt[k], min(rising * dt[k], v[k] - a))
        out[k] = a
    return out


def _slew(data: Data, x: Array) -> Array:
    return np.asarray(_limited(data.course.v, data.dt, float(x[0]), float(x[0] * x[1])))


def _asymmetric(data: Data, x: Array) -> Array:
    u = 2.0 * (data.course.v - data.low) / data.span - 1.0
    return np.asarray(data.course.v + 0.5 * data.span * (x[0] * u * u + x[1] * (u**3 - u)))


def _clipped(data: Data, x: Array) -> Array:
    cut = float(x[0]) * data.span
    low = data.low + cut if data.low < -0.3 * data.high else -math.inf
    return np.clip(data.course.v, low, data.high - cut)


def _bent(data: Data, x: Array) -> Array:
    scale = float(x[0]) * max(data.high, -data.low)
    return np.asarray(scale * np.tanh(data.course.v / scale))


def _stops(data: Data, x: Array) -> Columns:
    """Bends of the output at a fraction of its range below the top and, on a two-sided bench, above the bottom."""
    columns = _plays(data, data.course.v)
    h = _predicted(data, columns)
    cut = float(x[0]) * float(np.ptp(h))
    ends = [np.maximum(h - (h.max() - cut), 0.0)]
    if data.low < -0.3 * data.high:
        ends.append(np.minimum(h - (h.min() + cut), 0.0))
    return np.column_stack((columns, *ends)), len(ends)


@njit(cache=True)
def _moving_plays(v: Array, dt: Array, radii: Array, growth: float, tau: float) -> Array:
    """Plays with thresholds r (1 + growth |v'|), or plays that follow with a time constant."""
    out = np.empty((len(v), len(radii)))
    for i in range(len(radii)):
        s = v[0] - radii[i]
        for k in range(len(v)):
            rate = abs(v[k] - v[k - 1]) / dt[k] if k else 0.0
            r = radii[i] * (1.0 + growth * rate)
            target = max(v[k] - r, min(v[k] + r, s))
            s += (target - s) * (1.0 - math.exp(-dt[k] / tau)) if tau > 0.0 else target - s
            out[k, i] = s
        if radii[i] == 0.0:
            out[:, i] = v
    return out


def _grown(data: Data, x: Array) -> Columns:
    columns = _moving_plays(data.course.v, data.dt, refit.radii(data.span, PLAYS), float(x[0]), 0.0)
    return columns[data.course.seen], 0


def _relaxed(data: Data, x: Array) -> Columns:
    columns = _moving_plays(data.course.v, data.dt, refit.radii(data.span, PLAYS), 0.0, float(x[0]))
    return columns[data.course.seen], 0


@njit(cache=True)
def _second_order(columns: Array, a: Array, b0: Array, b1: Array) -> Array:
    out = np.empty_like(columns)
    for i in range(columns.shape[1]):
        q, p = columns[0, i], 0.0
        out[0, i] = q
        for k in range(1, columns.shape[0]):
            u0, u1 = columns[k - 1, i], columns[k, i]
            q, p = (
                a[0, 0] * q + a[0, 1] * p + b0[0] * u0 + b1[0] * u1,
                a[1, 0] * q + a[1, 1] * p + b0[1] * u0 + b1[1] * u1,
            )
            out[k, i] = q
    return out


def _resonant(data: Data, x: Array) -> Columns:
    """Every play through a second-order system, exact for an input that is linear between samples."""
    course = data.course
    w, damping = 2.0 * math.pi * float(x[0]), min(float(x[1]), 3.0)
    columns = _plays(data, course.v)
    record, t = course.record[course.seen], course.t[course.seen]
    for k in range(len(course.held_out)):
        rows = record == k
        dt = float(np.median(np.diff(t[rows])))
        # state q, p/w in units of w t, extended by the input and its slope
        system = np.zeros((4, 4))
        system[0, 1], system[1, 0], system[1, 1], system[1, 2], system[2, 3] = 1.0, -1.0, -2.0 * damping, 1.0, 1.0
        step = w * dt
        exact = expm(system * step)
        slope = exact[:2, 3] / step
        columns[rows] = _second_order(columns[rows], exact[:2, :2], exact[:2, 2] - slope, slope)
    return columns, 0


def _predicted(data: Data, columns: Array) -> Array:
    """Play sum alone, fitted to the fit records, without its offsets."""
    course = data.course
    record = course.record[course.seen]
    fitted = course.of(False)
    matrix = refit.centred(columns, record)
    weights = refit.fit(matrix[fitted], refit.centred(data.y, record)[fitted])
    h = columns @ weights
    # zero drive gives about zero output, relative to which a gain acts
    return np.asarray(h - h.mean() + 0.5 * (data.low + data.high) * np.ptp(h) / data.span)


@njit(cache=True)
def _relaxations(h: Array, dt: Array, taus: Array) -> Array:
    out = np.empty((len(h), len(taus)))
    for j in range(len(taus)):
        x = h[0]
        for k in range(len(h)):
            middle = 0.5 * (h[k] + h[k - 1]) if k else h[0]
            x += (middle - x) * (1.0 - math.exp(-dt[k] / taus[j]))
            out[k, j] = x
    return out


def _creep(data: Data, _: Array) -> Columns:
    course = data.course
    spread = refit.plays(course.v, refit.radii(data.span, PLAYS))
    columns = spread[course.seen]
    record = course.record[course.seen]
    fitted = course.of(False)
    longest = 20.0 * len(course.v) / len(course.held_out) * float(np.median(np.diff(course.t[course.seen])))
    taus = np.geomspace(2.0 / data.rate, max(longest, 200.0 / data.rate), 9)
    target = refit.centred(data.y, record)[fitted]
    weights = refit.fit(refit.centred(columns, record)[fitted], target)
    for _ in range(3):
        slow = _relaxations(spread @ weights[:PLAYS], data.dt, taus)[course.seen]
        both = np.column_stack((columns, slow))
        weights = refit.fit(refit.centred(both, record)[fitted], target)
    return both, 0


def _drift(data: Data, _: Array) -> Columns:
    x = data.clock[data.course.seen]
    return np.column_stack((_plays(data, data.course.v), x - x.mean())), 1


def _logged(data: Data, _: Array) -> Columns:
    columns = _plays(data, data.course.v)
    if data.temperature is None:
        return columns, 0
    x = data.temperature - data.temperature.mean()
    return np.column_stack((columns, x, x * _predicted(data, columns))), 2


def _heated(data: Data, x: Array) -> Columns:
    columns = _plays(data, data.course.v)
    power = np.abs(np.diff(data.course.v, prepend=data.course.v[0])) * data.span
    decay = np.exp(-data.dt / float(x[0]))
    heat = _accumulated(power, decay)[data.course.seen]
    heat = heat / max(float(heat.max()), 1e-300)
    return np.column_stack((columns, heat, heat * _predicted(data, columns))), 2


@njit(cache=True)
def _accumulated(power: Array, decay: Array) -> Array:
    out = np.empty_like(power)
    heat = 0.0
    for k in range(len(power)):
        heat = heat * decay[k] + power[k]
        out[k] = heat
    return out


def _aged(shape: Callable[[Array], Array]) -> Form:
    def form(data: Data, x: Array) -> Columns:
        columns = _plays(data, data.course.v)
        travel = np.cumsum(np.abs(np.diff(data.course.v, prepend=data.course.v[0])))[data.course.seen]
        return np.column_stack((columns, _predicted(data, columns) * shape(travel / float(x[0])))), 1

    return form


def _sensed(data: Data, _: Array) -> Columns:
    """Powers of the measured output, fitted together with the plays: y + c_2 y^2 + .. = PI."""
    columns = _plays(data, data.course.v)
    h = _predicted(data, columns)
    half = 0.5 * float(np.ptp(data.y))  # a sum fitted only to drift may not move at all
    z = (data.y - _record_means(data, data.y) + _record_means(data, h) - h.mean()) / half
    return np.column_stack((columns, half * z**2, half * z**3, half * z**4)), 3


def _record_means(data: Data, x: Array) -> Array:
    record = data.course.record[data.course.seen]
    return np.asarray(x - refit.centred(x, record))


def _play_functions(data: Data, _: Array) -> Columns:
    columns = _plays(data, data.course.v)
    z = 2.0 * (columns - data.low) / data.span - 1.0
    some = z[:, 1::3]
    return np.column_stack((columns, some**2, some**3)), 2 * some.shape[1]


def _centred_density(data: Data, x: Array) -> Columns:
    columns = _plays(data, data.course.v)
    z = (columns[:, 1:] - data.low) / data.span
    bump = np.tanh((z - x[0]) / 0.2)
    return np.column_stack((columns, bump[:, ::3])), len(range(0, PLAYS - 1, 3))


def _open(data: Data, x: Array) -> Columns:
    element = friction(np.ascontiguousarray(data.course.v), float(x[0]), 0.0, 1.0)
    return np.column_stack((_plays(data, data.course.v), element[data.course.seen])), 1


def _none(_: Data) -> Array:
    return np.empty((1, 0))


def _times(least: float, most: float, number: int) -> Callable[[Data], Array]:
    """Start values, as multiples of the fastest record's sample time."""
    return lambda data: np.geomspace(least, most, number)[:, None] / data.rate


def _slews(data: Data) -> Array:
    fastest = float(np.max(np.abs(np.diff(data.course.v)[1:]) / np.maximum(data.dt[2:], 1e-12)))
    return np.column_stack((fastest * np.geomspace(0.95, 0.004, 10), np.ones(10)))


def _modes(data: Data) -> Array:
    return np.array([[f * data.rate, z] for f in np.geomspace(0.004, 0.2, 24).tolist() for z in (0.05, 0.6)])


def _long_times(data: Data) -> Array:
    total = float(data.course.t[-1])
    return np.geomspace(0.01 * total, total, 5)[:, None]


def _travels(data: Data) -> Array:
    return data.span * np.geomspace(3.0, 300.0, 5)[:, None]


def _growths(data: Data) -> Array:
    rates = np.abs(np.diff(data.course.v)) / np.maximum(data.dt[1:], 1e-12)
    return np.geomspace(0.002, 0.5, 7)[:, None] / float(np.quantile(rates, 0.98))


RIVALS: dict[str, list[Rival]] = {
    "asymmetry": [Rival(_front(_asymmetric), lambda _: np.array([[0.0, 0.0], [0.05, 0.0], [-0.05, 0.0]]), False)],
    "saturation": [
        Rival(_front(_clipped), lambda _: np.geomspace(0.01, 0.2, 6)[:, None]),
        Rival(_front(_bent), lambda _: np.geomspace(0.8, 6.0, 6)[:, None]),
        Rival(_stops, lambda _: np.geomspace(0.02, 0.2, 5)[:, None]),
    ],
    "sensor_nonlinearity": [Rival(_sensed, _none)],
    "noncongruent": [
        Rival(_play_functions, _none),
        Rival(_centred_density, lambda _: np.array([[0.3], [0.5], [0.7]]), False),
    ],
    "lag": [Rival(_front(_lag), _times(0.15, 60.0, 9))],
    "delay": [Rival(_delayed(straight), _times(0.1, 30.0, 9)) for straight in (True, False)],
    "slew_limit": [Rival(_front(_slew), _slews)],
    "resonance": [Rival(_resonant, _modes)],
    "rate_dependence": [Rival(_grown, _growths), Rival(_relaxed, _times(0.3, 300.0, 8))],
    "creep": [Rival(_creep, _none)],
    "drift": [Rival(_drift, _none)],
    "thermal": [Rival(_logged, _none), Rival(_heated, _long_times)],
    "bouc_wen": [Rival(_open, lambda data: data.span * np.geomspace(0.02, 0.5, 6)[:, None])],
    "ageing": [Rival(_aged(np.log1p), _travels), Rival(_aged(lambda x: 1.0 - np.exp(-x)), _travels)],
}
