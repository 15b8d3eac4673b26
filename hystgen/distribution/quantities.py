"""Units in terms of the FMI standard: exponents of the SI's base units, a factor and an offset."""

from __future__ import annotations

import re
from collections.abc import Mapping
from fractions import Fraction
from typing import NamedTuple

from hystgen.records.units import TEMPERATURE, quantity

_EXPONENTS: Mapping[str, Mapping[str, int]] = {
    "m": {"m": 1}, "s": {"s": 1}, "A": {"A": 1}, "K": {"K": 1}, "rad": {"rad": 1}, "g": {"kg": 1}, "strain": {},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1}, "N": {"kg": 1, "m": 1, "s": -2}, "T": {"kg": 1, "s": -2, "A": -1},
    "Hz": {"s": -1}, "Pa": {"kg": 1, "m": -1, "s": -2}, "W": {"kg": 1, "m": 2, "s": -3},
    "J": {"kg": 1, "m": 2, "s": -2}, "F": {"kg": -1, "m": -2, "s": 4, "A": 2}, "C": {"A": 1, "s": 1},
    "Ohm": {"kg": 1, "m": 2, "s": -3, "A": -2}, "A/m": {"A": 1, "m": -1}, "1": {},
}
"""Quantities, named as in `hystgen.records.units`, by the SI's base units (and rad, as in FMI)."""

_GRAM = Fraction(1, 1000)


class SIUnit(NamedTuple):
    """A unit as `factor` times a product of powers (`exponents`) of base units, plus `offset`."""

    exponents: dict[str, int]
    factor: Fraction
    offset: Fraction = Fraction(0)


def si(unit: str) -> SIUnit | None:
    """A unit in base units: one that records have, or a product or quotient such as um/V, K s/V^2; None if unknown."""
    if unit == "%":
        return SIUnit({}, Fraction(1, 100))
    known = quantity(unit, TEMPERATURE if unit.startswith("deg") else "")
    if known is not None:
        size = known.size * (_GRAM if known.kind == "g" else 1)
        return SIUnit(dict(_EXPONENTS[known.kind]), size, known.zero)
    above, *below = unit.split("/")
    total, factor = dict[str, int](), Fraction(1)
    for part, sign in ((above, 1), *((each, -1) for each in below)):
        for word in re.split(r"[ *]+", part.strip()):
            found = re.fullmatch(r"(1|[^\d^]+)(?:\^?(-?\d))?", word)
            if found is None:
                return None
            one = SIUnit({}, Fraction(1)) if found[1] == "1" else si(found[1]) if found[1] != unit else None
            if one is None:
                return None
            power = sign * int(found[2] or 1)
            factor *= one.factor**power
            for base, exponent in one.exponents.items():
                total[base] = total.get(base, 0) + power * exponent
    return SIUnit({base: exponent for base, exponent in total.items() if exponent}, factor)
