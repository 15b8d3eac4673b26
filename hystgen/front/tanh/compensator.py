"""Tanh envelopes in floating point: `c_runtime/front/envelope.c`."""

from __future__ import annotations

from hystgen.basics.jit import Scalar, jit
from hystgen.front.stage import StageTables
from hystgen.front.tanh.kernels import atanh, tanh


@jit
def envelope_forward(t: StageTables, first: int, x: Scalar) -> Scalar:
    """a0 tanh(a1 x + a2) + a3."""
    d = t.stage_data
    return d[first] * tanh(d[first + 1] * x + d[first + 2], t.tanh) + d[first + 3]


@jit
def envelope_inverse(t: StageTables, first: int, y: Scalar) -> tuple[Scalar, int]:
    """(atanh((y - a3) / a0) - a2) / a1, and whether the argument had to be limited."""
    d = t.stage_data
    argument = (y - d[first + 3]) * d[first + 4]
    limited = 0
    if argument > d[first + 6]:
        argument = d[first + 6]
        limited = 1
    elif argument < -d[first + 6]:
        argument = -d[first + 6]
        limited = 1
    return (atanh(argument, t.atanh) - d[first + 2]) * d[first + 5], limited
