"""The bit reference: the emitted C, operation for operation, in Python.

Every function has its counterpart in `c_runtime/` or in the step template, mostly of the same name, and computes the
same operations in the same order in the same arithmetic, so that results are compared for equal bits. Two kinds of
liberty are taken, neither of which changes a number: `multiple` multiplies by a whole number of thresholds where the C
adds or leaves out (both exact), and `corners_find` is one function for inputs and outputs, which the C has twice
because their types differ (`find_by_input`, `find_by_output`). The C's fast steps have no counterpart: they give what
`inverse_step` gives, which verification shows.

The functions know nothing of numpy's or numba's types: they run as plain Python on scalars of the arrays they are
given, or compiled (see `hystgen.compiled`). Real constants come out of arrays because a literal would not have the
arithmetic's type.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from hystgen.corners.memory import Curve, Start
from hystgen.kernels import AtanhTables, TanhTables, atanh, tanh

Reals = NDArray[Any]
Counts = NDArray[np.int64]
Bytes = NDArray[np.uint8]

# arithmetic-independent names for places in the arrays below
DRIVE_MIN, DRIVE_MAX, OUTPUT_MIN, OUTPUT_MAX, OFFSET = 0, 1, 2, 3, 4
HOLD, REAL_MAX, ZERO, HALF = 7, 8, 9, 10
MULTIPLE = 13  # there and two places to either side: -2, -1, 0, 1, 2

CORNERS, LOOP = 0, 1
TANH, DEAD_ZONE = 0, 1

W, ANCHOR, ANCHOR_OUTPUT, NEXT, NEXT_OUTPUT, HINT_ANCHOR, HINT_ANCHOR_OUTPUT = 0, 1, 2, 3, 4, 5, 6
PENDING, APPLIED, REFERENCE, LEVEL, ANSWER = 7, 8, 9, 10, 11
K, DEPTH, RISING, ASCENDING, HAS_PENDING, REPEAT, STEPPED, BITS, STATUS = 0, 1, 2, 3, 4, 5, 6, 7, 8
HINT_K, HINT_DEPTH, HINT_RISING, START, TOLD = 9, 10, 11, 12, 13

INPUT_CLAMPED, OUTPUT_CLAMPED, HELD, DOMAIN = 1, 2, 4, 8

OP_STEP, OP_COMMIT, OP_RESET, OP_INIT = 0, 1, 2, 3


class Tables(NamedTuple):
    """The constants of one model in one arithmetic; arrays of the real type unless said otherwise."""

    threshold: Reals  # n + 1
    weight: Reals  # n + 1
    slope: Reals  # n + 2
    lift: Reals  # n + 2
    start_level: Reals  # n + 1
    inverse_slope: Reals  # n + 2
    start: Reals  # n + 1 plays, or 1 where all start at the same value
    limits: Reals  # DRIVE_MIN .. MULTIPLE and two
    applied: Reals  # drive before the first move: 2 * inverse + (0 after init, 1 after reset)
    ascending: Counts  # direction before the first move, likewise
    stage_kind: Counts  # TANH or DEAD_ZONE, in order from the drive
    stage_first: Counts  # where the stage's numbers begin in stage_data
    stage_size: Counts  # break points of a dead zone
    stage_data: Reals
    forward: Curve  # of the corner engine, as what follows
    inverse: Curve
    forward_first: Start
    forward_zero: Start
    inverse_first: Start
    inverse_zero: Start
    begin: Reals  # input of the plays before the first move, as `applied`
    engine: int
    branches: int  # 1 where an ascending and a descending branch differ
    tanh: TanhTables
    atanh: AtanhTables


class PlayTables(Protocol):
    """What memory and plays need of a model's constants, in any arithmetic."""

    @property
    def threshold(self) -> Reals: ...
    @property
    def weight(self) -> Reals: ...
    @property
    def slope(self) -> Reals: ...
    @property
    def lift(self) -> Reals: ...
    @property
    def start_level(self) -> Reals: ...
    @property
    def limits(self) -> Reals: ...


class State(NamedTuple):
    """One instance: plain arrays."""

    real: Reals
    counts: Counts
    extremum: Reals
    output: Reals
    end: Counts
    side: Counts
    play: Reals


