"""Fixed-point form of a model: integers, formats, ranges and error bounds.

Everything is computed in fractions from the exact parameters, so that a model gives the same numbers on every machine;
only the curves of the memoryless part are sampled in double precision, with the package's own tanh.

Ranges. The drive is limited to `input_range`, so the input w of the plays, every play and every corner stay between the
extremes of three things: the image of the range, the start memory, and 0, where a reset begins. That bounds every sum.
The format is the finest one in which sums leave one of 64 bits unused, table entries one of 32, and the outputs kept by
corners fit their fields. In q15 these have 47 bits, divided between the input of the plays and the slopes: 26 and 21 or
22. Compared with 30 and 31 bits, that widens the bounds of the oracle's 160 models (seeds 100 to 259) by a median of
0.8 % without a memoryless part and 1.5 % with one, and by more than 2.1 and 3.5 % for a tenth of the models. With 25
bits of input these figures are 0.5 and 1.8 %, 1.4 and 5.5 %; with 27 all are larger.

Errors. The drive as sent is exact. Rounded thresholds and start states shift a play by no more than their own error
(3); rounding in the sums of weights is summed by parts, because adjacent plays differ by no more than their thresholds
do; an output is rounded once. The inverse is as in `hystgen.compensator.bounds`: the exact model, fed the drive as
sent, misses the reference by a residual, and the exact inverse amplifies that by at most `2/p_0 - 1/C_n`.
"""

from __future__ import annotations

import bisect
import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from decimal import ROUND_CEILING, Context, Decimal
from fractions import Fraction
from functools import partial

import numpy as np
from numpy.typing import NDArray

from hystgen.arithmetic import FIXED
from hystgen.basics.problems import FormatError, Path, counted
from hystgen.basics.quantities import decimal
from hystgen.chain.static import StaticModel
from hystgen.compensator.bounds import error_bounds, largest_sum
from hystgen.compensator.layout import FixedTables, first_moves
from hystgen.front.curve import HALF
from hystgen.front.dead_zone.model import DeadZone
from hystgen.front.tanh.model import TanhEnvelope
from hystgen.plays import slots
from hystgen.plays.slots import LimitTable

SUM_BITS = 62
"""Bits of a sum of products, excluding its sign: 64 bits then hold the difference of two such sums."""

TABLE_MAX = 2**31 - 1
"""Largest table entry, an int32_t in C."""

MOST_PIECES = 2000
"""[pieces] Maximum per curve: this many cubic pieces take 42 kB of flash, more than the smallest cores have."""

FAR = 2.0**40
"""[steps of the plays' input] Represents infinity: inputs of plays have 31 bits."""


@dataclass(frozen=True)
class Format:
    """The meaning of a model's codes, and its accuracy.

    `drive_lsb`, `output_lsb`: physical units per code; `forward_error` in output codes, `inverse_error` in drive codes
    (None: no inverse), `inverse_rounding`: the part of it on the same branch; `largest_sum`: bound on every sum, below
    2^62; `largest_held`: bound on every output that a corner keeps; `sum_bits`: bits of a sum below an output code.
    """

    drive_lsb: Fraction
    output_lsb: Fraction
    forward_error: float
    inverse_error: float | None
    inverse_rounding: float | None
    largest_sum: int
    largest_held: int
    sum_bits: int


def build(
    cascade: StaticModel, arithmetic: str, engine: str, drive_lsb: float | None = None, output_lsb: float | None = None
) -> tuple[FixedTables, Format]:
    """Tables of `cascade` in 'q31' or 'q15', and the meaning of its codes.

    Raises FormatError if a given LSB does not fit the type or the model degenerates in the format.
    """
    found = lsbs(cascade, arithmetic, drive_lsb, output_lsb)
    return Builder(cascade, arithmetic, engine, found, (drive_lsb is not None, output_lsb is not None)).build()


def nearest(x: Fraction | float) -> int:
    """Nearest whole number, ties away from zero; exact for floats too."""
    size: Fraction | float = -x if x < 0 else x
    whole = math.floor(size)
    if 2 * (size - whole) >= 1:
        whole += 1
    return whole if x >= 0 else -whole


