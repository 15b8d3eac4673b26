"""The inverse of a model with effects for a known reference, in double precision and for any sample times.

The compensator's only memory is the states of the actuator. In each sample it solves for the drive block by block, from
the output backwards, limits it, and absorbs the applied drive forwards. A delay and a mode need the reference ahead of
time.

The reference is read as in the C, with the same weights for its samples, at the record's sample times. Only `quiet` and
`max_rate` are ignored, since double precision has no codes between which a drive could dither.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.jit import plain
from hystgen.basics.problems import EffectsError, NotInvertibleError, UnsupportedEffectsError
from hystgen.chain.chain import Chain, arriving_slack
from hystgen.compensator.chain import noise, preview
from hystgen.compensator.chain.layout import Read, read
from hystgen.compensator.chain.parts import BEHIND, BESIDE, ELEMENTS, MOVES, PARTS, Parts
from hystgen.compensator.chain.step_float import ramp
from hystgen.effects import CATALOGUE
from hystgen.effects.base import Array, Block, Effect, Place, Run
from hystgen.effects.part import Following, Leading
from hystgen.parameters.schema import Compensation

EVEN = 1e-3
"""Largest relative difference between time steps that count as equal: about the error of a mode's inverse,
`w0^2 T^2/12`, which is 9e-4 with 60 samples per period."""

ROUNDING = 1e-14
"""Relative change below which a difference counts as rounding: about a hundred roundings of 1.1e-16."""

FINEST = 1e-16
"""[fraction of the larger end] Interval width at which the search for an input stops: below the last bit of that end,
so that a search that ends near 0 stops too."""

TURNS = 8
"""Maximum iterations per sample if the gain depends on the drive to be found. 500 jumps by a quarter of the range, with
a loss of 1 % per decade from half the range on, converge to the last bit in 5 iterations on average, 7 at most."""

STANDARD = Compensation()


class FrontAndPlays(Block):
    """The memoryless front and the plays as one block: input is the drive (behind a lag), output the weighted sum.

    A move back by at most `slack` is ignored.
    """

    def __init__(self, chain: Chain) -> None:
        pi = chain.cascade.pi
        self.chain, self.static, self.slack = chain, chain.cascade, arriving_slack(chain.cascade, chain.effects)
        self.r, self.p = np.array(pi.thresholds), np.array(pi.weights)
        self.c, self.q = np.cumsum(self.p), np.cumsum(self.p * self.r)
        self.movement = None if chain.mover is None else MOVES.of(chain.mover, self.r, self.p)
        self.elements = [ELEMENTS.of(effect, *self.static.play_range).memory for effect in chain.joining]
        self.loaded = False
        self.start = np.array(pi.start)
        self.led_by: Leading | None = None
        self.start_over()

    def start_over(self) -> None:
        """Return to the start memory."""
        self.plays = self.start.copy()
        self.loaded = False
        self.ascending = self.rises = True
        at = float(self.start[0])
        self.drive = float(self.static.front_inverse(at)) if self.static.start_is_defined else 0.0
        self.advance(math.inf)

    def advance(self, seconds: float, later: float | None = None) -> None:  # noqa: ARG002  as in every block
        """Set the duration of the plays' next move."""
        self.seconds = seconds

    def moved(self, w: float) -> Array:
        """The plays (n + 1) after their input has moved to w."""
        if self.movement is None or math.isinf(self.seconds):
            return np.asarray(np.minimum(np.maximum(self.plays, w - self.r), w + self.r))
        return self.movement.after(self.plays, float(self.plays[0]), w, self.seconds)

    def total(self, rows: Array) -> float:
        """The weighted sum of the rows, bent where an effect bends them, with the elements in parallel."""
        beside = sum(each.total(float(rows[0])) for each in self.elements) if self.loaded else 0.0
        return float(self.p @ self.chain.bent(rows[:, None], self.r)[:, 0]) + beside

    def call(self, verb: str, x: float) -> float:
        """Solve or absorb, even for `rest` and `resting`: the first move from the start memory is like any other."""
        if verb == "rest":  # elements in parallel begin unloaded
            self.loaded = False
        return self.solve(x) if verb == "resting" else self.absorb(x)

    def solve(self, y: float) -> float:
        """The drive for output `y`, on the branch of its own move. It stays on its branch while it moves on or holds,
        and turns only to go back by more than rounding, or by more than a lag in front misses in the first sample of
        the turn.

        A lag falls short by `theta` of the distance to the other branch. With this fraction as the limit, holding never
        misses by more than an immediate turn would; with any other fraction the miss can reach at least `1 + theta`
        times that of a drive that knows how far the reference will go back. `rises`: whether the drive will rise.
        """
        w = self._input(y)
        if not self.static.branches_differ:
            return float(self.static.front_inverse(w))
        self.rises = self.ascending
        v = float(self.static.front_inverse(w, self.ascending))
        back = self.drive - v if self.ascending else v - self.drive
        if back <= 0.0:
            return v
        other = float(self.static.front_inverse(w, not self.ascending))
        rounding = self.slack + ROUNDING * self.static.slope_ratio * max(abs(v), abs(self.drive))
        patience = self.led_by.patience if self.led_by else 0.0
        if back <= rounding + patience * abs(other - v):
            return self.drive
        if other == self.drive or (other > self.drive) == self.ascending:  # the branches meet here
            return self.drive
        self.rises = not self.ascending
        return other

    def absorb(self, x: float) -> float:
        """Move the plays; the direction of the move selects the branch."""
        back = self.drive - x if self.ascending else x - self.drive
        if back > self.slack:
            self.ascending = not self.ascending
        if back > self.slack or back < 0.0:
            self.drive = x
        self.plays = self.moved(float(self.static.front(x, self.ascending)))
        w = float(self.plays[0])
        for each in self.elements:
            each.move(w) if self.loaded else each.rest(w)
        self.loaded = True
        return self.total(self.plays)

    def _input(self, y: float) -> float:
        """Input of the plays at which their sum is `y`."""
        if self.movement is None and not self.chain.bending and not self.elements:
            return self._scan(y)
        w = float(self.plays[0])
        before = self.total(self.moved(w))
        if y == before:
            return w
        way = (y - before) / float(self.p[0])  # at the smallest slope, unless an effect bends the plays
        for _ in range(64):
            far = w + way
            if (left := self.total(self.moved(far)) - y) * (before - y) <= 0.0:
                return self._between(y, (w, before - y), (far, left))
            way *= 2.0
        raise EffectsError(f"no input of the plays gives {y:g}")

    def _between(self, y: float, one: tuple[float, float], other: tuple[float, float]) -> float:
        """The input at which the sum is `y`, between two inputs given with the errors of their sums.

        False position that halves the weight of an end that stays (Illinois: Dowell and Jarratt, BIT 11 (1971) 168),
        down to adjacent numbers.
        """
        (a, missed), (b, left) = one, other
        while left and abs(b - a) > FINEST * max(abs(one[0]), abs(other[0])):
            x = b - left * (b - a) / (left - missed)
            if not min(a, b) < x < max(a, b):
                x = 0.5 * (a + b)
                if x in (a, b):
                    break
            found = self.total(self.moved(x)) - y
            a, missed = (b, left) if found * left < 0.0 else (a, 0.5 * missed)
            b, left = x, found
        return b

    def _scan(self, y: float) -> float:
        """As `_input`, for plain plays: finds the linear piece of the move's curve on which the sum is `y`."""
        sign = 1.0 if y >= float(self.p @ self.plays) else -1.0
        held = np.append(np.cumsum((self.p * self.plays)[:0:-1])[::-1], 0.0)  # of plays with larger thresholds
        inputs = self.plays + sign * self.r  # where each play begins to follow
        levels = self.c * inputs - sign * self.q + held
        k = max(int(np.searchsorted(sign * levels, sign * y, side="right")) - 1, 0)
        w = float((y - held[k] + sign * self.q[k]) / self.c[k])
        return sign * max(sign * w, sign * float(inputs[k]))