def new_state(t: PlayTables) -> State:
    """Memory for one instance of the model; `init` gives it its values."""
    n = len(t.threshold) - 1
    dtype = t.threshold.dtype
    return State(
        real=np.zeros(12, dtype),
        counts=np.zeros(14, np.int64),
        extremum=np.zeros(max(n, 1), dtype),
        output=np.zeros(max(n, 1), dtype),
        end=np.zeros(max(n, 1), np.int64),
        side=np.zeros(max(n, 1), np.int64),
        play=np.zeros(n + 1, dtype),
    )


# ---------------------------------------------------------------- corners_absorb.c


def multiple(t: PlayTables, s: State, c: int, rising: int) -> Any:
    """Thresholds, with sign, between a corner and where the plays that it holds start to follow: two after a turn,
    one from the start, none where the move leads back to where the corner was. A number to multiply by, which is
    exact, because what the C decides by branches would mostly be guessed wrong here."""
    return t.limits[MULTIPLE - 1 + s.side[c] + 2 * rising]


def activation(t: PlayTables, s: State, c: int, r: Any, rising: int) -> Any:
    """Input at which a play of threshold r, held by corner c, starts to follow."""
    return s.extremum[c] + multiple(t, s, c, rising) * r


def level(t: PlayTables, s: State, c: int, k: int, rising: int) -> Any:
    """Output at the moment that play k, held by corner c, starts to follow."""
    return s.output[c] + multiple(t, s, c, rising) * t.start_level[k]


def past(x: Any, level: Any, rising: int) -> bool:
    """Whether a move has come farther than `level`."""
    if rising:
        return bool(x > level)
    return bool(x < level)


def all_follow(t: PlayTables, rising: int) -> Any:
    """Output at w = 0 where every play follows."""
    lift = t.lift[len(t.lift) - 1]
    return -lift if rising else lift


def reached(x: Any, level: Any, rising: int) -> bool:
    """Whether a move has come as far as `level`."""
    if rising:
        return bool(x >= level)
    return bool(x <= level)


def corners_settle(t: PlayTables, s: State) -> None:
    """Bring anchor and next up to date after k, depth or the direction have changed."""
    k = s.counts[K]
    rising = s.counts[RISING]
    c = s.counts[DEPTH] - 1
    if c >= 0:
        s.real[ANCHOR] = activation(t, s, c, t.threshold[k - 1], rising)
        s.real[ANCHOR_OUTPUT] = level(t, s, c, k - 1, rising)
        s.real[NEXT] = activation(t, s, c, t.threshold[k], rising)
        s.real[NEXT_OUTPUT] = level(t, s, c, k, rising)
    else:
        s.real[ANCHOR] = t.limits[ZERO]
        s.real[ANCHOR_OUTPUT] = all_follow(t, rising)
        s.real[NEXT] = t.limits[REAL_MAX] if rising else -t.limits[REAL_MAX]
        s.real[NEXT_OUTPUT] = s.real[NEXT]


def half(t: PlayTables, x: Any) -> Any:
    """x / 2."""
    return x * t.limits[HALF]


def way(t: PlayTables, x: Any, since: Any, side: int, rising: int) -> Any:
    """How far x lies from what a corner holds, in the measure of the thresholds."""
    d = x - since if rising else since - x
    if side == 0:
        return d
    return half(t, d)


def not_reached(steps: Reals, k: int, high: int, x: Any) -> int:
    """First of the rising steps k .. high-1 that x has not reached, or high; mostly it is one of the first two."""
    if k < high and x >= steps[k]:
        k += 1
        if k < high and x >= steps[k]:
            k += 1
            while k < high:
                middle = (k + high) // 2
                if x >= steps[middle]:
                    k = middle + 1
                else:
                    high = middle
    return k


def opposite(side: int, rising: int) -> bool:
    """Whether a corner lets go of its plays one by one, and not all of them at its extremum."""
    return side >= 0 if rising else side <= 0


def corners_left(
    t: PlayTables, s: State, low: int, depth: int, rising: int, x: Any, held: Reals, steps: Reals
) -> int:
    """Corners from `low` on that are left of `depth` after a move to x, by bisection."""
    left = depth
    while low < left:
        c = (low + left) // 2
        if reached(x, held[c] + multiple(t, s, c, rising) * steps[s.end[c] - 1], rising):
            left = c
        else:
            low = c + 1
    return left


