"""Dead zones in floating point: `c_runtime/front/dead_zones.c`."""

from __future__ import annotations

from hystgen.basics.jit import Scalar, jit
from hystgen.front.stage import StageTables


@jit
def dead_zone(t: StageTables, first: int, n: int, x: Scalar, inverse: int) -> Scalar:
    """Evaluate the linear piece that contains x; the inverse uses the forward map's tables, swapped."""
    d = t.stage_data
    breaks = first + n * inverse
    anchor_in = first + 2 * n + (n + 1) * inverse
    anchor_out = first + 2 * n + (n + 1) * (1 - inverse)
    slope = first + 2 * n + 2 * (n + 1) + (n + 1) * inverse
    low = 0
    high = n
    while low < high:
        middle = (low + high) // 2
        if x >= d[breaks + middle]:
            low = middle + 1
        else:
            high = middle
    return d[anchor_out + low] + (x - d[anchor_in + low]) * d[slope + low]
