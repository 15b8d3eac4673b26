"""Saturation behind the plays for a compensator: a map without memory."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from hystgen.effects.base import Array
from hystgen.effects.maps import FittedCurve, Map, MapErrors, MapPart, Wanted, Whole
from hystgen.effects.part import called
from hystgen.effects.saturation.model import HardSaturation, Stops, TanhSaturation
from hystgen.front.tanh import kernels
from hystgen.front.tanh.model import TanhEnvelope
from hystgen.plays.slots import TANH

STEEP = 4.0
"""[levels] Largest argument of the tanh that the inverse of a displacement may return; its slope is 750 there."""


class Smooth(Map):
    """A smooth limit, a tanh."""

    def __init__(self, effect: TanhSaturation) -> None:
        super().__init__(effect)
        self.level, self.centre, self.envelope = effect.level, effect.centre, effect.envelope

    def undone(self, y: Array) -> Array:
        """As for any map, but stopping short of the level."""
        most = np.nextafter(1.0, 0.0)
        share = np.clip((y - self.centre) / self.level, -most, most)
        return np.asarray(self.centre + self.level * np.arctanh(share))

    def stage(self, largest: float) -> tuple[int, int, list[float]]:
        """Both branches of an envelope."""
        return TANH, 0, 2 * [*self.envelope, 1.0 / self.level, self.level, largest]

    def errors(self, found: MapErrors, u: float, kind: str) -> MapErrors:
        """As for any map."""
        ends, slope, back, there = found
        level, centre = self.level, abs(self.centre)
        shares = np.clip((ends - self.centre) / level, 4.0 * u - 1.0, 1.0 - 4.0 * u)
        share = float(np.max(np.abs(shares)))
        slope = slope / (1.0 - share * share)
        size, off = level * share, 1.0 if centre else 0.0
        back += u * (4.0 * size + level * (0.9 * kernels.ATANH_MAX_ULP[kind] + 2.0)) * slope
        back += u * (2.0 * off * size + 5.0 * centre) * slope  # two more sums: a2 and a3 with their addends
        there += u * level * (4.0 + 2.0 * kernels.TANH_MAX_ULP[kind])
        there += u * (off * level + 6.0 * centre)
        return MapErrors(self.centre + level * np.arctanh(shares), slope, back, there)

    def grown(self, size: float, lsb: float) -> float:
        """The size, or the centre's distance from 0 if larger: the map moves outputs towards its centre."""
        return max(size, abs(self.centre / lsb) + 1.0)

    def asked(
        self, back: float, ends: tuple[float, float], still: float, lsb: float
    ) -> tuple[float, tuple[float, float] | None]:
        """As for any map, but at least as large as the model reaches at rest."""
        centre = self.centre / lsb
        way = max(*(abs(end - centre) for end in ends), min(still + abs(centre), STEEP * (self.level / lsb)))
        reached = centre - way, centre + way
        return max(map(abs, reached)), reached

    def curves(self, size: float, ends: tuple[float, float] | None, lsb: float) -> list[Wanted]:
        """The tanh and its inverse."""
        assert ends
        level, centre = self.level / lsb, self.centre / lsb
        envelope = TanhEnvelope((level, 1.0 / level, 0.0 - centre / level, centre))
        least, most = (float(envelope.forward(end)) for end in ends)
        largest = min(level + abs(centre), max(size, abs(centre)))
        return [
            Wanted(lambda x: float(envelope.forward(x)), -size, size, largest),
            Wanted(lambda y: float(envelope.inverse(y)), least, most, max(map(abs, ends))),
        ]

    def whole_errors(self, found: MapErrors, curves: Sequence[FittedCurve], unit: Whole) -> MapErrors:
        """As for any map."""
        (onward, backward), most = curves, 1.0 - 2.0**-50
        shares = [min(max((end - self.centre) / self.level, -most), most) for end in found.ends.tolist()]
        share = max(map(abs, shares))
        steep = 1.0 / (1.0 - share * share)
        back = found.back / (1.0 - share * share) + backward.error(steep) * unit.signal
        ends = np.array([self.centre + self.level * math.atanh(each) for each in shares])
        slope = found.slope / (1.0 - share * share)
        return MapErrors(ends, slope, back, found.there + onward.error(1.0) * unit.signal)


class Hard(Map):
    """A hard limit on either side."""

    def asked(
        self, back: float, ends: tuple[float, float], still: float, lsb: float
    ) -> tuple[float, tuple[float, float] | None]:
        """As for any map, but no farther than the limit."""
        return min(back, self.upper / lsb + 1.0), None


def saturation(effect: TanhSaturation | HardSaturation | Stops) -> Map:
    """The map of an effect."""
    if isinstance(effect, TanhSaturation):
        return Smooth(effect)
    if isinstance(effect, HardSaturation):
        return Hard(effect, -effect.level, effect.level)
    return Map(effect, effect.lower, effect.upper, effect.give)


MAPS = MapPart(called("saturation"), saturation)
"""Saturation as a part of the chain."""