def corners_find(
    t: PlayTables, s: State, start: int, depth: int, k: int, rising: int, x: Any, held: Reals, steps: Reals
) -> tuple[int, int]:
    """Corners that a move to x leaves of `depth`, and the plays that follow then; plays 0 .. k-1 are known to.

    `held` and `steps` are the corners' extrema and the thresholds where x is an input of the plays, their outputs and
    the start levels where x is an output. First the blocks that are passed whole, those above the `start` corners of
    the start before these, then the plays of one block; the lowest corner of the start is passed with its last play.
    """
    left = corners_left(t, s, start, depth, rising, x, held, steps)
    if left <= start:
        left = corners_left(t, s, min(start, 1), left, rising, x, held, steps)
    if left < depth:
        k = s.end[left]
    c = left - 1
    if left > 0 and opposite(s.side[c], rising):
        last = left == 1 and start > 0
        k = not_reached(steps, k, s.end[c] if last else s.end[c] - 1, way(t, x, held[c], s.side[c], rising))
        if last and k == s.end[c]:
            left = 0
    return left, k


def entered_by(s: State, left: int, depth: int, k: int) -> int:
    """Corner that held play k-1 until it followed, when a move has left `left` of `depth` corners and k > 1."""
    if left == 0 or (left < depth and s.end[left] == k):
        return left
    return left - 1


def foretold(t: PlayTables, s: State, depth: int, rising: int, w: Any) -> bool:
    """Whether a move to w, which `depth` corners stand before, ends in the place that word was left of."""
    k = s.counts[HINT_K]
    left = s.counts[HINT_DEPTH]
    if k > 0 and s.counts[TOLD]:
        return True
    if k == 0 or rising != s.counts[HINT_RISING]:
        return False
    if left > 0 and past(w, activation(t, s, left - 1, t.threshold[k], rising), rising):
        return False
    if k == 1:
        return True
    owner = entered_by(s, left, depth, k)
    return reached(w, activation(t, s, owner, t.threshold[k - 1], rising), rising)


def corners_rest(t: PlayTables, s: State, w: Any) -> None:
    """Memory at rest: every play holds w."""
    n = len(t.threshold) - 1
    s.real[W] = w
    s.counts[K] = 1
    s.counts[DEPTH] = 0
    s.counts[RISING] = 1
    s.counts[HINT_K] = 0
    s.counts[TOLD] = 0
    s.counts[START] = 0
    if n > 0:
        s.counts[START] = 1
        s.extremum[0] = w
        s.output[0] = w * t.slope[n + 1]
        s.end[0] = n + 1
        s.side[0] = 0
        s.counts[DEPTH] = 1
    corners_settle(t, s)


def corners_start(t: PlayTables, s: State, play: Reals) -> None:
    """Memory with a state of its own for each play: one corner a play."""
    n = len(t.threshold) - 1
    above = t.limits[ZERO]
    s.real[W] = play[0]
    s.counts[K] = 1
    s.counts[DEPTH] = n
    s.counts[RISING] = 1
    s.counts[HINT_K] = 0
    s.counts[TOLD] = 0
    s.counts[START] = n
    for j in range(n):
        s.extremum[j] = play[n - j]
        s.output[j] = play[n - j] * t.slope[n - j + 1] + above
        above = above + play[n - j] * (t.slope[n - j + 1] - t.slope[n - j])
        s.end[j] = n - j + 1
        s.side[j] = 0
    corners_settle(t, s)


def corners_output(t: PlayTables, s: State) -> Any:
    """Output of the play sum for the memory as it is."""
    return s.real[ANCHOR_OUTPUT] + (s.real[W] - s.real[ANCHOR]) * t.slope[s.counts[K]]


def push_corner(t: PlayTables, s: State, c: int) -> None:
    """Write the corner that turning back leaves into slot c, above those that are held."""
    if s.counts[START] > c:
        s.counts[START] = c
    s.extremum[c] = s.real[W]
    s.output[c] = corners_output(t, s)
    s.end[c] = s.counts[K]
    if s.counts[RISING]:
        s.side[c] = -1
    else:
        s.side[c] = 1