def refusal(effect: Effect, compensate: Collection[str] = ()) -> str:
    """Why a compensator cannot include an effect; empty if it can. `compensate`: unmeasured effects to include
    anyway."""
    for part in PARTS:
        if (alone := part.unmeasured) and alone.key not in compensate and part.takes(effect):
            write = f"emit: {{compensation: {{compensate: [{alone.key}]}}}}"
            return f"{alone.known}; to compensate it anyway, write {write})"
    if effect.name not in CATALOGUE and effect.block is None:
        return f"{effect.name} (an effect of your own, which has no compensator)"
    return ""


def filter_block(effect: Effect) -> Block | None:
    """The block of an effect that is a filter in front of the plays or behind them; None for any other effect."""
    return next((block for part in PARTS if part.takes(effect) and (block := part.uneven(effect))), None)


class Compensator:
    """Drives for a reference; ignores the sensor's own nonlinearity, since the reference is the true displacement.

    `how`: how to read the reference, in samples of the record, and which unmeasured effects to compensate: `drift`,
    which begins at t = 0, and `self_heating`. `as_emitted`: lead a lag in front of two branches however short it is, as
    the C does because its drives are rounded. Raises NotInvertibleError and UnsupportedEffectsError, with all reasons.
    """

    def __init__(self, chain: Chain, how: Compensation = STANDARD, as_emitted: bool = False) -> None:
        static, effects = chain.cascade, chain.effects
        self.parts = Parts.of(effects)
        listed = [(part, effect) for part in PARTS for effect in self.parts.blocks[part.name]]
        missing = [reason for part, effect in listed for reason in part.no_inverse(effect)]
        if missing := [*missing, *static.inverse_problems()]:
            raise NotInvertibleError(missing)
        refused = [reason for effect in effects if (reason := refusal(effect, how.compensate))]
        if refused:
            raise UnsupportedEffectsError(f"the inverse cannot include {', '.join(refused)}; remove it from the model")
        self.static, self.effects, self.how = static, effects, how
        drives, outputs = (
            [block for effect in chain.at(place) if (block := filter_block(effect))]
            for place in (Place.DRIVE, Place.LINEAR)
        )
        self.actuator = FrontAndPlays(chain)
        self.blocks: list[Block] = [*drives, self.actuator, *outputs]
        self.slew = self.parts.slew
        self.rest = 0.0  # rounding remainder of a slew-limited drive, which would add up over millions of steps
        self.ends: Sequence[tuple[float, float]] = ()
        lags = [block for block in drives if isinstance(block, Leading)]
        self.braked = lags[0] if self.slew and len(lags) == 1 else None
        if self.parts.turning(static.branches_differ):
            lags[0].rises, lags[0].always_led = lambda: self.actuator.rises, as_emitted
            self.actuator.led_by = lags[0]

    def drives(self, reference: Run, ends: tuple[float, float], asked: NDArray[np.bool_] | None = None) -> Array:
        """Drives (N,) within `ends` for the reference in `reference.v`; see `answers`."""
        return self.answers(reference, ends, asked)[0]

    @plain()  # a sample's few blocks take less time than handing their tables to compiled code
    def answers(
        self, reference: Run, ends: tuple[float, float], asked: NDArray[np.bool_] | None = None,
        held: NDArray[np.bool_] | None = None,
    ) -> tuple[Array, Array]:
        """Drives (N,) within `ends` for the reference in `reference.v`, and how much limiting changed each.

        `asked` (N,): which samples of `reference.v` are references. Samples before the first reference are drives;
        between references the drive holds. Everything is at rest at the first sample. After the last sample the
        reference keeps its value. `held` (N,): samples without a reference, at which the drive holds as in the C, while
        the preview goes on reading `reference.v`.
        """
        asked = np.ones(len(reference.t), dtype=bool) if asked is None else asked
        held = np.zeros(len(reference.t), dtype=bool) if held is None else held
        first = int(np.argmax(asked))
        self.actuator.start_over()
        t, n = reference.t, len(reference.t)
        gains = self._gains(reference)
        targets = self._targets(reference, asked)
        following = self._following()
        v, beyond = np.empty(n), np.zeros(n)
        self.rest = 0.0
        steps = np.diff(t).tolist() or [1.0]
        for k in range(n):
            seconds = steps[k - 1] if k else 0.0
            for block in self.blocks:
                if k or block is not self.actuator:  # no time has passed for the actuator at its start
                    block.advance(steps[max(k - 1, 0)], steps[min(k, len(steps) - 1)])
            before = float(v[k - 1]) if k else math.nan
            drive = before
            for _ in range(TURNS):
                if not asked[k]:
                    drive = float(reference.v[k]) if k < first else before
                    break
                if held[k]:
                    drive = before if k else min(max(self.actuator.drive, ends[0]), ends[1])
                    break
                last = drive
                y = float(targets[k])
                for gain, offset in reversed(gains):
                    y = (y - float(offset[k])) / float(gain[k])
                for each in reversed(following):
                    y = each.solve(y, before, drive, seconds)
                drive = self._solve(y, k)
                wanted = self._slewed(drive, before, seconds) if self.slew and k else drive
                drive = min(max(wanted, ends[0]), ends[1])
                beyond[k] = abs(wanted - drive)
                if drive == last or not following:
                    break
            x = drive
            for block in self.blocks:
                x = block.absorb(x) if k else block.rest(x)
            for each in following:
                each.move(before, drive, seconds)
            self.rest = next((rest for end, rest in self.ends if drive == end), 0.0)
            v[k] = drive
        return v, beyond

    def _following(self) -> list[Following]:
        """The gains that depend on the drive, at their start."""
        listed = [(part, effect) for part in BEHIND for effect in self.parts.blocks[part.name]]
        return [each for part, effect in listed if (each := part.following(effect))]

    def _solve(self, y: float, k: int) -> float:
        for block in reversed(self.blocks):
            y = block.solve(y) if k else block.resting(y)
        return y

    def _slewed(self, drive: float, before: float, seconds: float) -> float:
        """The nearest drive that the amplifier can reach in this time, or one at which a lag does not overshoot."""
        falling: float = min(effect.falling_rate for effect in self.slew) * seconds
        rising: float = min(effect.rate for effect in self.slew) * seconds
        low, high = self.ends = [ramp(before, self.rest, move, 0.0) for move in (-falling, rising)]
        near = min(max(drive, low[0]), high[0])
        if self.braked is not None and not self.braked.exact:
            near = self.braked.braked(near, abs(drive - near), falling, rising)
        return min(max(near, low[0]), high[0])

    def _gains(self, reference: Run) -> list[tuple[Array, Array]]:
        """Gain and offset (N,) for each logged column, at the time at which a sample's drive takes effect."""
        ahead = reference.t + self.parts.delay
        extra = {name: np.interp(ahead, reference.t, column) for name, column in reference.extra.items()}
        later = Run(reference.t, reference.v, extra)
        logged = [effect for effect in self.effects if effect.place is Place.GAIN and effect.read]
        return [effect.gains(later) for effect in logged]

    def _targets(self, reference: Run, asked: NDArray[np.bool_]) -> Array:
        """The output (N,) that creep, or the gain behind it, has to reach at each sample to follow the reference."""
        wanted = reference.v - self.static.output_offset
        for effect in (each for part in BESIDE for each in self.parts.blocks[part.name]):
            wanted = wanted - np.where(asked, effect.added(reference), 0.0)
        for each in reversed(self.parts.maps):
            wanted = each.undone(wanted)
        t, how = reference.t, self.how
        modes = self.parts.modes if how.resonance != "none" else []
        if not (modes or how.corner or how.noise_gain or how.drive_hold == "held" or how.preview is not None):
            return np.asarray(np.interp(t + self.parts.delay, t, wanted)) if self.parts.delay else wanted
        step = _even_step(t, asked, "the inverse of a resonance" if modes else "emit.compensation")
        found = self.reading(step)
        if found.taps is None:
            return wanted
        first = found.taps.first - found.missing(how.preview)
        target = np.array(wanted)
        edges = np.flatnonzero(np.diff(np.concatenate([[0], asked.astype(np.int8), [0]])))
        for begin, end in edges.reshape(-1, 2):  # the reference is constant before and after a record
            times, values = t[begin:end], wanted[begin:end]
            target[begin:end] = sum(
                weight * np.interp(times + (first + i) * step, times, values)
                for i, weight in enumerate(found.taps.weights.tolist())
                if weight
            )
        return target

    def reading(self, step: float) -> Read:
        """The way in which the reference is read at samples `step` apart. Raises UnsupportedEffectsError if no averages
        keep the noise gain within its limit."""
        found = read(self.static, self.parts, step, self.how)
        if self.how.noise_gain is not None:
            gain = noise.largest(noise.Gain(self.static, self.parts, step, found.taps or preview.PLAIN))
            noise.check(gain, self.how.noise_gain)
        return found


def _even_step(t: Array, asked: NDArray[np.bool_], what: str) -> float:
    """The time between two references in s. Raises EffectsError, for `what`, if they are not evenly spaced."""
    steps = np.diff(t)[asked[1:] & asked[:-1]]
    step = float(np.median(steps)) if len(steps) else 1.0
    if len(steps) and float(np.max(np.abs(steps - step))) > EVEN * step:
        raise EffectsError(f"{what} needs evenly spaced samples; resample the reference")
    return step
