"""The constants of a model with effects in one arithmetic, and their meaning."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from hystgen.basics.jit import N
from hystgen.basics.structures import Int64, Literal, Real, Struct, UInt8, note
from hystgen.chain.static import StaticModel
from hystgen.compensator.chain import moving, noise, preview
from hystgen.compensator.chain.noise import Smoothing
from hystgen.compensator.chain.parts import AHEAD, BEHIND, LED, NAMES, PARTS, Parts
from hystgen.compensator.chain.preview import Shaped, Taps
from hystgen.compensator.layout import FixedTables, Tables
from hystgen.effects.base import Effect
from hystgen.effects.kinds import OwnBlock
from hystgen.effects.maps import MapTables
from hystgen.effects.part import One
from hystgen.effects.plays import FixedMovingTables, MovingTables
from hystgen.front.tanh.kernels import AtanhTables, TanhTables
from hystgen.parameters.schema import MOST_REFERENCES, Compensation
from hystgen.plays.slots import Counts, LimitTable, Reals


class ChainNumbers(Struct):
    """Constants of a chain besides those of its plays and blocks, in C macros."""

    output_offset: Real = note("added to every displacement")
    farthest_offset: Real = note("largest additional offset that can be set")
    slew_rising: Real = note("largest move of the drive per step")
    slew_falling: Real
    slew_rising_rest: Real = note("and its rounding remainder")
    slew_falling_rest: Real
    share: Literal  # fraction of a deviation that `correct` trims in verification
    dither: Real = note("signal by which a drive at rest alternates")


class FixedChainNumbers(ChainNumbers):
    """The same in fixed point."""

    level_bits: UInt8 = note("bits of a signal of the output side below an output code")
    level_drop: UInt8 = note("and further bits of a sum of the plays")
    largest_level: Int64 = note("largest sum of the plays to solve for")
    least_code: Int64 = note("limits of a drive before the drive range applies")
    most_code: Int64
    share_bits: UInt8 = note("bits of a mantissa below a code")
    drive_bits: UInt8 = note("bits of a signal of the drive side below a drive code")
    arriving_bits: UInt8 = note("and below an input of the plays")
    braked_drop: UInt8 = note("bits of a signal beyond those of a search for a lead")


TRAVEL_BITS = 16
"""In fixed point, verification sets travels in multiples of 2^16 drive codes."""

REST_BITS = 30
"""In fixed point, bits below a code in the rounding remainders of a slew-limited drive and of its rate."""

MOST_SLEWED = 16.0
"""[last bits of the range's end] Maximum rounding accumulated while a slew-limited drive crosses its range; slower
rates are refused. Derived: bounds of float32 are some 100 last bits; a tenth of that is allowed for the rate."""

VERIFIED_SHARE = 0.125
"""Fraction of a deviation that `correct` trims in verification: exact in every arithmetic."""

LEAST_LATE = 1e-6
"""[samples] Smaller delays count as 0, since mean ages are sums with rounding errors."""

SAMPLES_A_SWEEP = 50
"""Minimum number of samples from one end of the drive's range to the other for which bounds are stated: a triangle at a
hundredth of the sample rate keeps its shape, and errors from ageing and from contacts within a step are small."""


class Stages(NamedTuple):
    """Memoryless stages, as in `hystgen.front.stage.StageTables`."""

    stage_kind: Counts
    stage_first: Counts
    stage_size: Counts
    stage_data: Reals
    tanh: TanhTables
    atanh: AtanhTables

    @property
    def kinds(self) -> list[int]:
        """The kind of each stage."""
        return list(map(int, self.stage_kind))

    @property
    def products(self) -> int:
        """Multiplications of an envelope."""
        return 2


class Contents(NamedTuple):
    """What the functions of one operator of a chain compute; as in the C, there is no code for anything else.

    `parts`: which of `parts.PARTS` have blocks; `front`, `branches`: there is a memoryless part, with two branches;
    `maps`: there are maps of the output; `moving`: an effect moves, bends or joins plays; the others as in
    `ChainTables`.
    """

    inverse: bool
    parts: tuple[bool, ...]
    front: bool
    branches: bool
    maps: bool
    moving: bool
    preview: bool
    slew: bool
    braked: bool
    quiet: bool
    turning: bool


class ChainTables(NamedTuple):
    """The constants of one model with effects in one arithmetic.

    `limits`: as in `Tables`, for the whole chain; `plays`: front and plays without an offset, with the same limits in
    floating point; in fixed point their drive may have bits below a code; `behind`: maps of the output.
    """

    plays: Any  # typed in the subclasses, like the other fields of type Any
    limits: LimitTable
    moving: Any
    blocks: tuple[Any, ...]  # tables of each of `parts.PARTS`
    counts: Counts  # number of blocks in each of these parts
    behind: Any
    tap: Reals  # (L,), as factors (L, 2) in fixed point; empty without a preview
    number: Any
    slew: int  # 1 if the rate of the drive is limited
    quiet: int  # number of equal references after which the drive stands still, 0 if it never has to
    turning: int  # 1 if a lag must not arrive at two branches from the wrong side

    @property
    def fixed(self) -> bool:
        """Whether the arithmetic is fixed point."""
        return bool(self.plays.fixed)

    def of(self, part: str) -> Any:
        """The tables of a part of the chain."""
        return self.blocks[NAMES.index(part)]

    def number_of(self, part: str) -> int:
        """Number of blocks in a part of the chain."""
        return int(self.counts[NAMES.index(part)])

    @property
    def calls(self) -> set[str]:
        """The calls that the chain's blocks add to the interface."""
        here = [part for part in PARTS if self.number_of(part.name)]
        return {call for part in here for call in (*part.calls, *part.told(self.of(part.name)))}

    @property
    def columns(self) -> Any:
        """The tables of the gains that follow a column."""
        return self.of("gain")

    @property
    def influences(self) -> int:
        """Number of columns that `set_influence` sets."""
        return int(np.max(self.columns.entry, initial=-1)) + 1

    @property
    def braked(self) -> bool:
        """Whether a lag behind a slew limit is braked, so that it does not overshoot."""
        return bool(self.blocks[LED].braked)

    def contents(self, inverse: bool) -> Contents:
        """What an operator of the model computes."""
        parts = (bool(n) and not (inverse and part.forward) for part, n in zip(PARTS, self.counts, strict=True))
        moving = self.moving.used
        front, branches = bool(self.plays.has_front), bool(self.plays.branches)
        flags = self.slew, self.braked, self.quiet, self.turning
        preview, maps = len(self.tap) > 0, bool(self.behind.kinds)
        return Contents(inverse, tuple(parts), front, branches, maps, moving, preview, *map(bool, flags))

    @property
    def threshold(self) -> Reals:
        """As in `Tables`."""
        threshold: Reals = self.plays.threshold
        return threshold


class FloatChainTables(ChainTables):
    """The same in floating point."""

    plays: Tables
    moving: MovingTables
    behind: Stages


class FixedChainTables(ChainTables):
    """The same in fixed point."""

    plays: FixedTables
    moving: FixedMovingTables
    behind: MapTables
    number: FixedChainNumbers


class OwnChainTables(ChainTables):
    """The tables of a model with a user's own effects. `own_sides`: their classes, in front of the plays and behind."""

    own_sides: tuple[tuple[type[Effect], ...], tuple[type[Effect], ...]]

    @classmethod
    def with_own(cls, tables: ChainTables, parts: Parts) -> ChainTables:
        """The tables of a model, with the classes of a user's own effects if there are any."""
        if not (parts.own_drives or parts.own_outputs):
            return tables
        found = cls(*tables)
        found.own_sides = tuple(map(type, parts.own_drives)), tuple(map(type, parts.own_outputs))
        return found

    @property
    def own_effects(self) -> tuple[type[Effect], ...]:
        """The user's own effects, in front of the plays and then behind."""
        return (*self.own_sides[0], *self.own_sides[1])

    @property
    def own_blocks(self) -> tuple[tuple[OwnBlock, ...], tuple[OwnBlock, ...]]:
        """The blocks of these effects, in front of the plays and behind."""
        ahead, behind = (tuple(e.block for e in side if e.block is not None) for side in self.own_sides)
        return ahead, behind


@dataclass(frozen=True)
class Codes:
    """The units of a model with effects in fixed point: physical units per code, bounds in codes, and ranges.

    `forward_error` in output codes; `inverse_error`, and its part on the same branch, `inverse_rounding`, in drive
    codes; `condition`: the condition of `inverse_rounding` in words; `largest`: bound on every signal.
    """

    drive_lsb: Fraction
    output_lsb: Fraction
    forward_error: float
    inverse_error: float
    inverse_rounding: float
    condition: str
    largest: int


@dataclass(frozen=True)
class Compiled:
    """A model with effects as it is emitted: `tables` of the arithmetic, and the taps of the preview in double."""

    tables: ChainTables
    taps: Taps | None
    parts: Parts
    seconds: float
    static: StaticModel
    max_rate: float
    asked: int | None = None
    smoothing: Smoothing | None = None
    shaped: Shaped | None = None
    """modes that the taps keep from ringing, in addition to compensating a delay and inverting other modes"""
    codes: Codes | None = None
    """only in fixed point"""

    @property
    def columns(self) -> list[tuple[str, int, float]]:
        """The columns that `set_influence` sets: name, index, and the number to set per unit of the column."""
        t = self.tables.columns
        rows = zip(self.parts.blocks["gain"], t.entry.tolist(), t.unit.tolist(), strict=True)
        return [(column, entry, unit) for effect, entry, unit in rows if entry >= 0 for column in effect.read]

    @property
    def largest_step(self) -> float:
        """Largest move of the drive per step for which the bounds hold."""
        low, high = self.static.input_range
        return min(self.max_rate * self.seconds, high - low)

    @property
    def largest_way(self) -> float:
        """Largest move of the plays' input in such a step."""
        return largest_way(self.static, ahead_of(self.ones), self.largest_step)

    @property
    def ahead(self) -> int:
        """NAME_PREVIEW: as requested, else as the model needs."""
        return Read(self.taps, self.smoothing, self.shaped).ahead(self.asked)

    @property
    def late(self) -> float:
        """Samples by which the motion is late on a ramp."""
        return Read(self.taps, self.smoothing, self.shaped).late(self.asked)

    @property
    def behind(self) -> list[One]:
        """The blocks of the inverse behind the plays."""
        return [one for part in BEHIND if not part.forward for one in self.ones[part.name]]

    @property
    def last(self) -> list[One]:
        """The blocks that follow `behind` and that only the forward operator has."""
        return [one for part in BEHIND if part.forward for one in self.ones[part.name]]

    @cached_property
    def ones(self) -> dict[str, list[Any]]:
        """The blocks of each part of the chain."""
        return self.parts.ones(self.seconds, bool(self.tables.turning))

    @property
    def gain(self) -> noise.Gain:
        """Gain from reference to drive."""
        return noise.Gain(self.static, self.parts, self.seconds, self.taps or preview.PLAIN)

    @cached_property
    def noise_gain(self) -> float:
        """Largest gain from reference to drive over all frequencies, divided by the gain at rest."""
        return noise.largest(self.gain)


QUIET = 32
"""[samples] Equal references after which the drive stands still. Set by: benchmarks/chosen_numbers.py quiet. With a lag
of 10 samples in q15, a ramp of one code per 20 samples is then unaffected; with 8 its rms error is 0.088 codes instead
of 0.077. On a ramp of one code per 100 samples the drive dithers all the time with 128, a third of the time with 32."""


def quiet(how: Compensation, taps: Taps | None) -> int:
    """`ChainTables.quiet`: `QUIET`, plus one for each sample after the first that the preview sums."""
    return QUIET + (len(taps.weights) if taps else 1) - 1 if how.quiet else 0


def ahead_of(ones: Mapping[str, Sequence[Any]]) -> list[Any]:
    """The blocks in front of the plays."""
    return [one for part in AHEAD for one in ones[part.name]]


def lead(ahead: Sequence[One]) -> float:
    """Largest gain from the signal in front of the plays to the drive, 0 if there are no blocks in between."""
    return math.prod(one.lead for one in ahead) if ahead else 0.0


def braked(parts: Parts, ones: Mapping[str, Sequence[Any]]) -> int:
    """1 if a single led block follows a slew limit."""
    return int(bool(parts.slew) and [one.exact for one in ones[NAMES[LED]]] == [False])


def rates(parts: Parts, seconds: float) -> tuple[Fraction, ...]:
    """Largest rise and fall of the drive in a step, in drive units; empty without a slew limit."""
    if not parts.slew:
        return ()
    pairs = [(each.rate, each.falling_rate) for each in parts.slew]
    return tuple(Fraction(min(each)) * Fraction(seconds) for each in zip(*pairs, strict=True))


def crossing(static: StaticModel, parts: Parts, seconds: float) -> float:
    """Steps that a drive at its limited rate takes to cross its range; 0 without a slew limit."""
    low, high = static.input_range
    return max((float(Fraction(high - low) / rate) for rate in rates(parts, seconds)), default=0.0)


def too_slow(steps: float, arithmetic: str, finer: str) -> str:
    """Message that refuses a rate at which the drive takes this many steps to cross its range."""
    return (
        f"slew_limit: the drive crosses its range in {steps:.2g} samples, too slow for {arithmetic}; use {finer}, or a "
        "longer sample_time"
    )


HELD_CODES = 3
"""[times DITHER] How far rounding alone takes a lag in front of two branches beyond its target: the drive is kept up to
two ahead of the target, and rounding it to a code adds half of one."""


def hold(rounded: N, dither: N, turning: bool) -> N:
    """Largest move back of the drive in front of two branches that is ignored: `rounded`, for rounded computation, plus
    an allowance for drives that differ from those asked for."""
    return rounded + (HELD_CODES if turning else 1) * dither


def fastest(static: StaticModel, parts: Parts, seconds: float, how: Compensation) -> float:
    """NAME_MAX_RATE in drive units per second: as requested, else that of a slow sweep; at most the amplifier's rate,
    and the rate up to which own heat keeps the gain within its limits.

    Above the slew rate the actual drive differs from the one given to the C, depending on when in a step it gets there.
    """
    ends = static.input_range
    asked = how.max_rate or (ends[1] - ends[0]) / (SAMPLES_A_SWEEP * seconds)
    low, high = output_range(static, parts, seconds)
    moves = [one.farthest(ends, high - low, seconds) for one in parts.behind(seconds)]
    slew = (rate for each in parts.slew for rate in (each.rate, each.falling_rate))
    return float(min([asked, *slew, *(move / seconds for move in moves)]))


def largest_way(static: StaticModel, ahead: Sequence[One], step: float) -> float:
    """Largest move of the plays' input in a step in which the drive moves by at most `step`: through a user's own
    blocks `ahead`, up the steepest slope of the front, and between its branches. A lag adds nothing."""
    grown = math.prod(one.growth for one in ahead)
    low, high = static.play_range
    return min(static.front_slopes[1] * grown * step + static.branch_gap, max(grown, 1.0) * (high - low))


class Read(NamedTuple):
    """How the reference is read: the preview's weights (None: it is read unchanged), and among them the averages that
    limit the noise gain and the weights that keep modes from ringing."""

    taps: Taps | None
    smoothing: Smoothing | None
    shaped: Shaped | None

    def ahead(self, asked: int | None) -> int:
        """`Compiled.ahead`."""
        return asked if asked is not None else self.needed

    @property
    def needed(self) -> int:
        """Samples by which the taps read ahead."""
        return max(self.taps.ahead, 0) if self.taps else 0

    def missing(self, asked: int | None) -> int:
        """The part of `needed` that is not known ahead of the motion."""
        return max(self.needed - self.ahead(asked), 0)

    def late(self, asked: int | None) -> float:
        """Samples by which the motion is late on a ramp."""
        return self.missing(asked) + sum(each.late for each in (self.smoothing, self.shaped) if each)


def read(static: StaticModel, parts: Parts, seconds: float, how: Compensation) -> Read:
    """How a model reads the reference."""
    delay = parts.delay + (0.5 * seconds if how.drive_hold == "held" else 0.0)
    modes, by = ([], "inverse") if how.resonance == "none" else (parts.modes, how.resonance)
    needed = preview.taps(delay, modes, seconds, how.taps, how.corner, by)
    smoothing = None
    if how.noise_gain is not None:
        gain = noise.Gain(static, parts, seconds, needed)
        smoothing = noise.smoothing(gain, how.noise_gain, MOST_REFERENCES, how.preview)
    if smoothing is not None:
        needed = smoothing.before(needed)
    led = preview.led(needed, how.preview)
    return Read(led if len(led.weights) > 1 or led.first else None, smoothing, preview.shaped(modes, seconds, by))


def gain(static: StaticModel, parts: Parts, seconds: float, how: Compensation) -> noise.Gain:
    """`Compiled.gain` of a model, in every arithmetic."""
    return noise.Gain(static, parts, seconds, read(static, parts, seconds, how).taps or preview.PLAIN)


def settled(static: StaticModel, effects: Sequence[Effect], w: float) -> float:
    """The sum of the plays after their input has moved monotonically to w from the start memory."""
    pi = static.pi
    r = np.array(pi.thresholds)
    rows = np.clip(np.array(pi.start), w - r, w + r)[:, None]
    rows[0] = w
    for effect in effects:
        if effect.bends_plays():
            rows = effect.bent(rows, r)
    return math.fsum((np.array(pi.weights) * rows[:, 0]).tolist())


def output_span(static: StaticModel, effects: Sequence[Effect]) -> tuple[float, float]:
    """Extremes of the sum of the plays and of elements in parallel with them, over all drive histories within the input
    range. At the largest input so far z is 0, as after `settle`, or above, at most as large as after a full sweep."""
    low, high = (settled(static, effects, end) for end in static.play_range)
    found = (np.maximum(each.weights, 0.0) @ each.ends for each in moving.parallel(static, effects))
    below, above = sum(found, start=np.zeros(2)).tolist()
    return low - below, high + above


def output_range(static: StaticModel, parts: Parts, seconds: float) -> tuple[float, float]:
    """Extremes of the settled output over all drive histories within the input range."""
    low, high = output_span(static, parts.plays)
    for one in parts.behind(seconds):
        low, high = one.at_rest(low), one.at_rest(high)
    for each in parts.maps:
        low, high = (float(end) for end in each.mapped(np.array([low, high])))
    return low + static.output_offset, high + static.output_offset