def turns(s: State, w: Any) -> bool:
    """Whether a move to w turns back."""
    if s.counts[RISING]:
        return bool(w < s.real[W])
    return bool(w > s.real[W])


def corners_absorb(t: PlayTables, s: State, w: Any) -> None:
    """Move the input of the plays to w."""
    turned = turns(s, w)
    if turned:
        if s.counts[K] > 1:
            push_corner(t, s, s.counts[DEPTH])
            s.counts[DEPTH] += 1
        s.counts[RISING] = 1 - s.counts[RISING]
        s.counts[K] = 1
    s.real[W] = w
    if foretold(t, s, s.counts[DEPTH], s.counts[RISING], w):
        s.counts[DEPTH] = s.counts[HINT_DEPTH]
        s.counts[K] = s.counts[HINT_K]
        corners_settle(t, s)
        s.real[ANCHOR] = s.real[HINT_ANCHOR]
        s.real[ANCHOR_OUTPUT] = s.real[HINT_ANCHOR_OUTPUT]
        if past(w, s.real[NEXT], s.counts[RISING]):  # at a limit, by rounding
            s.real[NEXT] = w
    else:
        if turned:
            corners_settle(t, s)
        if past(w, s.real[NEXT], s.counts[RISING]):  # right there the next play does not move yet
            left, k = corners_find(
                t, s, 0, s.counts[DEPTH], s.counts[K] + 1, s.counts[RISING], w, s.extremum, t.threshold
            )
            s.counts[DEPTH] = left
            s.counts[K] = k
            corners_settle(t, s)
    s.counts[HINT_K] = 0
    s.counts[TOLD] = 0


def hint(t: PlayTables, s: State, left: int, k: int, rising: int) -> None:
    """Leave word of the place where a move ends."""
    s.counts[HINT_K] = k
    s.counts[HINT_DEPTH] = left
    s.counts[HINT_RISING] = rising
    if left > 0:
        s.real[HINT_ANCHOR] = activation(t, s, left - 1, t.threshold[k - 1], rising)
        s.real[HINT_ANCHOR_OUTPUT] = level(t, s, left - 1, k - 1, rising)
    else:
        s.real[HINT_ANCHOR] = t.limits[ZERO]
        s.real[HINT_ANCHOR_OUTPUT] = all_follow(t, rising)


def corners_foretell(t: PlayTables, s: State, w: Any) -> None:
    """Leave word of the place where a move to w ends, unless that which was left holds for it too; moves nothing."""
    depth = s.counts[DEPTH]
    k = s.counts[K]
    rising = s.counts[RISING]
    turned = turns(s, w)
    if turned:
        if k > 1:
            push_corner(t, s, depth)
            depth = depth + 1
        k = 1
        rising = 1 - rising
    if foretold(t, s, depth, rising, w):
        return
    following = s.real[NEXT]
    if turned and depth > 0:
        following = activation(t, s, depth - 1, t.threshold[k], rising)
    if depth > 0 and past(w, following, rising):
        left, k = corners_find(t, s, 0, depth, k + 1, rising, w, s.extremum, t.threshold)
        hint(t, s, left, k, rising)
    elif turned:
        hint(t, s, depth, k, rising)
    else:
        s.counts[HINT_K] = 0  # a move that goes on as it was


# ---------------------------------------------------------------- loop_absorb.c, loop_solve.c


def loop_rest(s: State, w: Any) -> None:
    """Every play holds w."""
    for i in range(len(s.play)):
        s.play[i] = w


def loop_start(s: State, start: Reals) -> None:
    """Each play holds its own start value."""
    for i in range(len(s.play)):
        s.play[i] = start[i]


def loop_absorb(t: PlayTables, s: State, w: Any) -> None:
    """play_r[w] = max(w - r, min(w + r, play)), play by play."""
    for i in range(len(s.play)):
        low = w - t.threshold[i]
        high = w + t.threshold[i]
        upper = s.play[i]
        if upper > high:
            upper = high
        if upper < low:
            upper = low
        s.play[i] = upper


def loop_output(t: PlayTables, s: State) -> Any:
    """p_0 play_0 + p_1 play_1 + ..., in this order."""
    total = t.limits[ZERO]
    for i in range(len(s.play)):
        total = total + t.weight[i] * s.play[i]
    return total


