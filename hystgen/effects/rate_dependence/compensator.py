"""One step of rate-dependent plays, for a compensator."""

from __future__ import annotations

import math
from typing import TypeGuard

import numpy as np

from hystgen.effects.base import Array, Effect
from hystgen.effects.rate_dependence.model import RelaxingPlays, ThresholdRate, dilated_plays, relaxed


class Movement:
    """Where plays (n + 1) are after a step in which their input goes straight from `x` to `w`.

    Plays that relax move as in the forward model. Thresholds that grow with the rate have a bounded inverse only while
    `sum p_i beta_i < T/2 sum p_i` holds for every number of plays that slide together. Where it does not, plays that
    relax with time constants beta_i stand in for them: they lag as far behind on ramps, and their inverse is stable.
    """

    def __init__(self, effect: RelaxingPlays | ThresholdRate, thresholds: Array, weights: Array) -> None:
        self.r, self.weights = thresholds, weights
        self.betas = np.array(effect.betas) if isinstance(effect, ThresholdRate) else None
        self.exponent, self.scale = 1.0, float(thresholds[-1])
        if isinstance(effect, RelaxingPlays):
            self.taus, self.exponent = np.full(len(thresholds) - 1, effect.time_constant), effect.exponent
        else:
            self.taus = np.array(effect.betas)

    def by_threshold(self, seconds: float) -> bool:
        """Whether the growing thresholds are used as they are."""
        if self.betas is None:
            return False
        p = self.weights
        sliding = np.cumsum(p[1:] * self.betas) < 0.5 * seconds * np.cumsum(p)[1:]
        least = p[0] + float(np.sum(p[1:] * np.minimum(0.0, 1.0 - self.betas / seconds)))
        return bool(np.all(sliding) and least > 0.0)

    def after(self, plays: Array, x: float, w: float, seconds: float) -> Array:
        """The plays (n + 1) after the step, from where they were."""
        out = np.empty_like(plays)
        out[0] = w
        if self.by_threshold(seconds):
            rate = np.array([abs(w - x) / seconds])
            dilated_plays(np.array([w]), rate, self.r[1:], np.asarray(self.betas), plays[1:], out[1:, None])
            return out
        for i, tau in enumerate(self.taus, 1):
            if tau > 0.0:
                out[i] = relaxed(x, w, seconds, self.r[i], tau, self.exponent, self.scale, plays[i])
            else:
                out[i] = min(max(plays[i], w - self.r[i]), w + self.r[i])
        return out


# ---------------------------------------------------------------- a nonlinear dashpot, by a table

BEGIN, C0, C1, C2, C3 = range(5)
"""Columns of a piece: where it begins, and the coefficients of a cubic in the distance from there."""

LEAST_STRETCH = 1e-6
"""[largest thresholds] Below this a stretch loses a fixed share of itself; a range has some 1e5 of these."""

LEAST_YIELD = 2.0**-40
"""Share of a stretch that it loses in a step, below which the loss counts as proportional: next to nothing in 2^28
steps."""

LONGEST = 4.0
"""Largest ratio of a piece's end to its beginning: even laws steeper than a dashpot's are cubic over two octaves."""

YIELD_ERROR = 1e-3
"""Largest relative error of the loss of a stretch: plays' lag behind their input is off by a share of
`YIELD_ERROR/exponent`, while records determine time constants to 1 % at best."""


def nonlinear(effect: Effect) -> TypeGuard[RelaxingPlays]:
    """Whether plays have a dashpot that needs the table."""
    return isinstance(effect, RelaxingPlays) and effect.exponent != 1.0 and effect.time_constant > 0.0


def yielded(effect: RelaxingPlays, scale: float, seconds: float, x: float) -> tuple[float, float]:
    """The loss of a stretch x > 0 in a step in which only the play moves, and its slope.

    `e' = -(scale/tau) (e/scale)^m` has the solution `e^(1-m) = x^(1-m) + (m - 1) T scale^(1-m)/tau`.
    """
    more = effect.exponent - 1.0
    size = math.log(seconds / effect.time_constant) + more * math.log(x / scale)
    part = more * math.exp(min(size, 700.0))
    if part <= -1.0:
        return x, 1.0  # it comes to an end within the step
    spent = (math.log1p(part) if size < 700.0 else math.log(more) + size) / more
    return -x * math.expm1(-spent), -math.expm1(-effect.exponent * spent)


