"""How far a model with effects in fixed point can be from the one in double precision, block by block.

As in `hystgen.compensator.chain.bounds`, every block adds the roundings of its own operations and constants to the
error that reaches it, and passes the sum on with its largest gain. Signals are rounded to their last bit in every
operation; states to bits below that, and a state keeps each rounding for 1/rate samples. The drive is rounded to a code
and absorbed as sent: the plays see that rounding, or behind a lag `rate/2` codes of it. Errors are in units of signals
in front of the plays and in output codes behind them.

A led lag misses its target by a second difference, so that plays behind it have not seen what was solved for: their
memory differs between two drives, and the lead amplifies that up to the range of the drive. A block of the user's own
in front has such an effect while the drive is limited. `rounding` is then the
difference from a compensator in double precision that has seen the same drives. Behind a memoryless part it holds only
while nothing is limited, since a lag cannot be led beyond the drive's range there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np

from hystgen.arithmetic.factors import MANTISSA_BITS, lifted
from hystgen.arithmetic.factors import error as missed
from hystgen.chain.static import StaticModel
from hystgen.compensator.bounds import SECOND_ORDER, UNSLEWED, together
from hystgen.compensator.chain.bounds import SAME, STILL
from hystgen.compensator.chain.layout import DITHER, ChainTables, largest_way
from hystgen.compensator.chain.moving import (
    DASHPOT,
    DILATED,
    PLAIN,
    Bumps,
    least_dilated,
    least_slope,
    of_shifts,
    steepest_bend,
    yield_error,
)
from hystgen.compensator.chain.own_fixed import Formats
from hystgen.compensator.chain.parts import Parts
from hystgen.compensator.fixed_tables import Builder, FixedCurve, upward
from hystgen.effects.ageing import compensator as ageing
from hystgen.effects.creep import compensator as creep
from hystgen.effects.creep import fixed as creep_fixed
from hystgen.effects.creep.compensator import CreepNumbers
from hystgen.effects.lag import compensator as lag
from hystgen.effects.lag import fixed as lag_fixed
from hystgen.effects.lag.compensator import LagNumbers
from hystgen.effects.rate_dependence import compensator as dashpot
from hystgen.effects.resonance import fixed as resonance_fixed
from hystgen.effects.saturation.model import HardSaturation, Stops, TanhSaturation
from hystgen.effects.thermal import compensator as thermal
from hystgen.effects.thermal.compensator import LARGEST_GAIN, LEAST_GAIN
from hystgen.effects.thermal.fixed import GAIN_BITS, TEMPERATURE_BITS
from hystgen.effects.thermal.model import OwnHeat

GAINS = ("ageing", "heat", "gain")
"""Parts whose blocks are gains, in the order of the chain."""

DOUBLE = 2.0**-40
"""Relative error of double precision itself: a thousand roundings."""

CUBIC_ERROR, LINEAR_ERROR, RECIPROCAL_ERROR = (last_bits * 2.0**-GAIN_BITS for last_bits in (8.0, 1.0, 4.0))
"""[share of what passes] Errors of a gain from a piece of a cubic: four coefficients and products, and a share that is
rounded to 20 bits, where the gain changes by a hundredth; of one linear in a temperature: a product; and of the
reciprocal of a gain of at least 1/2: that of a linear one's error twice, and a step of Newton's."""

FACTOR_ERROR, DEGREES = 2.0**-MANTISSA_BITS, 2.0 ** -(TEMPERATURE_BITS + 1)
"""[share of a product, degrees] Errors of a factor and of the reference of a temperature: half of their last bits."""


@dataclass(frozen=True)
class Sizes:
    """Largest sizes of the signals behind the plays, in output codes.

    Forwards: the sum of the plays, the input of each block of each part (`given`) and of each saturation, and the
    output. Backwards: the reference after the inverse of each saturation, the least and largest input to which each
    tanh is inverted (`inverted`), the target of the output side, the output asked of each block (`wanted`), and the sum
    asked of the plays.
    """

    plays: float
    given: dict[str, list[float]]
    wanted: dict[str, list[float]]
    saturations: list[float]
    output: float
    undone: list[float]
    inverted: list[tuple[float, float]]
    target: float
    asked: float

    @property
    def largest(self) -> float:
        """The largest of them."""
        blocks = (size for sizes in (*self.given.values(), self.wanted["own_behind"]) for size in sizes)
        forwards = (self.plays, *blocks, *self.saturations, self.output)
        return max(*forwards, *self.undone, self.target, self.asked)


@dataclass(frozen=True)
class Gain:
    """A gain behind the plays: its ends, and in output codes what it adds to errors of its output and of its input that
    is solved for, beside the rounding of either."""

    least: float
    largest: float
    there: float
    back: float


@dataclass(frozen=True)
class Bend:
    """The curve of a saturation, with the bits of a signal that arguments and values leave out."""

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

    `ones`, `formats`: the blocks of each part; `in_front`: sizes of those in front of the plays; `bends`: the curve and
    inverse curve of each tanh; `ends`: of the output; `slewed`: drive codes that rounding takes from a drive at a
    limited rate; `reached`: whether the lag can be led to every input asked of the
    plays; `largest_step`: as in `Compiled`; `finer`: bits of a signal in front of the plays below their input;
    `bumps`: of bent plays.
    """

    static: StaticModel
    parts: Parts
    inner: Builder
    tables: ChainTables
    sizes: Sizes
    bits: int
    drop: int
    ones: dict[str, list[Any]]
    formats: dict[str, list[Any]]
    in_front: dict[str, list[tuple[float, float]]]
    taps: list[float]
    bends: list[Bend]
    ends: tuple[float, float]
    slewed: float
    reached: bool
    largest_step: float
    finer: int
    seconds: float
    bumps: Bumps

    @property
    def lags(self) -> list[LagNumbers]:
        """The lags."""
        return self.ones["lag"]

    @property
    def creeps(self) -> list[CreepNumbers]:
        """The creep blocks."""
        return self.ones["creep"]

    @property
    def ahead(self) -> list[Formats]:
        """Blocks of the user's own in front of the plays."""
        return self.formats["own_ahead"]

    @property
    def behind(self) -> list[Formats]:
        """Blocks of the user's own behind the plays."""
        return self.formats["own_behind"]

    @property
    def drifted(self) -> float:
        """Error of drifts in units of signals."""
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
        return largest_way(self.static, [each.linear for each in self.ahead], self.largest_step)

    # ------------------------------------------------------------ blocks

    def _creep(self, j: int) -> float:
        """Roundings of the output of creep j, in output codes."""
        numbers, size = self.creeps[j], self.sizes.given["creep"][j]
        bits, drop = (int(x) for x in self.tables.of("creep").block[j, [creep_fixed.BITS, creep_fixed.DROP]])
        state = 2.0**-bits * self._signal
        found = 0.0
        for rate, _, late, weight in numbers.terms.tolist():
            scale = 2.0 ** (bits - lifted(late, bits))
            found += state * (0.5 / rate + 2.0**drop) + 0.5 * self._signal / scale / rate
            found += 0.5 * self._signal + missed(weight) * size + 2.0 * size * missed(late * scale) / scale / rate
            found += 2.0 * weight * size * missed(rate * 2.0**drop) / 2.0**drop / rate
        direct = numbers.rest - float(sum(numbers.terms[:, creep.WEIGHT]))
        return found + missed(direct) * size + self._signal

    def _creep_back(self, j: int) -> float:
        """Roundings of its inverse, as errors of the output."""
        numbers, size = self.creeps[j], self.sizes.given["creep"][j]
        moved = self.sizes.asked + size * numbers.rest
        return numbers.slope * (missed(1.0 / numbers.slope) * moved + 0.5 * self._signal)

    def _creep_gain(self, numbers: CreepNumbers) -> float:
        """Largest gain of its inverse, as in `hystgen.compensator.chain.bounds`."""
        if self.condition:
            return 1.0 / numbers.slope
        total, late = (float(sum(numbers.terms[:, column])) for column in (creep.WEIGHT, creep.LATE))
        around = numbers.rest - 2.0 * total + 2.0 * late
        return 1.0 / around if around > 0.0 else 2.0 / numbers.slope - 1.0 / numbers.rest

    def _lag(self, j: int, given: float, asked: float) -> tuple[float, float, float]:
        """Roundings of the output of lag j, of its state in the inverse, and of the answer, in units of signals.

        `given`, `asked`: sizes of the input, and of the output asked for.
        """
        exact, (rate, second, late, inverse) = self.lags[j].exact, self.lags[j].row
        bits, drop = (int(x) for x in self.tables.of("lag").block[j, [lag_fixed.BITS, lag_fixed.DROP]])
        state, scale = 2.0**-bits, 2.0**drop
        sizes = self.lags[j].sizes(given, asked, bool(self.tables.turning))
        kept = state * (0.5 / rate + scale) + 2.0 * given * missed(rate * scale) / scale / rate
        if exact:
            kept += (0.5 * state + 2.0 * given * missed(late * 2.0**bits) / 2.0**bits) / rate
            answer = sizes.state * missed(inverse * 2.0 ** (drop - bits)) * 2.0 ** (bits - drop) + state * scale / late
            return kept + 0.5, kept, answer + 0.5
        product = state * (0.5 + scale * second) + sizes.state * missed(second * scale) / scale
        answer = sizes.state * missed(inverse * 2.0 ** (drop - bits)) * 2.0 ** (bits - drop) + state * scale * inverse
        return 3.0 * kept + product + 0.5, kept + 3.0 * product, answer + 1.0

    def _passed(self, each: Formats, error: float, own: float) -> float:
        """Error of the input that a user's own block is solved for, by an error of its output and a rounding `own`."""
        if self.condition:
            return error / abs(each.linear.forward.d) + own
        return each.linear.passed(error, own)

    @cached_property
    def _gains(self) -> list[Gain]:
        """The gains behind the plays, from there on."""
        lsb, step, ends = float(self.inner.output_lsb), self.largest_step, self.static.input_range
        span = (self.ends[1] - self.ends[0]) / lsb
        size = next((sizes[0] for part in GAINS if (sizes := self.sizes.given[part])), 0.0)
        found = []
        for each in self.parts.blocks["ageing"]:
            begun = 0.5 * float(self.inner.drive_lsb) * abs(ageing.steepness(each, 0.0))  # pieces begin at whole codes
            wrong = ageing.TABLE_ERROR + begun + CUBIC_ERROR
            late = ageing.most_at_once(each, step) + wrong / LEAST_GAIN + RECIPROCAL_ERROR
            found.append(Gain(LEAST_GAIN, LARGEST_GAIN, wrong * size, late * size))
            size *= LARGEST_GAIN
        heats = [one.error for one in self.formats["heat"]]
        linear = [*zip(self.parts.blocks["heat"], heats, strict=True)]
        linear += [(each, DEGREES) for each in self.parts.blocks["gain"]]
        for each, wrong in linear:
            least, largest, offset, at_once = LEAST_GAIN, LARGEST_GAIN, span, 0.0
            if isinstance(each, OwnHeat):
                wrong += thermal.coarseness(each, ends, step, self.seconds)
                at_once = thermal.most_at_once(each, ends, step, self.seconds)
                warmest, least, largest = thermal.reached(each, ends, step, self.seconds)
                offset = warmest * abs(each.offset_per_degree) / lsb
            degree = abs(each.gain_per_degree) * size + abs(each.offset_per_degree) / lsb
            there = wrong * degree + LINEAR_ERROR * size + FACTOR_ERROR * offset
            back = (wrong + at_once) * degree / least + RECIPROCAL_ERROR * size + FACTOR_ERROR * offset / least
            found.append(Gain(least, largest, there, back))
            size = size * largest + offset
        return found

    def _saturation(self) -> tuple[float, float, float]:
        """Saturation: the slope of its inverse at the ends of the output, the error of the inverse, and that of the
        map, in output codes."""
        ends = [end - self.static.output_offset for end in self.ends]
        slope, back, there = 1.0, 0.0, 0.0
        bends = [self.bends[i : i + 2] for i in range(0, len(self.bends), 2)]
        for effect in reversed(self.parts.saturations):
            if isinstance(effect, TanhSaturation):
                onward, backward = bends.pop()
                most = 1.0 - 2.0**-50
                shares = [min(max((end - effect.centre) / effect.level, -most), most) for end in ends]
                share = max(map(abs, shares))
                slope = slope / (1.0 - share * share)
                back = back / (1.0 - share * share) + backward.error(1.0 / (1.0 - share * share)) * self._signal
                there += onward.error(1.0) * self._signal
                ends = [effect.centre + effect.level * math.atanh(each) for each in shares]
            elif isinstance(effect, HardSaturation | Stops):
                give = getattr(effect, "give", 0.0)
                over = 1.0 / give if 0.0 < give < 1.0 else 1.0
                slope, back = slope * over, back * over
                if give:
                    size = max(map(abs, ends)) / float(self.inner.output_lsb)
                    back += (0.5 + over) * self._signal + missed(1.0 / give) * size
                    there += 1.0 * self._signal + missed(give) * self.sizes.output
        return slope, back, there

    # ------------------------------------------------------------ operators

    def _arrival(self) -> tuple[float, float]:
        """Roundings of the signal in front of the plays for the drive as sent, and its change by rounding the drive to
        a code, in units of signals."""
        here = sum(self._lag(j, *sizes)[0] for j, sizes in enumerate(self.in_front["lag"]))
        here += sum(each.output for each in self.ahead)
        here += 0.5 * 2.0**self.finer if self.finer else 0.0
        code = 0.5 * 2.0**self._fine
        if self._kept:
            return here, code + self._kept
        if self.lags:
            rate, theta, _, _ = self.lags[0].row
            return here, code * (1.0 if self.lags[0].exact else rate * (1.0 + 2.0 * theta))
        rounded = bool(self.static.stages or self.ahead) or self._fine > 0
        return here, code * rounded

    @property
    def _kept(self) -> float:
        """How far the input of the plays can be from the one that is sought while the drive stands still."""
        return 2.0 * float(self.tables.number[DITHER]) if self.tables.quiet and not self.condition else 0.0

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
        """Error of the sum of plays that an effect moves or bends, by roundings and by contacts within a step in which
        their input moves by `way`, in codes; and the part of it that the inverse undoes."""
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
        lsb = float(self.inner.output_lsb)
        return (shifted + bumps) / lsb + slopes, (shifted - counting) / lsb

    def _dashpot(self, step: float, way: float) -> float:
        """How far plays with a nonlinear dashpot can be from those of the model: by the table, and because the input
        counts as standing still within a step."""
        t = self.tables.moving
        effect = next(filter(dashpot.nonlinear, self.parts.plays))
        seen = float(t.seen[0]) / 2.0 ** int(t.seen[1])
        return yield_error(t, effect, self.static, self.seconds, step, way) + seen * way

    @cached_property
    def _steepest(self) -> float:
        """Largest change of the sum of the plays per change of their input, at all samples."""
        first, *others = map(abs, self.static.pi.weights)
        dilated = self.tables.moving.moves == DILATED
        if not dilated and not self.bumps.curves:
            return float(self.static.pi.slopes[-1])
        more = (p * (1.0 + 2.0 * wider * dilated) for p, (wider, _) in zip(others, self._shares, strict=True))
        return float(first + self._bent * math.fsum(more))

    def _plays(self, arriving: float, way: float | None = None) -> float:
        """Error of the sum of the plays, in output codes, for an error in front of the memoryless part; `way` as
        `_way`, which is taken if none is given."""
        steep = self.static.front_slopes[1] * self._steepest / float(self.inner.output_lsb)
        level = 0.5 * self._signal if self.drop else 0.0
        moved, _ = self._moved(self._way if way is None else way)
        return self._bent * float(self.inner.sum_error()) + moved + steep * arriving * self._arriving + level

    def forward(self) -> float:
        """Bound of the forward operator, in output codes."""
        short = float(self.inner.drive_short() / self.inner.drive_lsb) * 2.0**self._fine
        waited = 0.5 * 2.0**self._fine * bool(self.tables.of("delay").samples and self.tables.of("delay").share[0])
        error = self._plays(self._arrival()[0] + short + waited + self.slewed * 2.0**self._fine)
        if (self.lags or self.ahead) and self.static.branches_differ:  # the front may settle on either branch
            error += self.static.pi.slopes[-1] * self.static.branch_gap / float(self.inner.output_lsb)
        for j, numbers in enumerate(self.creeps):
            error = error * numbers.rest + self._creep(j)
        for each in self.behind:
            error = error * each.linear.forward.largest + each.output * self._signal
        for gain in self._gains:
            error = gain.largest * error + gain.there + self._signal
        for mode, size, row in zip(self.ones["mode"], self.sizes.given["mode"], self.tables.of("mode"), strict=True):
            scale = 2.0**self.bits
            error = error * mode.largest + resonance_fixed.rounding(mode, row, size * scale) / scale
        beside = self._saturation()[2] + 0.5 + (1.0 + self.drifted) * self._signal
        return upward(Fraction(SECOND_ORDER * (error + beside) + DOUBLE * self.sizes.output))

    def _asked(self) -> float:
        """Error of the sum that the inverse asks of the plays, in output codes."""
        slope, back, _ = self._saturation()
        low, high = (end / float(self.inner.output_lsb) for end in self.ends)
        limits = self.tables.limits
        short = max(high - float(limits[3]), float(limits[2]) - low, 0.0)
        error = slope * (short + (1.0 + self.drifted) * self._signal) + back
        if self.taps:
            size = max(self.sizes.undone)
            own = sum(missed(weight) * size + 0.5 * self._signal for weight in self.taps)
            error = error * math.fsum(map(abs, self.taps)) + own
        for gain in reversed(self._gains):
            error = error / gain.least + gain.back + 0.5 * self._signal * (1.0 + 1.0 / gain.least)
        apart = self._plays(self.slewed * 2.0**self._fine) if self.slewed else 0.0  # states behind a slew limit
        seen = apart * math.prod(numbers.rest for numbers in self.creeps)
        seen *= math.prod(max(each.linear.forward.largest, 1.0) for each in self.behind)
        for each in reversed(self.behind):
            states = seen * each.linear.forward.before() + each.output * self._signal
            error = self._passed(each, error + states, each.answer * self._signal)
        for j, numbers in reversed(list(enumerate(self.creeps))):
            states = apart * float(sum(numbers.terms[:, creep.WEIGHT]))
            error = self._creep_gain(numbers) * (error + self._creep(j) + self._creep_back(j) + states)
        return error

    def _residual(self, way: float, solved: float) -> float:
        """Error of the sum of the plays at the input that the inverse finds, in output units, for an error `solved` of
        that input in units of signals; `way` as `_way`."""
        missed_by = self._plays(0.0, way) * float(self.inner.output_lsb) + self._steepest * solved * self._arriving
        for numbers in self.creeps:  # their states have seen the sum of the plays
            missed_by *= numbers.slope * self._creep_gain(numbers)
        for each in self.behind:
            missed_by = self._passed(each, 0.0, missed_by)
        return self._asked() * float(self.inner.output_lsb) + missed_by

    def _solution(self) -> float:
        """Rounding of the input of the plays that is found, in units of signals.

        With bits below it, what remains of the sum is divided by the slope of the plays that follow to that input.
        Others may follow in the rest of a step: the slope is then too small by down to `p_0/sum p`, and of what is then
        more than a step nothing is added.
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
        solved += steep * (code[0] if self.condition else apart)  # both have seen it, or not
        return self._gain() * self._residual(way, solved) / self._arriving

    def _found_error(self, way: float) -> float:
        """The same of the inverse's answer, with what it undoes, or under its `condition`: plays then hold the same,
        and what it finds is off by its own rounding."""
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
        if self.bumps.curves:
            least = least_slope(self.static, self.parts.plays)
        if self.tables.moving.moves == DILATED:
            least = min(least, least_dilated(self.static, self.parts.plays, self.seconds))
        return 1.0 / least / self.static.front_slopes[0]

    def _gain(self) -> float:
        """The same for plays that have seen what each compensator has sent."""
        if self.tables.moving.moves == DILATED:  # bounds are those at once; drives that are held may be farther
            least = least_dilated(self.static, self.parts.plays, self.seconds)
            if self.bumps.curves:
                least = min(least, 0.5 * least_slope(self.static, self.parts.plays))
            return 1.0 / least / self.static.front_slopes[0]
        if self.tables.moving.used:  # as in floating point
            bent = bool(self.bumps.curves)
            least = least_slope(self.static, self.parts.plays) if bent else self.static.pi.weights[0]
            return 2.0 / least / self.static.front_slopes[0]
        return float(self.inner.gain())

    def _led(self, error: float) -> float:
        """The error of the drive for an error in front of the plays, both in units of signals."""
        for j in range(len(self.ahead) - 1, -1, -1):
            code = 0.5 * 2.0**self._fine if j == 0 and not self.lags else 0.5
            error = self._passed(self.ahead[j], error + self.ahead[j].output, self.ahead[j].answer + code)
        for j in range(len(self.lags) - 1, -1, -1):
            exact, (rate, second, late, _) = self.lags[j].exact, self.lags[j].row
            _, kept, answer = self._lag(j, *self.in_front["lag"][j])
            code = 0.5 * 2.0**self._fine if j == 0 else 0.5
            if not exact:  # its states have seen the same drives
                turning = bool(self.tables.turning)
                goal = lag.shifted(second, turning) * error + (1.0 + 2.0 * second) / (1.0 - second) * kept
                error = (goal + kept) / rate + answer + code + 2.0 * float(self.tables.number[DITHER]) * turning
            elif self.condition:
                error = (error + kept) / late + answer + code
            else:
                error = ((2.0 - rate) * (error + kept) + answer * late + late * code) / (late - second)
        return error

    def _codes(self, error: float) -> float:
        """The error of the drive in drive codes, for an error in front of the plays in units of signals."""
        own = SECOND_ORDER * self._led(error + self._kept) / 2.0**self._fine
        whole = float(self.inner.drive[1] - self.inner.drive[0])
        return upward(Fraction(min(own + DOUBLE * whole, whole)))

    def hold(self) -> int:
        """Steps back of the drive that come only from rounding, at most this long, in units of signals."""
        if not self.static.branches_differ or not self.inner.invertible:
            return 0
        # contacts within a step move drives, but do not turn them
        return math.floor(2.0 * (self._found_error(0.0) if self.condition else self._arriving_error(0.0)))

    @property
    def condition(self) -> str:
        """The condition of `rounding` in words, if only the range bounds the difference of two drives; else ""."""
        missed = self.ahead or any(not one.exact for one in self.lags)
        dilated = self.tables.moving.moves == DILATED
        if not (missed or dilated or (self.lags and (not self.reached or self.parts.slew))):
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
        """How far the limits of the drive are off because drives are whole codes: a limited one and the one before."""
        return upward(max(self.inner.drive_short() / self.inner.drive_lsb, Fraction(2.0 * self.slewed)))

    def inverse(self) -> float:
        """Bound of the inverse in drive codes, with the effect of another branch and of limits."""
        if self.condition:
            return float(self.inner.drive[1] - self.inner.drive[0])
        if not self.static.branches_differ:
            return self.rounding()
        gap = self.static.branch_gap
        other = self._gain() * self.static.pi.slopes[-1] * gap + gap / self.static.front_slopes[0]
        return self._codes(self._found_error(self._way) + 1.001 * other / self._arriving)