def loop_solve(t: Tables, s: State, output: Any) -> Any:
    """Input of the plays that gives `output`, letting go of the largest thresholds one by one."""
    rising = output >= loop_output(t, s)
    tail = t.limits[ZERO]
    next_follows = t.limits[ZERO]
    for last in range(len(s.play) - 1, -1, -1):
        k = last + 1
        if rising:
            first = s.play[last] + t.threshold[last]
            w = (output - (tail - t.lift[k])) * t.inverse_slope[k]
        else:
            first = s.play[last] - t.threshold[last]
            w = (output - (tail + t.lift[k])) * t.inverse_slope[k]
        if reached(w, first, rising):
            if k < len(s.play) and past(w, next_follows, rising):
                return next_follows
            return w
        tail = tail + t.weight[last] * s.play[last]
        next_follows = first
    return s.play[0]


# ---------------------------------------------------------------- envelope_*.c, dead_zone_*.c


def envelope_forward(t: Tables, first: int, x: Any) -> Any:
    """a0 tanh(a1 x + a2) + a3."""
    d = t.stage_data
    return d[first] * tanh(d[first + 1] * x + d[first + 2], t.tanh) + d[first + 3]


def envelope_inverse(t: Tables, first: int, y: Any) -> tuple[Any, int]:
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


def dead_zone(t: Tables, first: int, n: int, x: Any, inverse: int) -> Any:
    """Follow the straight piece that x lies on; the tables of the inverse are those of the forward map swapped."""
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


def front_forward(t: Tables, v: Any, ascending: int) -> Any:
    """w = G[v] on one branch, stage by stage from the drive."""
    w = v
    for j in range(len(t.stage_kind)):
        first = t.stage_first[j]
        if t.stage_kind[j] == DEAD_ZONE:
            w = dead_zone(t, first, t.stage_size[j], w, 0)
        elif ascending:
            w = envelope_forward(t, first, w)
        else:
            w = envelope_forward(t, first + 7, w)
    return w


def front_inverse(t: Tables, w: Any, ascending: int) -> tuple[Any, int]:
    """v = G^-1[w] on one branch, stages in reverse order, and whether an envelope's argument was limited."""
    v = w
    limited = 0
    for j in range(len(t.stage_kind) - 1, -1, -1):
        first = t.stage_first[j]
        if t.stage_kind[j] == DEAD_ZONE:
            v = dead_zone(t, first, t.stage_size[j], v, 1)
        else:
            if not ascending:
                first = first + 7
            v, one = envelope_inverse(t, first, v)
            limited = limited | one
    return v, limited


# ---------------------------------------------------------------- the step template


def rest(t: Tables, s: State, w: Any) -> None:
    """All plays at w."""
    if t.engine == CORNERS:
        corners_rest(t, s, w)
    else:
        loop_rest(s, w)


def absorb(t: Tables, s: State, w: Any) -> None:
    """The plays see w."""
    if t.engine == CORNERS:
        corners_absorb(t, s, w)
    else:
        loop_absorb(t, s, w)


def output(t: Tables, s: State) -> Any:
    """Output for the memory as it is, offset included."""
    if t.engine == CORNERS:
        return corners_output(t, s) + t.limits[OFFSET]
    return loop_output(t, s) + t.limits[OFFSET]


def solve(t: Tables, s: State, u: Any) -> Any:
    """Input of the plays that gives u, offset included."""
    return loop_solve(t, s, u - t.limits[OFFSET])


def begin(t: Tables, s: State, which: int) -> None:
    """What init and reset have in common once the plays are set; `which` as in `Tables.applied`."""
    applied = t.applied[which]
    s.counts[ASCENDING] = t.ascending[which]
    s.counts[HAS_PENDING] = 0
    s.counts[REPEAT] = 0
    s.counts[STEPPED] = 0
    s.counts[BITS] = 0
    s.real[PENDING] = applied
    s.real[APPLIED] = applied
    s.real[LEVEL] = output(t, s)
    s.counts[STATUS] = 0
    s.real[REFERENCE] = s.real[LEVEL]
    s.real[ANSWER] = s.real[LEVEL]


def init(t: Tables, s: State, inverse: int) -> None:
    """Start memory of the parameter file."""
    if len(t.start) == 1:
        rest(t, s, t.start[0])
    elif t.engine == CORNERS:
        corners_start(t, s, t.start)
    else:
        loop_start(s, t.start)
    begin(t, s, 2 * inverse)


