"""The constants of a model's kernels in one arithmetic.

The bit-exact reference and the C text both take an operator's constants from here.
"""

from __future__ import annotations

from collections.abc import Sequence

from hystgen.arithmetic import ARITHMETICS
from hystgen.chain.static import StaticModel
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

    Without `clamp`, only the (float) arithmetic limits drive and output; without `inverse` as well, the stages are not
    cut to their invertible part. `lsb`: physical units per drive code and per output code in fixed point; `visited`:
    in floating point, inputs beyond the range that the plays may see. Raises FormatError if the model does not fit the
    arithmetic.
    """
    if not ARITHMETICS[arithmetic].fixed:
        return build_float(cascade, arithmetic, engine, clamp, inverse, visited)
    from hystgen.compensator import fixed_tables  # late: fractions are slow to import

    return fixed_tables.build(cascade, arithmetic, engine, *lsb)[0]
