"""From a model to the numbers that the kernels work with, in one arithmetic.

Everything a compiled operator knows comes from here, once, for the bit reference and for the C text alike.
"""

from __future__ import annotations

from collections.abc import Sequence

from hystgen.arithmetic import ARITHMETICS
from hystgen.chain.static import StaticModel
from hystgen.compensator import fixed_tables
from hystgen.compensator.float_tables import build_float
from hystgen.compensator.layout import FixedTables, Tables


def build(
    cascade: StaticModel,
    arithmetic: str = "float64",
    engine: str = "corners",
    clamp: bool = True,
    lsb: tuple[float | None, float | None] = (None, None),
    inverse: bool = True,
    visited: Sequence[float] = (),
) -> Tables | FixedTables:
    """Tables of `cascade` in 'float32', 'float64', 'q31' or 'q15' for engine 'corners' or 'loop'.

    Without `clamp` the drive and output limits are those of the (float) arithmetic, and without `inverse` too the
    stages are not cut to where they can be inverted; `lsb` are the physical units of a drive and an output code in
    fixed point; `visited` are inputs of the plays that they may see beyond the range, in floating point. Raises
    FormatError when the model does not fit the arithmetic.
    """
    if not ARITHMETICS[arithmetic].fixed:
        return build_float(cascade, arithmetic, engine, clamp, inverse, visited)
    return fixed_tables.build(cascade, arithmetic, engine, *lsb)[0]