def see_drive(t: Tables, s: State, v: Any) -> None:
    """The actuator sees drive v: its own move picks the branch."""
    if t.branches:
        if v > s.real[APPLIED]:
            s.counts[ASCENDING] = 1
        elif v < s.real[APPLIED]:
            s.counts[ASCENDING] = 0
    s.real[APPLIED] = v
    absorb(t, s, front_forward(t, v, s.counts[ASCENDING]))


def foretell(t: Tables, s: State, v: Any) -> None:
    """Look up what drive v does to the plays before it has done so."""
    if t.engine == CORNERS:
        ascending = s.counts[ASCENDING]
        if t.branches and v != s.real[APPLIED]:
            ascending = 1 if v > s.real[APPLIED] else 0
        corners_foretell(t, s, front_forward(t, v, ascending))


def finite(t: Tables, x: Any) -> bool:
    """Neither NaN nor infinite."""
    return bool(-t.limits[REAL_MAX] <= x <= t.limits[REAL_MAX])


def forward_step(t: Tables, s: State, v: Any) -> Any:
    """One sample of the forward operator."""
    if not finite(t, v):
        s.counts[STATUS] |= HELD
        return s.real[ANSWER]
    if v < t.limits[DRIVE_MIN]:
        v = t.limits[DRIVE_MIN]
        s.counts[STATUS] |= INPUT_CLAMPED
    elif v > t.limits[DRIVE_MAX]:
        v = t.limits[DRIVE_MAX]
        s.counts[STATUS] |= INPUT_CLAMPED
    see_drive(t, s, v)
    s.real[ANSWER] = output(t, s)
    return s.real[ANSWER]


def answer(s: State, v: Any) -> Any:
    """Leave drive v pending and return it."""
    s.real[ANSWER] = v
    s.real[PENDING] = v
    s.counts[HAS_PENDING] = 1
    s.counts[STEPPED] = 1
    return v


def clamp_drive(t: Tables, v: Any) -> Any:
    """v inside the input range."""
    if v < t.limits[DRIVE_MIN]:
        return t.limits[DRIVE_MIN]
    if v > t.limits[DRIVE_MAX]:
        return t.limits[DRIVE_MAX]
    return v


def fits(s: State, v: Any, ascending: int) -> bool:
    """Whether going to v is a move of the branch that v was computed on."""
    if v == s.real[APPLIED]:
        return bool(s.counts[ASCENDING] == ascending)
    return bool((v > s.real[APPLIED]) == (ascending != 0))


def choose_branch(t: Tables, s: State, u: Any, w: Any) -> tuple[Any, int]:
    """The drive on the branch of its own move: that of u's move first, the other one next, else no move."""
    up = s.counts[ASCENDING]
    if u > s.real[LEVEL]:
        up = 1
    elif u < s.real[LEVEL]:
        up = 0
    v, limited = front_inverse(t, w, up)
    if fits(s, clamp_drive(t, v), up):
        return v, limited
    back = clamp_drive(t, v) - s.real[APPLIED]
    if up == s.counts[ASCENDING] and -t.limits[HOLD] <= back <= t.limits[HOLD]:
        return s.real[APPLIED], limited
    v, limited = front_inverse(t, w, 1 - up)
    if fits(s, clamp_drive(t, v), 1 - up):
        return v, limited
    return s.real[APPLIED], limited


def tells_limit(t: Tables, s: State, v: Any, inside: Any) -> bool:
    """Whether the place that was found for drive v, which is beyond the limit `inside`, is that of the limit too.

    It is not where the limit lies behind, or where the drive is at the limit already and moves no more.
    """
    return len(t.stage_kind) == 0 and past(inside, s.real[W], v > inside)


