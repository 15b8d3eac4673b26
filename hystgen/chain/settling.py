"""How long the output takes to settle after a step of the drive."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.problems import percent
from hystgen.chain.chain import Chain
from hystgen.effects.base import Effect, Place, Run

Array = NDArray[np.float64]

EDGE = 1e-9
"""[s] Duration of the step itself, far below that of any amplifier or converter."""

HORIZON = 3600.0
"""[s] Duration of the computed step response: anything slower is creep."""

FOREVER = 1e15
"""[s] Time after which everything has come to rest; filters allow time steps of any length."""

A_DECADE = 8
"""[samples per decade of time] Initial density of samples, before refinement."""

CLOSE, FINE = 0.03, 3e-4
"""[fractions of the error and of the step] Limits on the output's deviation from a straight line between samples."""

GOLDEN = 0.381966011250105
"""[fraction of an interval] Point compared with the straight line; the middle may be whole periods from both ends."""

GRADED = 4.0
"""Largest ratio of an interval to its neighbour: an oscillation that happens to cross zero at the test point of one
interval is found in the next."""

NARROWEST = 1e-6
"""[fraction of the time since the step] Shorter intervals are not split, or the edge behind a delay would split on."""

MOST_SAMPLES = 2**18
"""Maximum number of samples of a response; a mode with a damping of 0.001 takes a third of it."""

MOSTLY = 0.5
"""[fraction of the settling time] An effect is the main reason if the response without it settles within this time."""


@dataclass(frozen=True)
class Settling:
    """Time after a step of the drive over its whole range until the output stays close to its final value.

    `within`: the tolerated error as a fraction of the output's final step; `error`: the same in output units; `up`,
    `down`: settling times in s after a step to the upper or lower end of the range, 0 if the output settles at once,
    inf if not within `followed` s; `because`: the effects responsible for the time; `left_out`: effects independent of
    the drive.
    """

    within: float
    error: float
    up: float
    down: float
    followed: float
    because: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()

    @property
    def seconds(self) -> float:
        """The longer of the two times, s."""
        return max(self.up, self.down)

    def content(self) -> dict[str, object]:
        """The fields for JSON; infinite times are None."""
        content = asdict(self)
        return content | {key: content[key] if math.isfinite(content[key]) else None for key in ("up", "down")}

    def sentence(self, unit: str | None = None) -> str:
        """A sentence with error, time and reason; `unit`: of the output."""
        close = f"within {percent(self.within, '.3g')} of a step over the drive range"
        close += f" ({self.error:.3g}{f' {unit}' if unit else ''})"
        without = f"; {' and '.join(self.left_out)} not counted" if self.left_out else ""
        why = " and ".join(self.because)
        if self.seconds == 0.0:
            reason = f"{why} moves it by less" if why else "no effect of the model takes time"
            return f"{close} at once: {reason}{without}"
        if math.isinf(self.seconds):
            return f"{close} not within {self.followed:.4g} s{f', because of {why}' if why else ''}{without}"
        each = f"{_time(self.up)} upwards, {_time(self.down)} downwards"
        alike = _time(self.up) == _time(self.down)
        because = f", mostly because of {why}" if why else ""
        return f"{close} after {_time(self.seconds) if alike else each}{because}{without}"


def _time(seconds: float) -> str:
    if seconds >= 1000.0:
        return f"{seconds:.0f} s"
    for size, unit in ((1.0, "s"), (1e-3, "ms"), (1e-6, "us")):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds * 1e9:.3g} ns"


def settling(chain: Chain, within: float) -> Settling:
    """Settling of a chain after a step over its input range, in both directions.

    Before the step, the drive has swept the range and come back, and everything is at rest. Effects that are added to
    the output, or that follow a column of the record, do not respond to the drive and are left out.
    """
    answering = [effect for effect in chain.effects if effect.place is not Place.ADDED and not effect.read]
    left_out = tuple(dict.fromkeys(effect.name for effect in chain.effects if effect not in answering))
    low, high = chain.cascade.input_range

    def both(effects: list[Effect]) -> tuple[_Answer, _Answer]:
        moved = Chain(chain.cascade, effects)
        return _Answer.of(moved, low, high, within), _Answer.of(moved, high, low, within)

    up, down = both(answering)
    names = tuple(dict.fromkeys(effect.name for effect in answering if effect.needs_time))
    seconds = max(up.seconds, down.seconds)
    because = names
    if len(names) > 1 and seconds > 0.0:
        left = {
            name: max(each.seconds for each in both([effect for effect in answering if effect.name != name]))
            for name in names
        }
        main = min(names, key=lambda name: left[name])
        if left[main] <= MOSTLY * seconds and math.isfinite(left[main]):
            because = (main,)
    return Settling(
        within, within * max(up.size, down.size), up.seconds, down.seconds, min(up.followed, down.followed), because,
        left_out,
    )


