"""Movement and bending of plays in fixed point: the search, and the operators."""

from __future__ import annotations

from collections.abc import Callable

from hystgen.basics.jit import Answer, jit
from hystgen.compensator.chain.layout import FixedChainTables
from hystgen.compensator.chain.moving_plays import Kind, operators, unmoved
from hystgen.compensator.chain.parts import BENDS, ELEMENTS, MOVES
from hystgen.compensator.chain.step import ChainState
from hystgen.effects.plays import FASTEST, PLAIN, SECANTS, STRAIGHT, FixedMovingTables
from hystgen.plays.fixed import loop_solve, nearest, quotient
from hystgen.plays.slots import Reals


@jit(inline=True)
def size(x: int) -> int:
    """The magnitude of x."""
    return -x if x < 0 else x


@jit
def input_after(m: FixedMovingTables, w: int, left: int, rate: int) -> int:
    """The input at which the sum has changed by `left`, going from w at a rate: at least one on, at most `farthest`."""
    room = m.farthest - w if left > 0 else m.farthest + w
    more = size(left)
    step = (more >> 32) * rate + (((more & 0xFFFFFFFF) * rate) >> 32)
    step = min(max((step + ((1 << (m.rate_bits - 32)) >> 1)) >> (m.rate_bits - 32), 1), room)
    return w + step if left > 0 else w - step


@jit
def rate_of(m: FixedMovingTables, way: int, gained: int) -> int:
    """The rate of an input that has gone `way` while the sum has gained this."""
    return min(max(quotient(way, max(gained, 1), m.rate_bits), 1), FASTEST)


@jit
def smooth(m: FixedMovingTables) -> bool:
    """Whether plays that are not bent are summed up with elements in parallel."""
    return m.moves == PLAIN and m.bends == STRAIGHT and len(m.elements.element) > 0


def search(
    sum_at: Callable[..., int], _: object, alike: Callable[..., bool], slope_at: Callable[..., int]
) -> Answer:
    """The search of `moving_search.c`, from the function that gives the sum of the plays at an input."""

    @jit
    def searched(t: FixedChainTables, s: ChainState, h: int) -> int:
        """Input of the plays at which their sum is h: secant steps from the present input, the first with the last rate
        of the previous sample, within the interval that remains, then bisection. Returns the better of two adjacent
        inputs, or one beyond the farthest if even the farthest is not enough."""
        m = t.moving
        low = -m.farthest - 1
        high = m.farthest + 1
        short = 0  # shortfall of the sum at `low`; the first ends lie beyond all inputs: not tried, but may be returned
        over = -1  # excess of the sum at `high`
        w = s.plays.play[0]
        before = w
        last = h
        tries = 0
        while True:
            total = sum_at(t, s, w)
            left = h - total
            if left > 0:
                low = w
                short = left
            else:
                high = w
                over = -left
            if size(left) <= m.near:
                return w
            if high - low == 1:
                return high if short > over else low
            way = size(w - before)
            if smooth(m):
                if tries < SECANTS and (tries > 0 or s.elements.steep[0] < 0):
                    slope = slope_at(t, s, w)
                    if slope != s.elements.steep[0]:
                        s.elements.steep[0] = slope
                        s.search.rate[0] = rate_of(m, 1, slope)
                    to = input_after(m, w, left, s.search.rate[0])
                    on = size(to - s.elements.found[0])
                    if not s.elements.departs[0] and on <= m.elements.straight and alike(t, s, w, to):
                        return to if size(left - slope * (to - w)) < size(left) else w
            elif tries < SECANTS and way > 0:
                s.search.rate[0] = rate_of(m, way, size(total - last))
            before = w
            last = total
            if tries < SECANTS:
                w = input_after(m, w, left, s.search.rate[0])
            if w <= low or w >= high:  # outside the interval, or the end that was just tried
                w = low + (high - low) // 2
            tries += 1

    return searched


@jit
def level(t: FixedChainTables, total: int) -> int:
    """A sum of the plays, which has bits below a signal's, as a signal."""
    return nearest(total, t.number.level_drop[0])


@jit
def asked(t: FixedChainTables, h: int) -> int:
    """The sum of the plays that a signal asks for, limited to their range."""
    most = t.number.largest_level[0]
    return min(max(h, -most), most) << t.number.level_drop[0]


@jit(inline=True)
def begin(s: ChainState, _: Reals) -> None:
    """Set the rate with which the first search begins: the largest."""
    s.search.rate[0] = FASTEST
    s.elements.steep[0] = 0


@jit(inline=True)
def found(m: FixedMovingTables, s: ChainState, w: int) -> bool:  # noqa: ARG001  as in floating point
    """False: a sum is exact, so that it does not matter where it was computed."""
    return False


@jit(inline=True)
def turned(t: FixedChainTables, s: ChainState) -> None:  # noqa: ARG001  as in floating point
    """A search begins with the rate right after the turn."""
    s.elements.steep[0] = -1


@jit(inline=True)
def ordered(_: FixedMovingTables) -> bool:
    """Whether a sum assumes that plays behind the first stationary one are stationary too: no, each is checked."""
    return False


KIND = Kind(
    level, asked, loop_solve, MOVES.coded(), BENDS.coded(), ELEMENTS.coded(), search, begin, found, turned, ordered
)
PLAYS = operators(KIND)
UNMOVED = unmoved(KIND)
