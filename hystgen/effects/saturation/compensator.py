"""Saturation behind the plays for a compensator: a block without memory."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hystgen.arithmetic.factors import error as missed
from hystgen.effects.base import Array
from hystgen.effects.maps import Fitted, Map, MapErrors, MapPart, Wanted, Whole
from hystgen.effects.part import called
from hystgen.effects.saturation.model import HardSaturation, Stops, TanhSaturation
from hystgen.front.tanh import kernels
from hystgen.front.tanh.model import TanhEnvelope
from hystgen.plays.slots import DEAD_ZONE, TANH

STEEP = 4.0
"""Largest argument of a tanh to which a displacement is inverted, in its levels: the inverse has slope 750 there."""


@dataclass(frozen=True)
class Smooth(Map):
    """A tanh."""

    effect: TanhSaturation

    def undone(self, y: Array) -> Array:
        """The input that gives the output `y`, short of the level."""
        effect, most = self.effect, np.nextafter(1.0, 0.0)
        share = np.clip((y - effect.centre) / effect.level, -most, most)
        return np.asarray(effect.centre + effect.level * np.arctanh(share))

    def stage(self, largest: float) -> tuple[int, int, list[float]]:
        """Both branches of an envelope."""
        level = self.effect.level
        return TANH, 0, 2 * [*self.effect.envelope, 1.0 / level, level, largest]

    def errors(self, found: MapErrors, u: float, kind: str) -> MapErrors:
        """Errors in floating point."""
        effect, (ends, slope, back, there) = self.effect, found
        level, centre = effect.level, abs(effect.centre)
        shares = np.clip((ends - effect.centre) / level, 4.0 * u - 1.0, 1.0 - 4.0 * u)
        share = float(np.max(np.abs(shares)))
        slope = slope / (1.0 - share * share)
        size, off = level * share, 1.0 if centre else 0.0
        back += u * (4.0 * size + level * (0.9 * kernels.ATANH_MAX_ULP[kind] + 2.0)) * slope
        back += u * (2.0 * off * size + 5.0 * centre) * slope  # two more sums; a2, a3 and what they are added to
        there += u * level * (4.0 + 2.0 * kernels.TANH_MAX_ULP[kind])
        there += u * (off * level + 6.0 * centre)
        return MapErrors(effect.centre + level * np.arctanh(shares), slope, back, there)

    def grown(self, size: float, lsb: float) -> float:
        """It never takes an output farther from 0 than its centre is."""
        return max(size, abs(self.effect.centre / lsb) + 1.0)

    def asked(
        self, back: float, ends: tuple[float, float], still: float, lsb: float
    ) -> tuple[float, tuple[float, float] | None]:
        """At least what the model reaches at rest."""
        centre = self.effect.centre / lsb
        way = max(*(abs(end - centre) for end in ends), min(still + abs(centre), STEEP * (self.effect.level / lsb)))
        reached = centre - way, centre + way
        return max(map(abs, reached)), reached

    def curves(self, size: float, ends: tuple[float, float] | None, lsb: float) -> list[Wanted]:
        """The tanh and its inverse."""
        assert ends
        level, centre = self.effect.level / lsb, self.effect.centre / lsb
        envelope = TanhEnvelope((level, 1.0 / level, 0.0 - centre / level, centre))
        least, most = (float(envelope.forward(end)) for end in ends)
        largest = min(level + abs(centre), max(size, abs(centre)))
        return [
            Wanted(lambda x: float(envelope.forward(x)), -size, size, largest),
            Wanted(lambda y: float(envelope.inverse(y)), least, most, max(map(abs, ends))),
        ]

    def whole_errors(self, found: MapErrors, curves: Sequence[Fitted], unit: Whole) -> MapErrors:
        """Errors of the two curves."""
        effect, (onward, backward) = self.effect, curves
        most = 1.0 - 2.0**-50
        shares = [min(max((end - effect.centre) / effect.level, -most), most) for end in found.ends.tolist()]
        share = max(map(abs, shares))
        slope = found.slope / (1.0 - share * share)
        back = found.back / (1.0 - share * share) + backward.error(1.0 / (1.0 - share * share)) * unit.signal
        there = found.there + onward.error(1.0) * unit.signal
        ends = np.array([effect.centre + effect.level * math.atanh(each) for each in shares])
        return MapErrors(ends, slope, back, there)


@dataclass(frozen=True)
class Straight(Map):
    """Limits, hard ones or with a slope beyond them."""

    effect: HardSaturation | Stops

    def pieces(self) -> tuple[float, float, float]:
        """The ends between which nothing changes, and the slope beyond them."""
        if isinstance(self.effect, HardSaturation):
            return -self.effect.level, self.effect.level, 0.0
        return self.effect.lower, self.effect.upper, self.effect.give

    def undone(self, y: Array) -> Array:
        """The input that gives the output `y`, at an end if nothing moves beyond."""
        lower, upper, give = self.pieces()
        inside = np.clip(y, lower, upper)
        return inside if give == 0.0 else np.asarray(inside + (y - inside) / give)

    def stage(self, largest: float) -> tuple[int, int, list[float]]:
        """Two breaks, three slopes and their reciprocals."""
        lower, upper, give = self.pieces()
        ends, anchors = [lower, upper], [lower, lower, upper]
        over = 1.0 / give if give else 0.0
        return DEAD_ZONE, 2, [*ends, *ends, *anchors, *anchors, give, 1.0, give, over, 1.0, over]

    def errors(self, found: MapErrors, u: float, kind: str) -> MapErrors:
        """Errors in floating point."""
        size, (_, _, give) = float(np.max(np.abs(found.ends))), self.pieces()
        slope = found.slope / (give if 0.0 < give < 1.0 else 1.0)
        return MapErrors(found.ends, slope, found.back + 8.0 * u * size * slope, found.there + 8.0 * u * size)

    def grown(self, size: float, lsb: float) -> float:
        """Nothing grows."""
        return size

    def asked(
        self, back: float, ends: tuple[float, float], still: float, lsb: float
    ) -> tuple[float, tuple[float, float] | None]:
        """Without a slope no farther than its ends."""
        lower, upper, give = self.pieces()
        if isinstance(self.effect, HardSaturation):
            return min(back, upper / lsb + 1.0), None
        return back / give if give else max(abs(lower), abs(upper)) / lsb, None

    def curves(self, size: float, ends: tuple[float, float] | None, lsb: float) -> list[Wanted]:
        """None."""
        return []

    def whole_errors(self, found: MapErrors, curves: Sequence[Fitted], unit: Whole) -> MapErrors:
        """Errors of two products."""
        _, _, give = self.pieces()
        over = 1.0 / give if 0.0 < give < 1.0 else 1.0
        ends, slope, back, there = found.ends, found.slope * over, found.back * over, found.there
        if give:
            size = max(map(abs, ends.tolist())) / unit.lsb
            back += (0.5 + over) * unit.signal + missed(1.0 / give) * size
            there += 1.0 * unit.signal + missed(give) * unit.output
        return MapErrors(ends, slope, back, there)


def saturation(effect: TanhSaturation | HardSaturation | Stops) -> Map:
    """The map of an effect."""
    return Smooth(effect) if isinstance(effect, TanhSaturation) else Straight(effect)


MAPS = MapPart(called("saturation"), saturation)
"""Saturation as a part of the chain."""