@dataclass(frozen=True)
class _Answer:
    """A step response: settling time in s, final size, and the time in s for which it was followed."""

    seconds: float
    size: float
    followed: float

    @classmethod
    def of(cls, chain: Chain, begin: float, end: float, within: float) -> _Answer:
        dead = sum(effect.dead_time for effect in chain.effects)
        times, left, size = _left(chain, begin, end, within, dead)
        outside = np.flatnonzero(np.abs(left) > within * size)
        if not len(outside):
            return cls(dead, size, HORIZON)
        k = int(outside[-1])
        if k + 1 == len(times) or len(times) > MOST_SAMPLES:
            return cls(math.inf, size, float(times[k]))
        inner, outer = abs(float(left[k + 1])), abs(float(left[k]))
        if left[k] * left[k + 1] < 0.0:
            inner = -inner
        share = (outer - within * size) / (outer - inner)
        seconds = float(times[k] + share * (times[k + 1] - times[k]))
        # this early, the edge itself is still moving, or plays are waiting for its end
        return cls(seconds if seconds > dead + 2.0 * EDGE else dead, size, HORIZON)


def _left(chain: Chain, begin: float, end: float, within: float, dead: float) -> tuple[Array, Array, float]:
    """Times (N,) since the step, from its arrival on; the output's distance from its final value; size of the final
    step.

    `dead`: time in s until the step arrives.

    The chain is exact for a drive that is linear between samples, but a block behind a filter takes the filter's curved
    output as linear too. Every interval in which the output deviates from a straight line is therefore split.
    """
    decades = math.log10(HORIZON / EDGE)
    times = dead + np.geomspace(EDGE, HORIZON, round(A_DECADE * decades) + 1)
    split = np.ones(len(times) - 1, dtype=bool)
    while True:
        middle = (times[:-1] + GOLDEN * np.diff(times))[split]
        new = np.concatenate([np.zeros(len(times), dtype=bool), np.ones(len(middle), dtype=bool)])
        order = np.argsort(np.concatenate([times, middle]), kind="stable")
        times, new = np.concatenate([times, middle])[order], new[order]
        left, size = _answered(chain, begin, end, times, dead)
        if len(times) > MOST_SAMPLES:
            return times, left, size
        at = np.flatnonzero(new)
        straight = (1.0 - GOLDEN) * left[at - 1] + GOLDEN * left[at + 1]
        off = np.abs(left[at] - straight) > min(CLOSE * within, FINE) * size
        split = np.zeros(len(times) - 1, dtype=bool)
        split[at[off] - 1] = split[at[off]] = True
        wide, outside = np.diff(times), np.abs(left) > 0.5 * within * size
        loud = outside[:-1] | outside[1:]
        split[:-1] |= loud[1:] & (wide[:-1] > GRADED * wide[1:])
        split[1:] |= loud[:-1] & (wide[1:] > GRADED * wide[:-1])
        split &= wide > NARROWEST * (times[1:] - dead)
        if not split.any():
            return times, left, size


def _answered(chain: Chain, begin: float, end: float, times: Array, dead: float) -> tuple[Array, float]:
    """The output's distance from its final value at `times` after a step, and the size of the final step."""
    edge = [EDGE, dead] if dead > EDGE else []
    t = np.concatenate([[-3.0 * FOREVER, -2.0 * FOREVER, -FOREVER, 0.0], edge, times, [FOREVER]])
    v = np.where(t > 0.0, end, begin)
    v[0] = end
    (y,) = chain.simulate([Run(t, v)])
    return y[4 + len(edge) : -1] - y[-1], abs(float(y[-1] - y[3]))
