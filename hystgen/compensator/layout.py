"""The constants of one model in one arithmetic, as the bit-exact reference and the C text use them, and clamping."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

from hystgen.basics.jit import N, Scalar, inside, jit
from hystgen.chain.static import StaticModel
from hystgen.front.tanh.kernels import AtanhTables, TanhTables
from hystgen.plays.corners.corners_fixed import FixedMemory, new_fixed_memory
from hystgen.plays.corners.corners_float import Curve, Memory, Start, new_memory
from hystgen.plays.slots import Counts, LimitTable, Reals


class Tables(NamedTuple):
    """The constants of one model in one arithmetic; arrays of the real type unless said otherwise."""

    threshold: Reals  # n + 1
    weight: Reals  # n + 1
    slope: Reals  # n + 2
    lift: Reals  # n + 2
    start_level: Reals  # n + 1
    inverse_slope: Reals  # n + 2
    start: Reals  # n + 1 plays, or 1 if all start at the same value
    limits: LimitTable
    applied: Reals  # drive before the first move: 2 * inverse + (0 after init, 1 after reset)
    ascending: Counts  # direction before the first move, in the order of `applied`
    stage_kind: Counts  # TANH or DEAD_ZONE, in order from the drive
    stage_first: Counts  # index in stage_data of the stage's first number
    stage_size: Counts  # break points of a dead zone
    stage_data: Reals
    forward: Curve  # this and the next six: only in the corner engine
    inverse: Curve
    forward_first: Start
    forward_zero: Start
    inverse_first: Start
    inverse_zero: Start
    begin: Reals  # input of the plays before the first move, in the order of `applied`
    engine: int
    branches: int  # 1 if the ascending and descending branches differ
    tanh: TanhTables
    atanh: AtanhTables

    @property
    def fixed(self) -> bool:
        """Whether the arithmetic is fixed point."""
        return False

    @property
    def has_front(self) -> bool:
        """Whether there is a memoryless part."""
        return len(self.stage_kind) > 0

    def new_corners(self) -> Memory:
        """Memory for one instance in the corner engine; its `init` operation sets the values."""
        return new_memory(len(self.threshold) - 1, self.threshold.dtype)


class FixedTables(NamedTuple):
    """The constants of one model in fixed point; arrays of int64, even where the C type is narrower."""

    threshold: Reals
    weight: Reals
    slope: Reals  # change of the sum per smallest step of the plays' input
    start_level: Reals
    way: Reals  # 2 threshold: input gained since a corner when play k begins to follow; the last entry is never reached
    reach: Reals  # 2 start_level: output gained by then
    reciprocal: Reals  # 2^(32 + shift) / slope
    shift: Reals
    start: Reals
    zero: Reals  # all plays 0
    limits: LimitTable
    applied: Reals  # drive before the first move: 2 * inverse + (0 after init, 1 after reset)
    ascending: Reals  # direction before the first move, in the order of `applied`
    knot: Reals  # first argument of each piece, curve after curve
    coefficient: Reals  # coefficients of each piece, curve after curve
    scale: Reals  # left shift that stretches a piece to 2^31
    first: Reals  # first piece of each curve
    pieces: Reals
    domain: Reals  # (4, 2): first and last argument of each curve
    edge: Reals  # (4, 2): largest distance of a rounded argument from that domain
    argument: Reals  # (4, 2): smallest and largest argument of the envelopes themselves
    below: Reals  # (4,): bits of a curve's value below a code
    engine: int
    branches: int
    fronts: int

    @property
    def fixed(self) -> bool:
        """Whether the arithmetic is fixed point."""
        return True

    @property
    def has_front(self) -> bool:
        """Whether there is a memoryless part."""
        return self.fronts > 0

    def new_corners(self) -> FixedMemory:
        """Memory for one instance in the corner engine; its `init` operation sets the values."""
        return new_fixed_memory(len(self.threshold) - 1, self.threshold.dtype)


# ---------------------------------------------------------------- clamp.c


class Limited(Protocol):
    """The limits of drive and output, which all tables have."""

    @property
    def limits(self) -> LimitTable: ...


@jit(inline=True)
def clamp_drive(t: Limited, v: N) -> N:
    """v limited to the input range."""
    return inside(v, t.limits.drive.low[0], t.limits.drive.high[0])


@jit(inline=True)
def inverse_clamp(t: Limited, u: N) -> N:
    """u limited to the output range."""
    return inside(u, t.limits.output.low[0], t.limits.output.high[0])


# ---------------------------------------------------------------- before the first move


def first_moves(
    cascade: StaticModel, limits: tuple[Scalar, Scalar], not_above: Callable[[float], tuple[Scalar, bool]],
    nearest: Callable[[float], Scalar],
) -> tuple[list[Scalar], list[int]]:
    """Drive and direction before the first move, for `Tables.applied` and `Tables.ascending`, within `limits`.

    `not_above` gives the largest number of the type that does not exceed a drive, and whether the two are equal. The
    forward operator has to know in which direction the actuator moves from the drive of the start memory, even if that
    drive is not a number of the type or lies beyond the limits. Seen from the number below it, every move has its true
    direction, provided that staying counts as descending. The inverse starts at the nearest number, and may stay there.
    """
    low, high = limits
    applied: list[Scalar] = [0, 0, 0, 0]
    ascending = [1, 1, 1, 1]
    if cascade.start_is_defined:
        for j, w in enumerate((float(cascade.pi.start[0]), 0.0)):
            v = float(cascade.front_inverse(w))
            number, same = not_above(v)
            ascending[j] = int(number < low or (same and number <= high))
            applied[j] = min(max(number, low), high)
            ascending[2 + j] = int(nearest(v) <= high)
            applied[2 + j] = min(max(nearest(v), low), high)
    return applied, ascending