def reciprocal(slope: int) -> tuple[int, int]:
    """`2^(32 + shift)/slope` and the shift; 0 for the slope 0, which is never used."""
    if slope <= 0:
        return 0, 1
    shift = slope.bit_length() + 30
    found = nearest(Fraction(2**shift, slope))
    if found > TABLE_MAX:
        shift, found = shift - 1, nearest(Fraction(2 ** (shift - 1), slope))
    return found, shift - 32


def lsbs(
    cascade: StaticModel, arithmetic: str, drive_lsb: float | None = None, output_lsb: float | None = None,
    output_range: tuple[float, float] | None = None,
) -> tuple[Fraction, Fraction]:
    """Physical units per drive code and per output code: as given, else the finest that cover the ranges.

    `output_range`: the range of a model with effects. Raises FormatError if an LSB is too small or the output stays 0.
    """
    code_max = FIXED[arithmetic].code_max
    found: list[Fraction] = []
    refused: list[tuple[Path, str]] = []
    for given, ends, what, key in (
        (drive_lsb, cascade.input_range, "input_range", "drive_lsb"),
        (output_lsb, output_range or cascade.output_range, "the output range", "output_lsb"),
    ):
        largest = max(abs(decimal(end)) for end in ends)
        finest = largest / code_max
        lsb = finest if given is None else decimal(given)
        if lsb == 0:
            stays = "no play moves over this range of the drive, and the output stays 0; widen the range"
            refused.append((("input_range",), stays))
        if lsb < finest:
            refused.append((
                ("emit", key),
                f"{given:g} is too small: {what} reaches {float(largest):.6g}, which takes at least "
                f"{_rounded_up(finest)}; raise it or leave it out",
            ))
        found.append(lsb)
    if refused:
        raise FormatError(*refused)
    return found[0], found[1]


def _rounded_up(x: Fraction) -> str:
    """A positive number rounded up to six digits."""
    up = Context(prec=6, rounding=ROUND_CEILING)
    return f"{float(up.divide(Decimal(x.numerator), Decimal(x.denominator))):.6g}"


