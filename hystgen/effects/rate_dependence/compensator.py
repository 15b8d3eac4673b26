"""How plays that depend on the rate move in one step, for a compensator."""

from __future__ import annotations

import numpy as np

from hystgen.effects.base import Array
from hystgen.effects.rate_dependence.model import RelaxingPlays, ThresholdRate, relaxed


class Movement:
    """Where plays (n + 1) are after a step in which their input goes straight from `x` to `w`.

    Plays that relax move as in the forward model. Thresholds that grow with the rate have an inverse that does not grow
    without bound only while `sum p_i beta_i < T/2 sum p_i` over every number of plays that slide together. Where they
    do not, plays that relax with time constants beta_i stand in for them: they lag as far behind on ramps, and their
    inverse is stable.
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
        """Whether thresholds that grow with the rate are taken as they are."""
        if self.betas is None:
            return False
        p = self.weights
        sliding = np.cumsum(p[1:] * self.betas) < 0.5 * seconds * np.cumsum(p)[1:]
        least = p[0] + float(np.sum(p[1:] * np.minimum(0.0, 1.0 - self.betas / seconds)))
        return bool(np.all(sliding) and least > 0.0)

    def after(self, plays: Array, x: float, w: float, seconds: float) -> Array:
        """Rows (n + 1)."""
        out = np.empty_like(plays)
        out[0] = w
        if self.by_threshold(seconds):
            r = self.r[1:] + np.asarray(self.betas) * abs(w - x) / seconds
            out[1:] = np.clip(plays[1:], w - r, w + r)
            return out
        for i, tau in enumerate(self.taus, 1):
            if tau > 0.0:
                out[i] = relaxed(x, w, seconds, self.r[i], tau, self.exponent, self.scale, plays[i])
            else:
                out[i] = min(max(plays[i], w - self.r[i]), w + self.r[i])
        return out
