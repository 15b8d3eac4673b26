"""Fixed-point form of a model with effects: signals, ranges and constants as integers.

Signals in front of the plays are in units of the plays' input, which is a drive code or finer; signals behind the plays
have `LEVEL_BITS` bits below an output code. Every signal is bounded here, by intervals propagated forwards from the
drive and backwards from the reference, and gets as many bits as a product can take (`LARGEST`). States of filters get
enough additional bits to keep the slowest state from stalling. No sum or product can overflow, in whatever order calls
are made; a model that does not fit is refused.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable
from fractions import Fraction
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from hystgen.arithmetic import FIXED
from hystgen.arithmetic.factors import LARGEST, factor
from hystgen.basics.problems import FormatError
from hystgen.chain.chain import Chain
from hystgen.compensator.chain import moving
from hystgen.compensator.chain.fixed_bounds import Bend, Bounds, Sizes
from hystgen.compensator.chain.layout import (
    MOST_SLEWED,
    REST_BITS,
    VERIFIED_SHARE,
    ChainTables,
    Codes,
    Compiled,
    FixedChainNumbers,
    FixedChainTables,
    OwnChainTables,
    ahead_of,
    braked,
    crossing,
    fastest,
    hold,
    lead,
    output_range,
    quiet,
    rates,
    read,
    too_slow,
)
from hystgen.compensator.chain.moving import Bumps
from hystgen.compensator.chain.parts import AHEAD, BEHIND, LED, NAMES, PARTS, Parts
from hystgen.compensator.fixed_tables import TABLE_MAX, Builder, FixedCurve, lsbs, nearest
from hystgen.compensator.layout import FixedTables
from hystgen.effects import bend
from hystgen.effects.maps import FixedStops, MapTables, Wanted
from hystgen.effects.part import ChainPart, FixedSurroundings, Margin
from hystgen.effects.plays import FixedMovingTables
from hystgen.parameters.schema import Compensation
from hystgen.plays import slots
from hystgen.plays.slots import LimitTable

M = TypeVar("M")

TEMPERATURE_BITS = {15: 7, 31: 22}
"""Fraction bits of a temperature in degC, by the width of a code in bits: the range is +-256 or +-512 degrees."""

BEYOND = 7
"""Maximum number of spans by which the input asked of plays behind a lag may exceed its range: 8 spans of 2^26 steps
and a sign fit in 32 bits."""

MOST_FINER = 16
"""Maximum bits of a signal in front of the plays below their input: division by a 31-bit slope then fits in 64 bits."""

BEND_BITS = 30
"""Bits of the arguments and values of a curve, excluding their sign."""


def build(
    chain: Chain, arithmetic: str, seconds: float, how: Compensation, lsb: tuple[float | None, float | None],
    engine: str,
) -> Compiled:
    """The model in 'q31' or 'q15' at steps of `seconds`, if none of its effects is among the `tables.refusals`.

    Raises FormatError if a given LSB does not fit the type, or a signal or a constant does not fit the arithmetic.
    """
    return _Builder(chain, arithmetic, seconds, how, lsb, engine).build()


class _Builder:
    """The steps of `build`, each of which uses the results of those before it."""

    def __init__(
        self, chain: Chain, arithmetic: str, seconds: float, how: Compensation, lsb: tuple[float | None, float | None],
        engine: str,
    ) -> None:
        self.arithmetic, self.seconds, self.how, self.engine = arithmetic, seconds, how, engine
        self.about = FIXED[arithmetic]
        self.static, self.parts = chain.cascade, Parts.of(chain.effects)
        self.low, self.high = output_range(self.static, self.parts, seconds)
        self.drive_lsb, self.output_lsb = lsbs(self.static, arithmetic, *lsb, (self.low, self.high))
        self.reading = read(self.static, self.parts, seconds, how)
        self.taps = self.reading.taps
        self.turning = self.parts.turning(self.static.branches_differ)
        self.ones = self.parts.ones(seconds, self.turning)
        self.leading = ahead_of(self.ones)
        self.formats: dict[str, list[Any]] = {}
        self.in_front: dict[str, list[tuple[float, float]]] = {}
        self.given = (lsb[0] is not None, lsb[1] is not None)

    def build(self) -> Compiled:
        static = self.static
        plain = dataclasses.replace(static, output_offset=0.0)
        inner = (self.drive_lsb, self.output_lsb)
        beyond, self.reached = self._beyond() if self.ones[NAMES[LED]] else (0, True)
        bent = self._beside
        self.inner = Builder(plain, self.arithmetic, self.engine, inner, self.given, beyond, bool(self.leading), bent)
        plays, _ = self.inner.build()
        room = LARGEST.bit_length() - 2 - math.ceil(math.log2(self.sizes.largest))
        if room < 1:
            self._refuse(f"signals behind the plays reach {self.sizes.largest:.3g} output codes, too many")
        self.finer = 0
        self.bits = min(self.inner.bits, room)
        self.drop = self.inner.bits - self.bits
        limits = self._limits(plays.limits)
        maps = self._maps()
        drive = [end << self.inner.fine for end in self.inner.drive]
        plays.limits.drive.low[0], plays.limits.drive.high[0] = drive
        given = FixedChainTables(
            plays,
            limits,
            self._need(lambda: self._moving(plays), "effects on plays"),
            self._tables(),
            self.parts.counts,
            maps,
            self._need(self._tap, "the preview"),
            self._numbers(),
            int(bool(self.parts.slew)),
            quiet(self.how, self.taps),
            int(self.turning),
        )
        tables = OwnChainTables.with_own(given, self.parts)
        slewed = (0.5 + self._slewed) * bool(self.parts.slew)
        max_rate = fastest(static, self.parts, self.seconds, self.how)
        weights = self.taps.weights.tolist() if self.taps else []
        bounds = Bounds(
            static, self.parts, self.inner, tables, self.sizes, self.bits, self.drop, self.formats, weights,
            self.bends, (self.low, self.high), slewed, self.reached, self._largest_step(), self.finer, self.seconds,
            self.bumps,
        )
        if static.branches_differ:
            plays.limits.hold[0] = hold(bounds.hold(), tables.number.dither[0], self.turning)
        codes = Codes(
            self.drive_lsb, self.output_lsb, bounds.forward(), bounds.inverse(), bounds.rounding(),
            bounds.condition, math.ceil(self.sizes.largest * 2**self.bits),
        )
        about = (self.parts, self.seconds, static, max_rate, self.how.preview, *self.reading[1:])
        return Compiled(tables, self.taps, *about, codes)

    # ------------------------------------------------------------ refusals

    def _refuse(self, what: str) -> None:
        raise FormatError((("model", "effects"), f"{what} for {self.arithmetic}; use {self.about.finer}"))

    def _need(self, made: Callable[[], M], what: str) -> M:
        try:
            return made()
        except OverflowError as error:
            raise FormatError((
                ("model", "effects"),
                f"{what}: states and constants do not fit {self.arithmetic}, whose signals have "
                f"{self.bits} bits below an output code; use {self.about.finer}",
            )) from error

    # ------------------------------------------------------------ ranges

    def _code(self, x: float) -> float:
        """A displacement in output codes."""
        return x / float(self.output_lsb)

    @cached_property
    def sizes(self) -> Sizes:
        """The signals behind the plays."""
        static, slack = self.static, 1.0 + 2.0**-20
        w = max(*map(abs, static.play_range), *map(abs, static.pi.start))
        w += self._beside
        size = plays = self._code(math.fsum(static.pi.weights) * w) * slack + 1.0
        span = self._code(self.high - self.low)
        margin, blocks = Margin(slack, span), [(part, one) for part in BEHIND for one in self.ones[part.name]]
        given: dict[str, list[float]] = {part.name: [] for part in BEHIND}
        for part, one in blocks:
            if not part.forward:
                given[part.name].append(size)
                size = one.grown(size, margin)
        still = size
        for part, one in blocks:
            if part.forward:
                given[part.name].append(size)
                size = one.grown(size, margin)
        lsb = float(self.output_lsb)
        mapped, at_rest = [], []
        low, high = (self._code(end - static.output_offset) for end in self._unlimited)
        for each in self.parts.maps:
            mapped.append(size)
            more = (slack - 1.0) * max(abs(low), abs(high)) + 1.0
            at_rest.append((low - more, high + more))
            size = each.grown(size, lsb)
            low, high = (self._code(float(end)) for end in each.mapped(np.array([low, high]) * lsb))
        away = abs(self._code(static.output_offset)) + span * (1 + len(self.ones["clock"]))
        back = float(self.about.code_max) + away + 1.0
        undone: list[float] = [back]
        inverted: list[tuple[float, float] | None] = []
        for each, ends in zip(reversed(self.parts.maps), reversed(at_rest), strict=True):
            back, reached = each.asked(back, ends, still, lsb)
            inverted.append(reached)
            undone.append(back)
        target = back * (math.fsum(map(abs, self.taps.weights.tolist())) if self.taps else 1.0) + 1.0
        asked, wanted = target, {part.name: [0.0] * len(given[part.name]) for part in BEHIND}
        for part in reversed(BEHIND):
            for j in range(len(given[part.name]) * (not part.forward) - 1, -1, -1):
                wanted[part.name][j] = asked
                asked = self.ones[part.name][j].asked(given[part.name][j], asked, margin)
        return Sizes(plays, given, wanted, mapped, size + away, undone, inverted[::-1], target, asked)

    @property
    def _beside(self) -> float:
        """By how much contributions differ from the plays, with elements in parallel counted as a difference of all."""
        return moving.largest_bend(self.static, self.parts.plays) + self._elements

    @property
    def _elements(self) -> float:
        """Largest sum of the elements in parallel with the plays, as a change of all plays, input units."""
        return moving.largest_parallel(self.static, self.parts.plays) / math.fsum(map(abs, self.static.pi.weights))

    @cached_property
    def _unlimited(self) -> tuple[float, float]:
        """Extremes of the settled output in front of its maps, including the offset."""
        return output_range(self.static, dataclasses.replace(self.parts, maps=[]), self.seconds)

    def _beyond(self) -> tuple[int, bool]:
        """Number of spans by which the plays' input must be able to exceed its range, and whether it can.

        A lag is led past its range and keeps moving; a memoryless part passes nothing beyond the range.
        """
        if self.static.stages:
            return 0, False
        low, high = self.static.play_range
        most = self.sizes.asked * float(self.output_lsb) / self.static.pi.slopes[-1]
        spans = math.ceil((most + max(abs(low), abs(high))) / (high - low)) + 1
        straight = not any(effect.bends_plays() for effect in self.parts.plays)  # linear beyond the range
        return min(spans, BEYOND), spans <= BEYOND and straight

    # ------------------------------------------------------------ constants

    @property
    def _farthest(self) -> int:
        """Largest input that is asked of the plays."""
        return int(max(map(abs, self.inner.hull)) + self.inner.margin)

    def _moving(self, plays: FixedTables) -> FixedMovingTables:
        step = float(self.inner.step)
        farthest = min(self._farthest, TABLE_MAX)  # for a search, which can still return the input beyond it
        return moving.build_fixed(
            plays, self.static, self.parts.plays, self.seconds, farthest, self.bumps, step, self._largest_step()
        )

    @cached_property
    def bumps(self) -> Bumps:
        """Difference between bent plays' contributions and the plays themselves."""
        end = max(map(abs, self.inner.hull))
        try:
            return moving.bumps(self.static, self.parts.plays, float(self.inner.step), end, self.about.degree)
        except FormatError:
            self._refuse("noncongruent: plays are bent too sharply within their range")
            raise

    def _limits(self, plays: LimitTable) -> LimitTable:
        """The limits of the whole chain."""
        limits = plays.copy()
        low, high = Fraction(self.low) / self.output_lsb, Fraction(self.high) / self.output_lsb
        slack = Fraction(1, 1024)  # rounding in double precision may have moved an end off its code by this much
        limits.output.low[0], limits.output.high[0] = math.ceil(low - slack), math.floor(high + slack)
        limits.offset[0] = 0
        most = self.about.code_max
        if limits.output.low[0] < -most or limits.output.high[0] > most:
            limits.output.low[0] = max(limits.output.low[0], -most)
            limits.output.high[0] = min(limits.output.high[0], most)
        if limits.output.high[0] - limits.output.low[0] < 2:
            message = f"lies so far from 0 that {self.arithmetic} has no codes for the range; move it nearer to 0"
            raise FormatError((("model", "output_offset"), message))
        return limits

    def signal(self, x: float) -> int:
        """A displacement as a signal."""
        return nearest(Fraction(x) / self.output_lsb * 2**self.bits)

    def _numbers(self) -> FixedChainNumbers:
        span = self.inner.drive[1] - self.inner.drive[0]
        drive_bits, beside = self.inner.fine + self.finer, self.bumps.largest + self._elements / float(self.inner.step)
        most = self._farthest + math.ceil(beside)
        common = (
            self.signal(self.static.output_offset), self.signal(self.high - self.low), *self.slew(span),
            round(VERIFIED_SHARE * (self.about.code_max + 1)), (1 << drive_bits) + math.ceil(lead(self.leading)),
        )
        levels = self.bits, self.drop, min(self.inner.slope[-1] * most >> self.drop, LARGEST)
        codes = self.inner.drive[0] - 2 * span, self.inner.drive[1] + 2 * span, 31 - self.about.code_bits
        led = PARTS[LED].coded().verbs.led
        coarse = led.coarse.bit_length() if led else 0
        braked = max((span << drive_bits).bit_length() + 2 - coarse, 0)
        return FixedChainNumbers.of([(*common, *levels, *codes, drive_bits, self.finer, braked)])

    def _largest_step(self) -> float:
        """`Compiled.largest_step`, plus the code by which a limited drive catches up at once."""
        low, high = self.static.input_range
        max_rate = fastest(self.static, self.parts, self.seconds, self.how)
        return min(max_rate * self.seconds + float(self.drive_lsb) * bool(self.parts.slew), high - low)

    def slew(self, span: int) -> list[int]:
        """Largest rise and fall of the drive in one step: whole drive codes, then their fractions."""
        if not self.parts.slew:
            return [0, 0, 0, 0]
        if self._slewed > MOST_SLEWED:
            steps = crossing(self.static, self.parts, self.seconds)
            raise FormatError((("model", "effects"), too_slow(steps, self.arithmetic, self.about.finer)))
        fractions = (math.floor(rate / self.drive_lsb * 2**REST_BITS) for rate in rates(self.parts, self.seconds))
        inside = [divmod(min(rate, (span + 1) << REST_BITS), 1 << REST_BITS) for rate in fractions]
        return [*(whole for whole, _ in inside), *(rest for _, rest in inside)]

    @property
    def _slewed(self) -> float:
        """Rounding error of a slew-limited drive after crossing its range, in codes."""
        return crossing(self.static, self.parts, self.seconds) * 2.0**-REST_BITS

    def _tables(self) -> tuple[object, ...]:
        """The tables of all parts in order; those in front of the plays get as many bits as fit."""
        margin = Margin(1.0, turning=self.turning)
        about = FixedSurroundings(
            self.seconds, self.static.input_range, self.high - self.low, self.reading.ahead(self.how.preview),
            braked(self.parts, self.ones), self.drive_lsb, self.output_lsb, self.bits, self.about.code_bits,
            self.about.code_max, TEMPERATURE_BITS[self.about.code_bits], max(map(abs, self.inner.drive)),
            self.signal(self.high - self.low), margin,
        )

        def made(part: ChainPart) -> object:
            pairs = zip(self.in_front.get(part.name) or self._behind(part), self.ones[part.name], strict=True)
            self.formats[part.name] = [part.fixed.formats(one, about, *sizes) for sizes, one in pairs]
            return part.fixed.tables(self.formats[part.name], about)

        def ahead() -> dict[str, object]:
            for bits in range(self._finest(), -1, -1):
                self.finer = bits
                try:
                    self.in_front = self._in_front(margin)
                    return {part.name: made(part) for part in AHEAD}
                except OverflowError:
                    if not bits:
                        raise
            return {}

        found = self._need(ahead, next((part.words for part in reversed(AHEAD) if self.ones[part.name]), ""))
        for part in PARTS:
            if part not in AHEAD:
                names = " and ".join(dict.fromkeys(getattr(each, "name", "") for each in self.parts.blocks[part.name]))
                found[part.name] = self._need(functools.partial(made, part), part.words or names)
        return tuple(found[name] for name in NAMES)

    def _behind(self, part: ChainPart) -> list[tuple[float, float]]:
        """Largest input of each block and largest output asked of it, in output codes."""
        if part not in BEHIND:
            return [(0.0, 0.0)] * len(self.ones[part.name])
        return list(zip(self.sizes.given[part.name], self.sizes.wanted[part.name], strict=True))

    def _in_front(self, margin: Margin) -> dict[str, list[tuple[float, float]]]:
        """As `_behind` for each block in front of the plays, in units of signals there."""
        c = self.inner
        given = float(max(map(abs, c.drive)) << (c.fine + self.finer)) + 1.0
        asked = float(max(map(abs, c.play)) + c.margin) * 2.0**self.finer if not self.static.stages else given + 1.0
        found: dict[str, list[tuple[float, float]]] = {}
        for part in reversed(AHEAD):
            found[part.name] = []
            for one in reversed(self.ones[part.name]):
                found[part.name].insert(0, (given, asked))
                asked = one.asked(given, asked, margin)
                if asked > 2.0**60:
                    raise OverflowError("no room")
        return found

    def _finest(self) -> int:
        """Additional bits in front of the plays that keep rounding, amplified by the lags' lead, below half a code.

        0 for models with a memoryless part or effects on plays, or if the plays' input has bits below a drive code.
        """
        if self.static.stages or self.parts.plays or self.inner.fine:
            return 0
        leads = [one.fineness for one in self.leading if one.fineness]
        return min(MOST_FINER, math.ceil(sum(leads)) + 1) if leads else 0

    def _tap(self) -> NDArray[np.int64]:
        rows = [factor(weight) for weight in self.taps.weights.tolist()] if self.taps else []
        return np.array(rows, dtype=np.int64).reshape(-1, 2)

    # ------------------------------------------------------------ maps of the output

    def _maps(self) -> MapTables:
        self.bends: list[list[Bend]] = []
        kinds, stops = [], []
        most, degree = LARGEST // 2, self.about.degree
        for each, size, ends in zip(self.parts.maps, self.sizes.mapped, self.sizes.inverted, strict=True):
            self.bends.append([self._bend(curve) for curve in each.curves(size, ends, float(self.output_lsb))])
            kinds.append(slots.TANH if self.bends[-1] else slots.DEAD_ZONE)
            over = self._need(functools.partial(factor, 1.0 / each.give if each.give else 0.0), "stops")
            limits = [min(max(self.signal(end), -most), most) for end in (each.lower, each.upper)]
            stops.append((*limits, factor(each.give), over))
        curves = [one for pair in self.bends for one in pair or (None, None)]
        found = bend.bends(
            [one.curve.pieces if one else [] for one in curves],
            [one.curve.domain if one else (0, 0) for one in curves],
            [(one.drop, one.lift) if one else (0, 0) for one in curves], degree,
        )
        return MapTables(np.array(kinds, dtype=np.int64), FixedStops.of(stops), found)

    def _bend(self, wanted: Wanted) -> Bend:
        """The fitted curve of a map."""
        function, low, high, largest = wanted
        scale = 2.0**self.bits
        drop = max(0, math.ceil(math.log2(max(-low, high) * scale)) - BEND_BITS)
        lift = max(0, math.ceil(math.log2(largest * scale)) - BEND_BITS)
        into, out = 2.0**drop / scale, scale / 2.0**lift
        ends, allowed = (math.ceil(low / into), math.floor(high / into)), max(0.5, out / 64.0)
        try:
            found = FixedCurve(lambda x: function(x * into) * out, ends, [], self.about.degree, allowed)
        except FormatError:
            self._refuse("saturation bends too sharply within the output's range")
        return Bend(found, drop, lift)


def setting_codes(tables: ChainTables) -> tuple[float, float]:
    """The increment for one degree, and the value that sets the gain to 1; codes in fixed point."""
    if not tables.fixed:
        return 1.0, 1.0
    most = int(tables.limits.code_max[0]) + 1
    return 2.0 ** TEMPERATURE_BITS[most.bit_length() - 1], most / 4