class Builder:
    """The steps of `build`, each of which uses the results of those before it.

    `given`: which LSBs the user set; `beyond`: how far beyond its range the input of the plays can be requested, in
    spans; `led`: whether signals in front of the memoryless part have bits below a drive code, as behind a lag; `bent`:
    the most that an effect adds to a play's contribution, in units of the play's input.
    """

    def __init__(
        self, cascade: StaticModel, arithmetic: str, engine: str, lsb: tuple[Fraction, Fraction],
        given: tuple[bool, bool], beyond: int = 0, led: bool = False, bent: float = 0.0,
    ) -> None:
        self.cascade, self.arithmetic, self.engine = cascade, arithmetic, engine
        self.code_max = FIXED[arithmetic].code_max
        self.play_bits = FIXED[arithmetic].play_bits
        self.drive_lsb, self.output_lsb = lsb
        self.given = dict(zip(("drive_lsb", "output_lsb"), given, strict=True))
        self.beyond, self.led, self.bent = beyond, led, bent
        self.invertible = not cascade.inverse_problems()
        self.refused: list[tuple[Path, str]] = []

    def build(self) -> tuple[FixedTables, Format]:
        self._codes()
        self._plays()
        self._weights()
        return self._tables(), Format(
            self.drive_lsb, self.output_lsb, self._forward_error(), self._inverse_error(), self._inverse_rounding(),
            self.bound, self.held, self.bits,
        )

    def gain(self) -> Fraction:
        """Largest change of the drive in front of the memoryless part per change of the wanted sum of the plays."""
        return (2 / Fraction(self.cascade.pi.weights[0]) - 1 / Fraction(self.cascade.pi.slopes[-1])) / Fraction(
            self.cascade.front_slopes[0]
        )

    def solved(self) -> Fraction:
        """Rounding of the plays' input as solved for, in physical units."""
        travel = self.hull[1] - self.hull[0]
        return self.step * (Fraction(1, 2) + Fraction(travel, 2**31) + Fraction(1, 2**8))

    def back(self) -> Fraction:
        """Error of the inverse of the memoryless part, in units of its input."""
        return Fraction(max((curve.error / 2**curve.below for curve in self.front[2:]), default=0.0))

    # ------------------------------------------------------------ codes

    def _codes(self) -> None:
        low, high = (decimal(end) / self.drive_lsb for end in self.cascade.input_range)
        self.drive = (math.ceil(low), math.floor(high))
        low, high = (decimal(end) / self.output_lsb for end in self.cascade.output_range)
        # rounding in double precision may have moved an end off its code; allow 2^-50, or 8 roundoffs, but at most a
        # thousandth of a code, in case the terms of a sum cancel
        size = Fraction(largest_sum(self.cascade)) + abs(Fraction(self.cascade.output_offset))
        slack = min(size / 2**50 / self.output_lsb, Fraction(1, 1024))
        self.output = (math.ceil(low - slack), math.floor(high + slack))
        for (first, last), key, far in (
            (self.drive, "drive_lsb", ("input_range",)),
            (self.output, "output_lsb", ("model", "output_offset")),
        ):
            if last - first < 2:
                left = counted(max(last - first + 1, 0), "code")
                advice = "move it nearer to 0 or use a finer arithmetic"
                self.refused.append(
                    (("emit", key), f"leaves {left} in range; make it smaller")
                    if self.given[key]
                    else (far, f"lies so far from 0 that {self.arithmetic} has {left} for the range; {advice}")
                )
        if self.refused:
            raise FormatError(*self.refused)

    def _finer(self, key: str) -> str:
        """Advice for codes that are too coarse; unless the user set an LSB, they are already the finest possible."""
        return f"use {f'a smaller emit.{key} or ' if self.given[key] else ''}a finer arithmetic"

    # ------------------------------------------------------------ the input of the plays

    def _plays(self) -> None:
        """The step of w, and thresholds, start states and curves in units of it."""
        c, pi = self.cascade, self.cascade.pi
        # where plays can be: in the range of their input, at the start memory, or at 0 after a reset
        low = min(Fraction(c.play_range[0]), *(Fraction(s) for s in pi.start), Fraction(0))
        high = max(Fraction(c.play_range[1]), *(Fraction(s) for s in pi.start), Fraction(0))
        self.span = high - low
        reach = max(abs(low), abs(high)) + 2 * min(self.span, Fraction(pi.thresholds[-1]))
        below = FIXED[self.arithmetic].finer_plays
        if c.stages:
            self.fine = 0
            if below and self.led:
                self.fine = max(0, self.play_bits - max(map(abs, self.drive)).bit_length())
            self.step = Fraction(2) ** (math.ceil(math.log2(reach)) - self.play_bits)
        else:
            self.fine = 0
            if below:
                self.fine = max(0, math.floor(math.log2((1 << self.play_bits) / (reach / self.drive_lsb))))
            self.step = self.drive_lsb / 2**self.fine

        states = [nearest(Fraction(s) / self.step) for s in pi.start]
        if c.stages:
            cap = math.floor(self.span / self.step) + 8  # rounding in the curves can add 8 steps
        else:
            cap = max(self.drive[1] << self.fine, *states, 0) - min(self.drive[0] << self.fine, *states, 0)
        # no input is farther than `cap` from a play, so a play with that threshold never moves
        self.threshold = [min(nearest(Fraction(r) / self.step), cap) for r in pi.thresholds]
        self.still = max(bisect.bisect_left(self.threshold, cap), 1)
        for i in range(2, self.still):
            room = self.threshold[i] - self.threshold[i - 1]
            states[i] = min(max(states[i], states[i - 1] - room), states[i - 1] + room)
        if len(states) > 1:
            states[0] = states[1]
        if self.still < len(states):
            self._hold(states)
        if self.threshold[-1] > TABLE_MAX:
            needed = next(i for i, r in enumerate(pi.thresholds) if nearest(Fraction(r) / self.step) > TABLE_MAX)
            message = f"{pi.thresholds[needed]:g} does not fit {self.arithmetic}; use a larger emit.drive_lsb"
            raise FormatError((("model", "pi", "thresholds", needed), message))
        narrow = self.drive_lsb * Fraction(c.front_slopes[0]) if c.stages and self.invertible else self.drive_lsb
        finer = self._finer("drive_lsb")
        for i, (a, b) in enumerate(itertools.pairwise(self.threshold), 1):
            if b < cap and (a == b or Fraction(pi.thresholds[i]) < (narrow if not c.stages else self.step)):
                self.refused.append((
                    ("model", "pi", "thresholds", i),
                    f"{pi.thresholds[i]:g} is "
                    + (f"not above thresholds[{i - 1}]" if i > 1 and a == b else "narrower than one code")
                    + f" in {self.arithmetic} with {float(self.drive_lsb):.6g} a drive code; "
                    f"{finer}, or leave this play out",
                ))
        if max(map(abs, states)) > TABLE_MAX:
            message = (
                f"reaches {max(map(abs, pi.start)):g}, beyond {self.arithmetic}; start nearer to the range, use a "
                "larger emit.drive_lsb or float32"
            )
            raise FormatError((("model", "pi", "initial_state"), message))
        self.start = states
        self._curves()
        self.hull = (min(self.play[0], *states, 0), max(self.play[1], *states, 0))  # where plays can be

    def _hold(self, states: list[int]) -> None:
        """Put all plays that never move at their weighted mean, which leaves their contribution unchanged.

        Their thresholds, cut to fit, may leave too little room for their start states, so they are widened until the
        mean is admissible next to the previous play; if the type is too narrow for that, the mean is limited.
        """
        pi, k = self.cascade.pi, self.still
        weights = [Fraction(p) for p in pi.weights[k:]]
        total = sum(weights)
        terms = zip(weights, pi.start[k:], strict=True)
        self.mean = sum((p * Fraction(s) for p, s in terms), Fraction(0)) / total if total else Fraction(pi.start[k])
        state = nearest(self.mean / self.step)
        wide = max(self.threshold[k], min(self.threshold[k - 1] + abs(state - states[k - 1]), TABLE_MAX))
        room = wide - self.threshold[k - 1]
        state = min(max(state, states[k - 1] - room), states[k - 1] + room)
        states[k:] = [state] * len(weights)
        self.threshold[k:] = [wide] * len(weights)

    def _curves(self) -> None:
        c = self.cascade
        self.front: list[FixedCurve] = []
        self.arguments: list[tuple[int, int]] = []
        arriving = (self.drive[0] << self.fine, self.drive[1] << self.fine)
        if not c.stages:
            self.play = arriving
            self.margin = max(1 << self.fine, self.beyond * (self.play[1] - self.play[0]))
            return
        lsb, step = float(self.drive_lsb / 2**self.fine), float(self.step)
        degree = FIXED[self.arithmetic].degree
        # a curve's own error: a 64th of a code, or the rounding error if codes are that fine
        allowed = max(0.5 * step, lsb * c.front_slopes[0] / 64)
        breaks = _breaks(c)
        for ascending in (True, False):
            corners = [b / lsb for b in breaks[ascending]]
            self.front.append(
                FixedCurve(partial(_forward, c, ascending, lsb, step), arriving, corners, degree, allowed / step)
            )
        ends = [(curve.at(arriving[0]), curve.at(arriving[1])) for curve in self.front]
        self.play = (min(e[0] for e in ends) - 8, max(e[1] for e in ends) + 8)
        self.margin = 8
        for up in (True, False):
            bottom, top = (math.floor(min(max(end / step, -FAR), FAR)) for end in _envelope_ends(c, up))
            self.arguments.append((bottom, top))
            if top < FAR:  # far enough to detect an input beyond the envelope
                noticed = max(top - self.play[1], self.play[0] - bottom)
                self.margin = max(self.margin, min(noticed, 1 << self.play_bits) + 2)
        self.arguments *= 2
        for forward, (low, high) in zip(self.front[:2], ends, strict=True):
            self.margin = max(self.margin, 4 * (high - low) // max(1, arriving[1] - arriving[0]))
            if not self.invertible:
                continue
            ascending = len(self.front) == 2
            below = max(0, self.play_bits - max(map(abs, arriving)).bit_length())
            corners = [float(c.front(float(b), ascending)) / step for b in breaks[ascending]]
            edge = (
                max(1, abs(forward.at(arriving[0] + 1) - low) // 2),
                max(1, abs(high - forward.at(arriving[1] - 1)) // 2),
            )
            scale = lsb / 2**below
            back = partial(_backward, c, ascending, step, scale)
            self.front.append(FixedCurve(back, (low, high), corners, degree, max(0.5, 2**below / 64), below, edge))

    # ------------------------------------------------------------ weights and sums

    def _weights(self) -> None:
        """Fraction bits of a sum, rounded sums of weights, and a bound on every sum."""
        pi = self.cascade.pi
        gain = [Fraction(p) * self.step / self.output_lsb for p in pi.weights]
        sums = [Fraction(0), *itertools.accumulate(gain)]
        offset = Fraction(self.cascade.output_offset) / self.output_lsb
        largest = max(map(abs, self.hull)) + 1
        travel = self.play[1] - self.play[0]
        bent = math.ceil(Fraction(self.bent) / self.step)
        low_bits = FIXED[self.arithmetic].low_bits
        finer = self._finer("output_lsb")
        for i, g in enumerate(gain):
            if g > 0 and g * travel < Fraction(1, 2):
                self.refused.append((
                    ("model", "pi", "weights", i),
                    f"{pi.weights[i]:g} moves the output by less than half a code of {float(self.output_lsb):.6g}; "
                    f"{finer}, or leave the play out",
                ))
        if self.refused:
            raise FormatError(*self.refused)
        for bits in range(56, 0, -1):
            slope = [nearest(s * 2**bits) for s in sums]
            weight = [b - a for a, b in itertools.pairwise(slope)]
            lift = [0, *itertools.accumulate(p * r for p, r in zip(weight, self.threshold, strict=True))]
            span = largest + 2 * self.threshold[-1] + self.beyond * travel + bent
            bound = slope[-1] * span + 2 * lift[-1] + abs(nearest(offset * 2**bits)) + ((self.code_max + 1) << bits)
            held = slope[-1] * (largest + self.threshold[-1]) + abs(nearest(offset * 2**bits))
            if slope[-1] <= TABLE_MAX and bound < 2**SUM_BITS and held < 2 ** (31 + low_bits):
                break
        else:
            message = f"the sums of the model do not fit {self.arithmetic}; use a larger one"
            raise FormatError((("emit", "output_lsb"), message))
        self.bits, self.slope, self.weight, self.lift, self.bound, self.held = bits, slope, weight, lift, bound, held
        self.offset = nearest(offset * 2**bits)
        if min(weight) < 0 or (self.invertible and slope[1] < 16):
            message = f"{pi.weights[0]:g} is too small next to the others for {self.arithmetic}"
            raise FormatError((("model", "pi", "weights", 0), message + "; use a finer arithmetic"))
        self.slope_errors = [abs(Fraction(k, 2**bits) - s) for k, s in zip(slope, sums, strict=True)]
        self.offset_error = abs(Fraction(self.offset, 2**bits) - offset)
        self.reciprocal, self.shift = map(list, zip(*map(reciprocal, slope), strict=True))

    # ------------------------------------------------------------ results

    def _tables(self) -> FixedTables:
        c = self.cascade
        limits = LimitTable.zeros(1)
        limits.drive.low[0], limits.drive.high[0] = self.drive
        limits.output.low[0], limits.output.high[0] = self.output
        limits.offset[0] = self.offset
        far = 2 * max(map(abs, c.input_range))  # has the effect of any drive beyond the range, and is finite

        def code(v: float) -> Fraction:
            return Fraction(min(max(v, -far), far)) / self.drive_lsb

        applied, ascending = first_moves(
            c, self.drive, lambda v: (math.floor(code(v)), code(v).denominator == 1), lambda v: nearest(code(v))
        )
        if c.branches_differ and self.invertible:
            limits.hold[0] = math.floor(2 * (self._inverse_rounding() or 0))
        limits.real_max[0] = 2**SUM_BITS
        limits.play.low[0], limits.play.high[0] = self.play
        limits.margin[0], limits.fraction[0] = self.margin, self.bits
        limits.fine[0], limits.code_max[0] = self.fine, self.code_max
        limits.saturated[0] = self._saturated()
        # half a drive code and the error of a reciprocal, in output codes on the steepest piece
        limits.shy[0] = (max(self.slope) * ((2**self.fine + 1) // 2 + 8) >> self.bits) + 2
        curves = self.front
        pieces = [piece for curve in curves for piece in curve.pieces]

        levels = [t * k - q for t, k, q in zip(self.threshold, self.slope, self.lift, strict=False)]

        def whole(values: Sequence[float]) -> NDArray[np.int64]:
            return np.array(values, dtype=np.int64)

        return FixedTables(
            threshold=whole(self.threshold),
            weight=whole(self.weight),
            slope=whole(self.slope),
            start_level=whole(levels),
            way=whole([*(2 * r for r in self.threshold), 2**32 - 1]),
            reach=whole([*(2 * z for z in levels), 2**SUM_BITS]),
            reciprocal=whole(self.reciprocal),
            shift=whole(self.shift),
            start=whole(self.start if len(set(self.start)) > 1 else self.start[:1]),
            zero=whole([0]),
            limits=limits,
            applied=whole(applied),
            ascending=whole(ascending),
            knot=whole([piece.knot for piece in pieces]),
            coefficient=np.array([piece.coefficients for piece in pieces] or np.zeros((0, 1)), dtype=np.int64),
            scale=whole([piece.scale for piece in pieces]),
            first=whole([0, *itertools.accumulate(len(curve.pieces) for curve in curves)][: len(curves)]),
            pieces=whole([len(curve.pieces) for curve in curves]),
            domain=np.array([curve.domain for curve in curves], dtype=np.int64).reshape(-1, 2),
            edge=np.array([curve.edge for curve in curves], dtype=np.int64).reshape(-1, 2),
            argument=np.array(self.arguments or np.zeros((0, 2)), dtype=np.int64),
            below=whole([curve.below for curve in curves]),
            engine=slots.CORNERS if self.engine == "corners" else slots.LOOP,
            branches=int(c.branches_differ),
            fronts=int(bool(c.stages)),
        )

    def _saturated(self) -> int:
        """Size of an output code above which limiting it to the type is reported.

        Outputs after `init` fit the type except for rounding; outputs after `reset` may not.
        """
        largest = max(abs(Fraction(y)) for y in self.cascade.reset_range) / self.output_lsb
        reported: int = self.code_max if largest > self.code_max + Fraction(1, 2) else 2**SUM_BITS
        return reported

    def _play_errors(self) -> list[Fraction]:
        """Largest error of each play against the exact model, in physical units of w.

        Plays that never move are held at their mean; in the exact model such a play can move by `span - r`.
        """
        pi = self.cascade.pi
        front = self.step * Fraction(max((curve.error for curve in self.front[:2]), default=0.0))
        errors = []
        for i, (r, t) in enumerate(zip(pi.thresholds, self.threshold, strict=True)):
            if i < self.still:
                begun = abs(self.start[i] * self.step - Fraction(pi.start[i])) if i else Fraction(0)
                errors.append(max(front + abs(t * self.step - Fraction(r)), begun))
            else:
                moved = max(self.span - Fraction(r), Fraction(0))
                errors.append(abs(self.start[i] * self.step - self.mean) + moved)
        return errors

    def sum_error(self) -> Fraction:
        """Largest error of a sum, before it is rounded to a code, against the exact model's output, in output codes."""
        pi = self.cascade.pi
        plays = sum(Fraction(p) * e for p, e in zip(pi.weights, self._play_errors(), strict=True)) / self.output_lsb
        travel = self.hull[1] - self.hull[0]
        weights = self.slope_errors[-1] * max(map(abs, self.hull))
        for k, (a, b) in enumerate(itertools.pairwise(self.threshold), 1):
            weights += self.slope_errors[k] * min(b - a, travel)
        return plays + weights + self.offset_error

    def _own_error(self) -> tuple[Fraction, Fraction]:
        """Rounding error of the double model itself on one branch: forward in output units, inverse in drive units."""
        own = error_bounds(self.cascade, "float64", "corners")
        return Fraction(own.forward), Fraction(own.rounding) if math.isfinite(own.rounding) else Fraction(0)

    def drive_short(self) -> Fraction:
        """Larger of the distances of the first and the last drive code from the range's ends, in drive units."""
        (first, last), (low, high) = self.drive, self.cascade.input_range
        return max(Fraction(high) - last * self.drive_lsb, first * self.drive_lsb - Fraction(low), Fraction(0))

    def _forward_error(self) -> float:
        # a code beyond the range is limited to the last code inside, the exact model's drive to the end of the range
        limited = Fraction(self.cascade.pi.slopes[-1]) * Fraction(self.cascade.front_slopes[1]) * self.drive_short()
        return upward(
            self.sum_error() + Fraction(1, 2) + (limited + self._own_error()[0]) / self.output_lsb
        )

    def _inverse_rounding(self) -> float | None:
        if not self.invertible:
            return None
        c, pi = self.cascade, self.cascade.pi
        steepest = Fraction(c.front_slopes[1])
        # rounding of the solution: its input of the plays, then the drive code
        solved = self.solved()
        code = Fraction(1, 2) + self.back() if c.stages or self.fine else Fraction(0)
        outer = Fraction(pi.slopes[-1])
        output_short = max(
            Fraction(c.output_range[1]) - self.output[1] * self.output_lsb,
            self.output[0] * self.output_lsb - Fraction(c.output_range[0]),
            Fraction(0),
        )
        residual = (
            self.sum_error() * self.output_lsb
            + outer * (solved + steepest * (code * self.drive_lsb + self.drive_short()))
            + output_short
        )
        whole = Fraction(self.drive[1] - self.drive[0])
        return upward(min((self.gain() * residual + self._own_error()[1]) / self.drive_lsb, whole))

    def _inverse_error(self) -> float | None:
        """`_inverse_rounding`, plus the effect of taking another branch, as in `hystgen.compensator.bounds`."""
        rounding = self._inverse_rounding()
        if rounding is None or not self.cascade.branches_differ:
            return rounding
        pi, gap, flattest = self.cascade.pi, self.cascade.branch_gap, self.cascade.front_slopes[0]
        gain = (2.0 / pi.weights[0] - 1.0 / pi.slopes[-1]) / flattest
        other = (gain * pi.slopes[-1] * gap + gap / flattest) / float(self.drive_lsb)
        return min(rounding + math.nextafter(1.001 * other, math.inf), float(self.drive[1] - self.drive[0]))


def _forward(cascade: StaticModel, ascending: bool, lsb: float, step: float, code: float) -> float:
    return float(cascade.front(code * lsb, ascending)) / step


def _backward(cascade: StaticModel, ascending: bool, step: float, scale: float, w: float) -> float:
    return float(cascade.front_inverse(w * step, ascending)) / scale


def upward(x: Fraction) -> float:
    return math.nextafter(float(x) * 1.001, math.inf)


def _breaks(cascade: StaticModel) -> dict[bool, list[float]]:
    """Drives at the kinks of the memoryless part, for each branch. Raises FormatError if there are too many."""
    found: dict[bool, list[float]] = {}
    for ascending in (True, False):
        if not ascending and not cascade.branches_differ:
            found[ascending] = found[True]
            continue
        inside = [
            (j, b)
            for j, (stage, (low, high)) in enumerate(
                zip(cascade.stages, cascade.stage_ranges(ascending), strict=True)
            )
            if isinstance(stage, DeadZone)
            for b in stage.breaks
            if low < b < high
        ]
        if len(inside) > MOST_PIECES:
            what = f"has {len(inside)} kinks inside input_range, and fixed point takes at most {MOST_PIECES}"
            raise FormatError((("model", "memoryless"), f"{what}; thin out the thresholds or use float32"))
        found[ascending] = sorted(_drive_at(cascade, j, b, ascending) for j, b in inside)
    return found


def _envelope_ends(cascade: StaticModel, ascending: bool) -> tuple[float, float]:
    """The values of w at which the last envelope saturates; infinite without an envelope."""
    last = max((j for j, stage in enumerate(cascade.stages) if isinstance(stage, TanhEnvelope)), default=None)
    if last is None:
        return -math.inf, math.inf
    envelope = cascade.stages[last]
    assert isinstance(envelope, TanhEnvelope)
    a0, _, _, a3 = envelope.branch(ascending)
    ends = []
    for x in (a3 - abs(a0), a3 + abs(a0)):
        for stage in cascade.stages[last + 1 :]:
            x = float(stage.forward(x, ascending))
        ends.append(x)
    return ends[0], ends[1]


def _drive_at(cascade: StaticModel, j: int, value: float, ascending: bool) -> float:
    """Drive at which the input of stage j has a value; every stage before it rises, or the model is refused."""
    low, high = cascade.input_range
    for _ in range(200):
        middle = (low + high) / 2
        if middle in (low, high):  # no double lies between them
            break
        x = middle
        for stage in cascade.stages[:j]:
            x = float(stage.forward(x, ascending))
        if x < value:
            low = middle
        else:
            high = middle
    return (low + high) / 2


@dataclass(frozen=True)
class _Piece:
    knot: int
    scale: int
    coefficients: tuple[int, ...]


class FixedCurve:
    """A function of integers as a piecewise polynomial; `error`: largest difference between it and the function.

    It interpolates at the Chebyshev points of ever shorter pieces until the sampled error is at most `allowed`.
    `corners`: arguments of kinks; `below`: bits of a value below a code; `edge`: how far a rounded argument can leave
    the domain.
    """

    def __init__(
        self, function: Callable[[float], float], domain: tuple[int, int], corners: Sequence[float], degree: int,
        allowed: float, below: int = 0, edge: tuple[int, int] = (0, 0),
    ) -> None:
        self.function, self.domain, self.below, self.edge, self.degree = function, domain, below, edge, degree
        self.pieces: list[_Piece] = []
        self.fit_error = 0.0
        low, high = domain
        knots = {low, high + 1}
        for corner in corners:
            knots.update(k for k in (math.floor(corner), math.floor(corner) + 1) if low < k <= high)
        knots.update(range(low, high + 1, max(1, (high + 1 - low + 3) // 4)))  # no coefficient is wider than a value
        todo = list(itertools.pairwise(sorted(knots)))[::-1]
        while todo:
            a, b = todo.pop()
            piece, miss = self._fit(a, b, allowed)
            if b - a > 1 and (miss > allowed or sum(map(abs, piece.coefficients[1:])) + degree > TABLE_MAX):
                if len(self.pieces) + len(todo) > MOST_PIECES:
                    message = "bends too sharply for fixed point over input_range; narrow the range or use float32"
                    raise FormatError((("model", "memoryless"), message))
                middle = (a + b) // 2
                todo += [(middle, b), (a, middle)]
                continue
            self.fit_error = max(self.fit_error, miss)
            self.pieces.append(piece)
        # each coefficient and each product is rounded; errors between the samples are allowed a quarter more
        self.error = 1.25 * self.fit_error + degree + 0.5

    def _fit(self, a: int, b: int, allowed: float) -> tuple[_Piece, float]:
        """The piece from a up to b, and its largest sampled error, or the first one above `allowed`."""
        if b - a == 1:
            first = round(self.function(float(a)))
            kept = _kept(first)
            return _Piece(a, 30, (kept, *(0,) * self.degree)), float(abs(first - kept))
        scale = 31 - (b - a).bit_length()
        whole = float(2 ** (31 - scale))
        length = (b - 1 - a) / whole  # the last argument, in the variable of the polynomial
        nodes = [length * (0.5 - 0.5 * x) for x in _NODES[self.degree]]
        c = _monomials(nodes, [self.function(a + h * whole) for h in nodes])
        miss = 0.0
        for i in range(SAMPLES):
            h = length * i / (SAMPLES - 1)
            value = 0.0
            for coefficient in reversed(c):
                value = coefficient + h * value
            miss = max(miss, abs(self.function(a + h * whole) - value))
            if miss > allowed:
                break
        first, *others = map(round, c)
        kept = _kept(first)
        return _Piece(a, scale, (kept, *others)), miss + abs(first - kept)

    def at(self, x: int) -> int:
        """Value at x, as the kernel computes it."""
        piece = next(piece for piece in reversed(self.pieces) if piece.knot <= x)
        h = (x - piece.knot) << piece.scale
        y = 0
        for c in reversed(piece.coefficients):
            y = c + ((y * h + HALF) >> 31)
        return y


def _kept(value: int) -> int:
    """The nearest number of the tables' type: rounding at an end of the drive's range can overshoot its last code."""
    return min(max(value, -TABLE_MAX), TABLE_MAX)


SAMPLES = 25  # points at which a piece's error is evaluated, including both ends
_NODES = {  # cos of the odd multiples of pi / (2 degree + 2), written out: libraries differ in the last bit
    3: (0.9238795325112867, 0.3826834323650898, -0.3826834323650898, -0.9238795325112867),
    5: (0.9659258262890683, 0.7071067811865476, 0.25881904510252074,
        -0.25881904510252074, -0.7071067811865476, -0.9659258262890683),
}  # fmt: skip


def _monomials(x: Sequence[float], y: Sequence[float]) -> list[float]:
    """Coefficients from degree 0 of the polynomial through the points, by divided differences."""
    n = len(x)
    d = list(y)
    for j in range(1, n):
        for i in range(n - 1, j - 1, -1):
            d[i] = (d[i] - d[i - 1]) / (x[i] - x[i - j])
    c = [d[-1]] + [0.0] * (n - 1)
    for i in range(n - 2, -1, -1):
        c = [d[i] - x[i] * c[0], *(c[k - 1] - x[i] * c[k] for k in range(1, n))]
    return c