def inverse_step(t: Tables, s: State, u: Any) -> Any:
    """One sample of the inverse operator."""
    if s.counts[HAS_PENDING]:
        see_drive(t, s, s.real[PENDING])
        s.counts[HAS_PENDING] = 0
    if not finite(t, u):
        s.counts[STATUS] |= HELD
        v = s.real[ANSWER] if s.counts[STEPPED] else s.real[APPLIED]
        foretell(t, s, v)
        return answer(s, v)
    if s.counts[REPEAT] and u == s.real[REFERENCE]:
        s.counts[STATUS] |= s.counts[BITS]
        return answer(s, s.real[ANSWER])
    bits = 0
    s.real[REFERENCE] = u
    s.counts[REPEAT] = 1
    if u < t.limits[OUTPUT_MIN]:
        u = t.limits[OUTPUT_MIN]
        bits = bits | INPUT_CLAMPED
    elif u > t.limits[OUTPUT_MAX]:
        u = t.limits[OUTPUT_MAX]
        bits = bits | INPUT_CLAMPED
    w = solve(t, s, u)
    if t.branches:
        v, limited = choose_branch(t, s, u, w)
    else:
        v, limited = front_inverse(t, w, 1)
    s.real[LEVEL] = u
    if limited:
        bits = bits | DOMAIN
    inside = clamp_drive(t, v)
    if inside != v:
        bits = bits | OUTPUT_CLAMPED
        if tells_limit(t, s, v, inside):
            s.counts[TOLD] = 1
        else:
            s.counts[HINT_K] = 0
    s.counts[BITS] = bits
    s.counts[STATUS] |= bits
    return answer(s, inside)


def inverse_commit(t: Tables, s: State, applied: Any) -> None:
    """What the drive really applied in place of the last answer."""
    if not finite(t, applied):
        s.counts[STATUS] |= HELD
        return
    v = clamp_drive(t, applied) + t.limits[ZERO]  # no drive is -0
    if v != applied:
        s.counts[STATUS] |= INPUT_CLAMPED
    if s.counts[TOLD]:  # where the limit leads says nothing of another drive
        s.counts[TOLD] = 0
        s.counts[HINT_K] = 0
    s.real[PENDING] = v
    s.counts[HAS_PENDING] = 1
    s.counts[REPEAT] = 0
    foretell(t, s, v)


def reset(t: Tables, s: State, inverse: int) -> None:
    """All plays 0, status cleared; the step that belongs to a reset is the caller's."""
    rest(t, s, t.limits[ZERO])
    begin(t, s, 2 * inverse + 1)


def run(t: Tables, s: State, inverse: int, op: Bytes, x: Reals, answers: Reals, status: Bytes) -> None:
    """Operations op[i] with argument x[i]; answers[i] is that of a step, else 0; status[i] is read and cleared."""
    for i in range(len(op)):
        if op[i] == OP_INIT:
            init(t, s, inverse)
        elif op[i] == OP_COMMIT:
            inverse_commit(t, s, x[i])
        else:
            if op[i] == OP_RESET:
                reset(t, s, inverse)
            if inverse:
                inverse_step(t, s, x[i])
            else:
                forward_step(t, s, x[i])
        answers[i] = s.real[ANSWER] if op[i] == OP_STEP else t.limits[ZERO]
        status[i] = s.counts[STATUS]
        s.counts[STATUS] = 0


def visit(t: Tables, s: State, inverse: int, v: Any) -> None:  # noqa: ARG001  the same call for every engine
    """Let the actuator be at drive v before the next sample."""
    see_drive(t, s, v)
    s.real[LEVEL] = output(t, s)


FRONT: list[Callable[..., Any]] = [envelope_forward, envelope_inverse, dead_zone, front_forward, front_inverse]

COMPILED: list[Callable[..., Any]] = [
    multiple, activation, level, past, all_follow, reached, corners_settle, half, way, not_reached, opposite,
    corners_left, corners_find, entered_by, foretold, corners_rest, corners_start, corners_output, push_corner,
    turns, corners_absorb, hint, corners_foretell, loop_rest, loop_start, loop_absorb, loop_output, loop_solve,
    envelope_forward, envelope_inverse, dead_zone, front_forward, front_inverse, rest, absorb, output, solve, begin,
    init, see_drive, foretell, finite, forward_step, answer, clamp_drive, fits, choose_branch, tells_limit,
    inverse_step, inverse_commit, reset, visit, run,
]  # fmt: skip  (callees before callers)

# What every sample goes through
INLINED: set[Callable[..., Any]] = {
    multiple, reached, corners_output, push_corner, corners_absorb, absorb, output, solve, see_drive,
    finite, forward_step, answer, clamp_drive,
}  # fmt: skip
