"""How far a compiled operator with effects can be from the model in double precision."""

from __future__ import annotations

import dataclasses
import math

from hystgen.compensator.bounds import ErrorBounds, error_bounds
from hystgen.compensator.chain.tables import Compiled


def chain_bounds(compiled: Compiled, arithmetic: str) -> ErrorBounds:
    """Bounds for `arithmetic` 'float32' or 'float64'."""
    static = dataclasses.replace(compiled.static, output_offset=0.0)
    found = error_bounds(static, arithmetic, "loop")
    return ErrorBounds(found.forward, min(found.inverse, math.inf), found.rounding)
