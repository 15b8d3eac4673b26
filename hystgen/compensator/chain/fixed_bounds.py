"""Error bounds of a model with effects in fixed point against double precision, block by block.

As in `hystgen.compensator.chain.bounds`, every block adds the roundings of its own operations and constants to the
error that reaches it, and passes the sum on with its largest gain. Every operation rounds signals to their last bit and
states to lower bits; a state keeps each rounding for 1/rate samples. The drive is rounded to a code and absorbed as
sent: the plays see that rounding error, or `rate/2` codes of it behind a lag. Errors are in units of signals in front
of the plays and in output codes behind them.

A lag that is led misses its target by a second difference, so plays behind it see a signal other than the one solved
for: their memories differ for two drives, and the lead amplifies that up to the range of the drive. A user's own block
in front has the same effect while the drive is limited. `rounding` is then the difference from a compensator in double
precision that has seen the same drives. With a memoryless part it holds only while nothing is limited, since a lag in
front of it cannot be led beyond the drive's range.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np

from hystgen.arithmetic.factors import error as missed
from hystgen.chain.static import StaticModel
from hystgen.compensator.bounds import SECOND_ORDER, UNSLEWED, together
from hystgen.compensator.chain.bounds import SAME, STILL
from hystgen.compensator.chain.layout import ChainTables, ahead_of, largest_way
from hystgen.compensator.chain.moving import (
    STRAIGHTNESS,
    Bumps,
    least_dilated,
    least_slope,
    of_shifts,
    parallel,
    parallel_slopes,
    steepest_bend,
    yield_error,
)
from hystgen.compensator.chain.parts import BEHIND, LED, NAMES, Parts
from hystgen.compensator.fixed_tables import Builder, FixedCurve, upward
from hystgen.effects.maps import MapErrors, Whole
from hystgen.effects.part import Coded, CodedGain, Coding, Sought, Speed
from hystgen.effects.plays import DASHPOT, DILATED, PLAIN

DOUBLE = 2.0**-40
"""Relative error allowed for double precision itself: a thousand roundings."""


@dataclass(frozen=True)
class Sizes:
    """Largest magnitudes of the signals behind the plays, in output codes.

    Forwards: the sum of the plays, the input of each block (`given`, by part) and of each map of the output (`mapped`),
    and the output. Backwards: the reference after the inverse of each map, the smallest and largest input that a curve
    returns for it (`inverted`), the target of the output side, the output asked of each block (`wanted`), and the sum
    asked of the plays.
    """

    plays: float
    given: dict[str, list[float]]
    wanted: dict[str, list[float]]
    mapped: list[float]
    output: float
    undone: list[float]
    inverted: list[tuple[float, float] | None]
    target: float
    asked: float

    @property
    def largest(self) -> float:
        """The largest of all these."""
        blocks = (size for sizes in (*self.given.values(), self.wanted["own_behind"]) for size in sizes)
        forwards = (self.plays, *blocks, *self.mapped, self.output)
        return max(*forwards, *self.undone, self.target, self.asked)


@dataclass(frozen=True)
class Bend:
    """A curve of a map; its arguments omit `drop` bits of a signal, its values `lift` bits."""

    curve: FixedCurve
    drop: int
    lift: int

    def error(self, slope: float) -> float:
        """Error in units of signals, for the largest slope."""
        argument = 0.5 * 2.0**self.drop if self.drop else 0.0
        return self.curve.error * 2.0**self.lift + argument * slope


@dataclass(frozen=True)
class Bounds:
    """The bounds of one model; fields as in `hystgen.compensator.chain.fixed_tables`.

    `formats`: the blocks of each part; `bends`: the curve and inverse curve of each map that has them; `ends`: range of
    the output; `slewed`: rounding error of a slew-limited drive, in drive codes; `reached`: whether the block in front
    can be led to every input asked of the plays; `largest_step`: as in `Compiled`; `finer`: bits of a signal in front
    of the plays below the last bit of their input; `bumps`: curves of bent plays.
    """

    static: StaticModel
    parts: Parts
    inner: Builder
    tables: ChainTables
    sizes: Sizes
    bits: int
    drop: int
    formats: dict[str, list[Any]]
    taps: list[float]
    bends: list[list[Bend]]
    ends: tuple[float, float]
    slewed: float
    reached: bool
    largest_step: float
    finer: int
    seconds: float
    bumps: Bumps

    @property
    def drifted(self) -> float:
        """Total error of all drifts, in units of signals."""
        return float(sum(each.error for each in self.formats["clock"]))

    @property
    def _fine(self) -> int:
        """Bits of a signal in front of the plays below a drive code."""
        return self.inner.fine + self.finer

    @property
    def _signal(self) -> float:
        """The unit of signals behind the plays, in output codes."""
        return 2.0**-self.bits

    @property
    def _arriving(self) -> float:
        """The unit of signals in front of the plays, in drive units."""
        return float(self.inner.drive_lsb) / 2.0**self._fine

    @property
    def _way(self) -> float:
        """As `Compiled.largest_way`."""
        return largest_way(self.static, [each.one for each in self._ahead], self.largest_step)

    # ------------------------------------------------------------ blocks

    @cached_property
    def _ahead(self) -> list[Any]:
        """Blocks in front of the plays."""
        return ahead_of(self.formats)

    def _behind(self, forward: bool) -> list[tuple[Coded, float, CodedGain | None]]:
        """Blocks behind the plays in the `forward` operator or the inverse, with their largest inputs and gains, if
        any."""
        parts = [part.name for part in BEHIND if forward or not part.forward]
        speed = Speed(self.static.input_range, self.largest_step, self.seconds)
        lsb = float(self.inner.output_lsb)
        coding = Coding(float(self.inner.drive_lsb), lsb, (self.ends[1] - self.ends[0]) / lsb)
        found: list[tuple[Coded, float, CodedGain | None]] = []
        reached = 0.0  # largest input of the gains, from the output's ends, a closer bound than the signals' sizes
        for name in parts:
            for each, size in zip(self.formats[name], self.sizes.given[name], strict=True):
                gain = each.gain(reached or size, speed, coding)
                found.append((each, size, gain))
                if gain:
                    reached = (reached or size) * gain.largest + gain.offset
        return found

    def _mapped(self) -> MapErrors:
        """Maps of the output: slope of their inverse at its ends, and errors of inverse and maps, in output codes."""
        found = MapErrors(np.array(self.ends) - self.static.output_offset, 1.0, 0.0, 0.0)
        unit = Whole(self._signal, float(self.inner.output_lsb), self.sizes.output)
        for each, curves in zip(reversed(self.parts.maps), reversed(self.bends), strict=True):
            found = each.whole_errors(found, curves, unit)
        return found

    # ------------------------------------------------------------ operators

    def _arrival(self) -> tuple[float, float]:
        """Roundings of the signal in front of the plays for the drive as sent, and how much rounding the drive to a
        code changes that signal, both in units of signals."""
        here = sum(each.arrived for each in self._ahead)
        here += 0.5 * 2.0**self.finer if self.finer else 0.0
        code = 0.5 * 2.0**self._fine
        if self._kept:
            return here, code + self._kept
        if self._ahead:
            return here, code * self._ahead[0].follows
        return here, code * (bool(self.static.stages) or self._fine > 0)

    @property
    def _kept(self) -> float:
        """Largest distance of the plays' input from its target while the drive stands still."""
        return 2.0 * float(self.tables.number.dither[0]) if self.tables.quiet and not self.condition else 0.0

    @cached_property
    def _shares(self) -> list[tuple[float, float]]:
        """The factors `first` and `second` of each play, as in `FixedMovingTables`."""
        t = self.tables.moving
        return [
            (float(m) / 2.0 ** int(shift), float(n) / 2.0 ** int(second))
            for (m, shift), (n, second) in zip(t.first[1:].tolist(), t.second[1:].tolist(), strict=True)
        ]

    @cached_property
    def _bent(self) -> float:
        """Largest change of a play's contribution per change of the play."""
        return 1.0 + steepest_bend(self.static, self.parts.plays) if self.bumps.curves else 1.0

    def _moved(self, way: float) -> tuple[float, float]:
        """Error, in codes, of the sum of plays that an effect moves or bends, and the part that the inverse undoes.

        Its causes are rounding, and contacts within a step in which the plays' input moves by `way`.
        """
        t = self.tables.moving
        if not t.used:
            return 0.0, 0.0
        travel, step = float(self.inner.hull[1] - self.inner.hull[0]), float(self.inner.step)
        plays = []
        for first, second in self._shares:
            if t.moves == DASHPOT:
                plays.append(2.0 * step + self._dashpot(step, way))
            elif t.moves == DILATED:
                plays.append((1.0 + 2.0**-30 * first * travel) * step)
            elif t.moves != PLAIN and first < 1.0:
                wrong = 2.0 * travel * (2.0**-30 * (first + second))
                plays.append((1.0 + wrong) / first * step + 0.25 * way)
            else:
                plays.append(step * (t.moves != PLAIN))
        slopes = 0.5 * len(t.relaxed.slope) * 2.0**-self.inner.bits * travel * t.scanned
        slopes += len(plays) * 2.0**-self.inner.bits * self.bumps.largest  # rounded weights of the bends
        shifted, counting = of_shifts(self.static, self.parts.plays, t.moves, np.array(plays))
        bumps = math.fsum(map(abs, self.static.pi.weights[1:])) * self.bumps.error * step
        joined = parallel(self.static, self.parts.plays)
        bumps += sum(each.coded_error() for each in joined)
        if joined:
            bumps += least_slope(self.static, self.parts.plays) * 0.5 * step / STRAIGHTNESS
        lsb = float(self.inner.output_lsb)
        return (shifted + bumps) / lsb + slopes, (shifted - counting) / lsb

    def _dashpot(self, step: float, way: float) -> float:
        """Largest deviation of plays with a nonlinear dashpot from the model's, caused by the table and by treating a
        slow input as standing still within a step."""
        t = self.tables.moving
        seen = float(t.seen[0]) / 2.0 ** int(t.seen[1])
        return yield_error(t, self.static, self.parts.plays, self.seconds, step, way) + seen * way

    @cached_property
    def _steepest(self) -> float:
        """Largest change of the sum of the plays per change of their input, over all samples."""
        first, *others = map(abs, self.static.pi.weights)
        dilated = self.tables.moving.moves == DILATED
        joined = parallel_slopes(self.static, self.parts.plays)[1]
        if not dilated and not self.bumps.curves:
            return float(self.static.pi.slopes[-1]) + joined
        more = (p * (1.0 + 2.0 * wider * dilated) for p, (wider, _) in zip(others, self._shares, strict=True))
        return float(first + self._bent * math.fsum(more)) + joined

    def _plays(self, arriving: float, way: float | None = None) -> float:
        """Error of the plays' sum, in output codes, for an error in front of the memoryless part; `way`: default
        `_way`."""
        steep = self.static.front_slopes[1] * self._steepest / float(self.inner.output_lsb)
        level = 0.5 * self._signal if self.drop else 0.0
        moved, _ = self._moved(self._way if way is None else way)
        return self._bent * float(self.inner.sum_error()) + moved + steep * arriving * self._arriving + level

    def forward(self) -> float:
        """Bound of the forward operator, in output codes."""
        short = float(self.inner.drive_short() / self.inner.drive_lsb) * 2.0**self._fine
        waited = 0.5 * 2.0**self._fine * bool(self.tables.of("wait").samples and self.tables.of("wait").share[0, 0])
        error = self._plays(self._arrival()[0] + short + waited + self.slewed * 2.0**self._fine)
        if self._ahead and self.static.branches_differ:  # the front can settle on either branch
            error += self.static.pi.slopes[-1] * self.static.branch_gap / float(self.inner.output_lsb)
        for each, size, gain in self._behind(True):
            error = error * each.one.growth + each.there(size, self._signal)
            if gain:
                error = gain.largest * error + gain.there + self._signal
        beside = self._mapped().there + 0.5 + (1.0 + self.drifted) * self._signal
        return upward(Fraction(SECOND_ORDER * (error + beside) + DOUBLE * self.sizes.output))

    def _asked(self) -> float:
        """Error of the play sum that the inverse asks for, in output codes."""
        _, slope, back, _ = self._mapped()
        low, high = (end / float(self.inner.output_lsb) for end in self.ends)
        least, most = self.tables.limits.output[0]
        short = max(high - float(most), float(least) - low, 0.0)
        error = slope * (short + (1.0 + self.drifted) * self._signal) + back
        if self.taps:
            size = max(self.sizes.undone)
            own = sum(missed(weight) * size + 0.5 * self._signal for weight in self.taps)
            error = error * math.fsum(map(abs, self.taps)) + own
        apart = self._plays(self.slewed * 2.0**self._fine) if self.slewed else 0.0  # states behind a slew limit
        behind = self._behind(False)
        seen = apart * math.prod(max(each.one.growth, 1.0) for each, *_ in behind)
        for each, size, gain in reversed(behind):
            if gain:
                error = error / gain.least + gain.back + 0.5 * self._signal * (1.0 + 1.0 / gain.least)
            error = each.solved(error, Sought(size, self.sizes.asked, self._signal, apart, seen, bool(self.condition)))
        return error

    def _residual(self, way: float, solved: float) -> float:
        """Error of the sum of the plays at the input that the inverse finds, in output units, given an error `solved`
        of that input in units of signals; `way` as `_way`."""
        missed_by = self._plays(0.0, way) * float(self.inner.output_lsb) + self._steepest * solved * self._arriving
        for each, *_ in self._behind(False):  # their states have seen the sum of the plays
            missed_by = each.residual(missed_by, bool(self.condition))
        return self._asked() * float(self.inner.output_lsb) + missed_by

    def _solution(self) -> float:
        """Rounding of the plays' input as solved for, in units of signals.

        If signals have bits below that input, the remainder of the sum is divided by the slope of the plays that follow
        up to the input. More plays can begin to follow within the next step of the input: the slope used is then too
        small, by a factor down to `p_0/sum p`, and any result beyond that step is cut off.
        """
        t, step = self.tables.moving, float(self.inner.step)
        solution = 1.5 * step if t.used and not t.scanned else float(self.inner.solved())
        if self.finer:
            weights = self.static.pi.weights
            solution += max(0.5 - weights[0] / math.fsum(weights), 0.0) * step
        return solution / self._arriving

    def _arriving_error(self, way: float) -> float:
        """Error of the signal that the inverse asks for in front of the memoryless part, in units of signals."""
        code, steep = self._arrival(), self.static.front_slopes[1]
        short = float(self.inner.drive_short() / self.inner.drive_lsb) * 2.0**self._fine
        solved = self._solution() + steep * float(self.inner.back())
        apart = sum(code) + short + self.slewed * 2.0**self._fine
        solved += steep * (code[0] if self.condition else apart)  # for the same drives, else for different ones
        return self._gain() * self._residual(way, solved) / self._arriving

    def _found_error(self, way: float) -> float:
        """Error of the inverse's answer, without the part that the inverse undoes; under a `condition` the plays are
        the same, and only the answer's own rounding remains."""
        if not self.condition:
            undone = self._moved(way)[1] * float(self.inner.output_lsb)
            return self._arriving_error(way) - self._gain() * undone / self._arriving
        seen = self._residual(way, self.static.front_slopes[1] * self._arrival()[0])
        own = self._solution() / self.static.front_slopes[0] + float(self.inner.back())
        return self._gain_at_once() * seen / self._arriving + own

    def _gain_at_once(self) -> float:
        """Largest change of the drive in front of the memoryless part per change of the plays' sum, for plays that have
        seen the same drives."""
        least = float(self.static.pi.weights[0])
        if self.bumps.curves or self._joined:
            least = least_slope(self.static, self.parts.plays)
        if self.tables.moving.moves == DILATED:
            least = min(least, least_dilated(self.static, self.parts.plays, self.seconds))
        return 1.0 / least / self.static.front_slopes[0]

    def _gain(self) -> float:
        """As `_gain_at_once`, for plays that have seen only the drives of their own compensator."""
        if self.tables.moving.moves == DILATED:  # as in `_gain_at_once`, but drives at rest can differ more
            least = least_dilated(self.static, self.parts.plays, self.seconds)
            if self.bumps.curves:
                least = min(least, 0.5 * least_slope(self.static, self.parts.plays))
            return 1.0 / least / self.static.front_slopes[0]
        if self.tables.moving.used:  # as in floating point
            bent = bool(self.bumps.curves) or self._joined
            least = least_slope(self.static, self.parts.plays) if bent else self.static.pi.weights[0]
            return 2.0 / least / self.static.front_slopes[0]
        return float(self.inner.gain())

    def _led(self, error: float) -> float:
        """The error of the drive that results from an error in front of the plays, both in units of signals."""
        turning = bool(self.tables.turning)
        for each in reversed(self._ahead):
            code = 0.5 * 2.0**self._fine if each is self._ahead[0] else 0.5
            error = each.led(error, code, bool(self.condition), turning)
        return error + 2.0 * float(self.tables.number.dither[0]) * turning

    def _codes(self, error: float) -> float:
        """The error of the drive, in drive codes, for an error in front of the plays in units of signals."""
        own = SECOND_ORDER * self._led(error + self._kept) / 2.0**self._fine
        whole = float(self.inner.drive[1] - self.inner.drive[0])
        return upward(Fraction(min(own + DOUBLE * whole, whole)))

    def hold(self) -> int:
        """Longest step back of the drive that rounding alone can cause, in units of signals."""
        if not self.static.branches_differ or not self.inner.invertible:
            return 0
        # contacts within a step shift drives but do not make them turn
        return math.floor(2.0 * (self._found_error(0.0) if self.condition else self._arriving_error(0.0)))

    @property
    def _joined(self) -> bool:
        """Whether elements are in parallel with the plays, which remember an earlier difference between drives."""
        return len(self.tables.moving.elements.element) > 0

    @property
    def condition(self) -> str:
        """The condition of `rounding` in words, if only the range bounds the difference between two drives; else ""."""
        missed = any(each.one.misses for each in self._ahead)
        remembered = self.tables.moving.moves == DILATED or self._joined
        if not (missed or remembered or (self.formats[NAMES[LED]] and (not self.reached or self.parts.slew))):
            return ""
        still = STILL * (self.tables.quiet > 0)
        if not self.reached:
            return together(SAME, "nothing is limited", still)
        return together(SAME, UNSLEWED * self.tables.braked, still)

    def rounding(self) -> float:
        """Bound of the inverse on the same branch and under its `condition`, in drive codes."""
        own = self._codes(self._found_error(self._way))
        return max(own, self._limits_off()) if self.condition else own

    def _limits_off(self) -> float:
        """Error of the drive's limits caused by rounding drives to codes, for a limited drive and the one before it."""
        return upward(max(self.inner.drive_short() / self.inner.drive_lsb, Fraction(2.0 * self.slewed)))

    def inverse(self) -> float:
        """Bound of the inverse in drive codes, including the effect of another branch and of limits."""
        if self.condition:
            return float(self.inner.drive[1] - self.inner.drive[0])
        if not self.static.branches_differ:
            return self.rounding()
        gap = self.static.branch_gap
        other = self._gain() * self.static.pi.slopes[-1] * gap + gap / self.static.front_slopes[0]
        return self._codes(self._found_error(self._way) + 1.001 * other / self._arriving)