def seen(effect: RelaxingPlays, scale: float, seconds: float, way: float) -> float:
    """The share of the move `way` up to which the input counts as standing still.

    Exact for a linear dashpot as stiff as this one in steady motion by `way` a step.

    With `s = T f'(e)`, `E = exp(-s)` and `M = (1 - E)/s`: `(1 - M)/(1 - E)`, 1/2 for s = 0.
    """
    size = math.log(way * effect.time_constant / (seconds * scale)) / effect.exponent
    stiff = min(effect.exponent * way / (scale * math.exp(min(size, 50.0))), 1e3)
    return (1.0 + math.expm1(-stiff) / stiff) / -math.expm1(-stiff) if stiff > 1e-3 else 0.5 + stiff / 12.0


def pieces(effect: RelaxingPlays, scale: float, seconds: float, top: float) -> Array:
    """The loss of stretches up to `top` in a step, in rows (K, 5)."""
    more = effect.exponent - 1.0
    share = 1.0 / -more if more < 0.0 else LEAST_YIELD  # of a stretch that is lost within the step, or hardly at all
    begins = scale * math.exp(min(math.log(share * effect.time_constant / seconds) / more, 700.0))
    at = min(max(LEAST_STRETCH * scale, begins), top)
    rows: list[tuple[float, ...]] = [(0.0, 0.0, yielded(effect, scale, seconds, at)[0] / at, 0.0, 0.0)]
    while at < top:
        ratio = LONGEST
        while not _fits(effect, scale, seconds, row := _piece(effect, scale, seconds, at, ratio), at * ratio):
            ratio = math.sqrt(ratio)
        rows.append(row)
        at *= ratio
    return np.array(rows)


def _piece(effect: RelaxingPlays, scale: float, seconds: float, at: float, ratio: float) -> tuple[float, ...]:
    (a, da), (b, db) = (yielded(effect, scale, seconds, x) for x in (at, at * ratio))
    length = at * (ratio - 1.0)
    mean = (b - a) / length
    return at, a, da, (3.0 * mean - 2.0 * da - db) / length, (da + db - 2.0 * mean) / (length * length)


def _fits(effect: RelaxingPlays, scale: float, seconds: float, row: tuple[float, ...], end: float) -> bool:
    """Whether a piece rises, and is close enough to the law at points inside."""
    at, *c = row
    inside = np.linspace(at, end, 17)
    on = inside - at
    curve = ((c[3] * on + c[2]) * on + c[1]) * on + c[0]
    law = np.array([yielded(effect, scale, seconds, x)[0] for x in inside.tolist()])
    return bool(np.all(np.diff(curve) >= 0.0) and np.all(np.abs(curve - law) <= YIELD_ERROR * law))


def stretch_error(
    effect: RelaxingPlays, scale: float, seconds: float, rows: Array, ways: tuple[float, float], held: Array
) -> float:
    """Largest difference between the stretches of plays by the table and by the law.

    `ways`: the largest move of the input in a step, and overall; `held` (K,): rounding error of the loss on each piece.
    Of two plays, one by the law and one by the table, neither gains on the other once it is stretched by that much
    less.
    """
    end = LONGEST * rows[-1, BEGIN] if len(rows) > 1 else LEAST_STRETCH * scale
    x = np.append(0.0, np.geomspace(1e-3 * (rows[1, BEGIN] if len(rows) > 1 else end), end, 6000))
    law = np.array([0.0, *(yielded(effect, scale, seconds, each)[0] for each in x[1:].tolist())])
    k = np.searchsorted(rows[:, BEGIN], x, side="right") - 1
    on = x - rows[k, BEGIN]
    curve = ((rows[k, C3] * on + rows[k, C2]) * on + rows[k, C1]) * on + rows[k, C0]
    least, most = (np.maximum.accumulate(np.append(0.0, (curve + side * held[k])[1:])) for side in (-1.0, 1.0))
    reached = (law <= min(ways[0], float(least[-1]))) & (x <= ways[1])
    farther = np.interp(law, least, x) - x
    nearer = x - np.interp(law, most, x)
    return float(max(np.max(farther[reached]), np.max(nearer[reached])))
