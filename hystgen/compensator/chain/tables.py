"""From a model with effects to the numbers that its operators work with in floating point, and what they are worth."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hystgen.arithmetic import ARITHMETICS
from hystgen.basics.problems import FormatError
from hystgen.chain.chain import Chain
from hystgen.chain.static import StaticModel
from hystgen.compensator.chain import moving, own, preview
from hystgen.compensator.chain.moving import MovingTables
from hystgen.compensator.chain.own import Linear, OwnTables
from hystgen.compensator.chain.preview import Taps
from hystgen.compensator.float_tables import build_float, inward
from hystgen.compensator.layout import Tables
from hystgen.effects.ageing import compensator as ageing
from hystgen.effects.ageing.compensator import AgeingTables
from hystgen.effects.ageing.model import SHAPES as AGEING
from hystgen.effects.base import USER, Effect, Place
from hystgen.effects.creep import compensator as creep
from hystgen.effects.creep.compensator import CreepTables
from hystgen.effects.drift import compensator as drift
from hystgen.effects.kinds import OwnBlock
from hystgen.effects.lag import compensator as lag
from hystgen.effects.lag.compensator import LagTables
from hystgen.effects.saturation.model import HardSaturation, Stops, TanhSaturation
from hystgen.effects.thermal import compensator as thermal
from hystgen.effects.thermal.compensator import HeatTables
from hystgen.effects.thermal.model import SelfHeating
from hystgen.front.tanh import kernels
from hystgen.front.tanh.kernels import AtanhTables, TanhTables
from hystgen.parameters.schema import Compensation
from hystgen.plays import slots
from hystgen.plays.slots import Counts, Reals

OFFSET, FARTHEST, RISING, FALLING, SHARE = range(5)
"""Places in `ChainTables.number`: output offset, how far another one may be set, how far the drive may move in a step,
and the share that verification corrects with."""

VERIFIED_SHARE = 0.125

STANDARD = Compensation()

SAMPLES_A_SWEEP = 50
"""A drive that takes no fewer samples from one end of its range to the other is what bounds are stated for: at a
hundredth of the sample rate a triangle still has shape, and what ageing and contacts inside a step leave is small."""


class Stages(NamedTuple):
    """Memoryless stages, as `hystgen.front.stage.StageTables`."""

    stage_kind: Counts
    stage_first: Counts
    stage_size: Counts
    stage_data: Reals
    tanh: TanhTables
    atanh: AtanhTables


class ChainTables(NamedTuple):
    """The constants of one model with effects in one arithmetic.

    `plays`: front and plays, with the limits of the whole chain and no offset; `behind`: saturation.
    """

    plays: Tables
    moving: MovingTables
    lag: LagTables
    creep: CreepTables
    ageing: AgeingTables
    gain: Reals  # (k, 8)
    heat: HeatTables
    clock: Reals  # (k, 8)
    own: OwnTables
    behind: Stages
    tap: Reals  # (L,), none without a preview
    number: Reals
    slew: int  # 1 where the drive is kept within a rate

    @property
    def fixed(self) -> bool:
        """Whether it is fixed point."""
        return False

    @property
    def limits(self) -> Reals:
        """As in `Tables`."""
        return self.plays.limits

    @property
    def threshold(self) -> Reals:
        """As in `Tables`."""
        return self.plays.threshold


class OwnChainTables(ChainTables):
    """The same of a model with effects of the user's own; their classes are those of `own`, in its order."""

    own_effects: tuple[type[Effect], ...]

    @property
    def own_blocks(self) -> tuple[tuple[OwnBlock, ...], tuple[OwnBlock, ...]]:
        """What they are made of, in front of the plays and behind."""
        blocks = tuple(effect.block for effect in self.own_effects if effect.block is not None)
        return blocks[: self.own.ahead], blocks[self.own.ahead :]


@dataclass(frozen=True)
class Parts:
    """The effects of a model by what the chain makes of them, those in order that the chain meets one by one."""

    lags: list[Any]
    creeps: list[Any]
    ageing: list[Any]
    thermal: list[Any]
    heat: list[Any]
    drift: list[Any]
    modes: list[Any]
    saturations: list[Any]
    slew: list[Any]
    plays: list[Effect]
    delay: float
    own_drives: list[Effect]
    own_outputs: list[Effect]

    @classmethod
    def of(cls, effects: Sequence[Effect]) -> Parts:
        """Those of a chain's effects."""

        def called(name: str) -> list[Any]:
            return [effect for effect in effects if effect.name == name]

        thermal_effects = called("thermal")
        return cls(
            [each for each in called("lag") if each.time_constant > 0.0], called("creep"), called("ageing"),
            [each for each in thermal_effects if each.columns], [each for each in thermal_effects if not each.columns],
            called("drift"), called("resonance"), called("saturation"), called("slew_limit"),
            [effect for effect in effects if effect.place is Place.PLAYS],
            math.fsum(each.time for each in called("delay")),
            [effect for effect in effects if effect.block and effect.place is Place.DRIVE],
            [effect for effect in effects if effect.block and effect.place is not Place.DRIVE],
        )  # fmt: skip


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

    @property
    def largest_step(self) -> float:
        """Largest move of the drive in a step for which the bounds hold."""
        low, high = self.static.input_range
        return min(self.max_rate * self.seconds, high - low)

    @property
    def ahead(self) -> int:
        """NAME_PREVIEW: what the model needs, or what was asked for."""
        return self.needed if self.asked is None else self.asked

    @property
    def needed(self) -> int:
        """Samples that the reference has to be ahead for the motion to be in time."""
        return max(self.taps.ahead, 0) if self.taps else 0

    @cached_property
    def own(self) -> list[Linear]:
        """Blocks of the user's own, in the order of `tables.own`."""
        return [own.linear(each, self.seconds) for each in (*self.parts.own_drives, *self.parts.own_outputs)]

    @cached_property
    def noise_gain(self) -> float:
        """Largest gain, over all frequencies, from the reference to the drive, over that at rest."""
        z = np.exp(-1j * np.linspace(0.0, np.pi, 2001))
        gain = np.ones_like(z)
        if self.taps:
            gain = np.polynomial.polynomial.polyval(z, self.taps.weights[::-1].astype(complex))
        for each in self.parts.creeps:
            one = creep.numbers(each, self.seconds)
            rate, early, late, _ = one.terms.T[:, :, None]
            states = np.sum((early * z + late) / (1.0 - (1.0 - rate) * z), axis=0)
            gain = gain * one.rest / (one.slope - float(np.sum(late)) + states)
        for each in self.parts.lags:
            exact, (rate, second, late, _) = lag.numbers(each, self.seconds)
            if exact:
                gain = gain * (1.0 - (1.0 - rate) * z) / (late + second * z)
            else:
                gain = gain * (1.0 + second - second * z) * (1.0 - (1.0 - rate) * z) / rate
        for block in self.own:
            gain = gain * block.backward.response(z) * block.rest
        return float(np.max(np.abs(gain)))


def _settled(static: StaticModel, effects: Sequence[Effect], w: float) -> float:
    """The sum of the plays once their input has gone straight to w from the start memory."""
    pi = static.pi
    r = np.array(pi.thresholds)
    rows = np.clip(np.array(pi.start), w - r, w + r)[:, None]
    rows[0] = w
    for effect in effects:
        if effect.bends_plays():
            rows = effect.bent(rows, r)
    return math.fsum((np.array(pi.weights) * rows[:, 0]).tolist())


def output_range(static: StaticModel, parts: Parts, seconds: float) -> tuple[float, float]:
    """Extremes of the settled output over every drive history inside the input range."""
    low, high = (_settled(static, parts.plays, end) for end in static.play_range)
    for each in parts.creeps:
        rest = creep.numbers(each, seconds).rest
        low, high = low * rest, high * rest
    for each in parts.own_outputs:
        rest = own.linear(each, seconds).rest
        low, high = low * rest, high * rest
    for effect in parts.saturations:
        low, high = (float(end) for end in effect.mapped(np.array([low, high]), None))
    return low + static.output_offset, high + static.output_offset


def _behind(parts: Parts, dtype: Any) -> Stages:
    """The stages of saturation: an envelope, or three straight pieces."""
    kinds: list[int] = []
    firsts: list[int] = []
    sizes: list[int] = []
    data: list[float] = []
    for effect in parts.saturations:
        firsts.append(len(data))
        if isinstance(effect, TanhSaturation):
            kinds.append(slots.TANH)
            sizes.append(0)
            one = [effect.level, 1.0 / effect.level, 0.0, 0.0, 1.0 / effect.level, effect.level]
            one.append(float(np.nextafter(dtype(1), dtype(0))))
            data += 2 * one  # both branches
            continue
        lower, upper, give = -math.inf, math.inf, 1.0
        if isinstance(effect, HardSaturation):
            lower, upper, give = -effect.level, effect.level, 0.0
        elif isinstance(effect, Stops):
            lower, upper, give = effect.lower, effect.upper, effect.give
        kinds.append(slots.DEAD_ZONE)
        sizes.append(2)
        ends, anchors = [lower, upper], [lower, lower, upper]
        data += [*ends, *ends, *anchors, *anchors, give, 1.0, give]
        data += [1.0 / give if give else 0.0, 1.0, 1.0 / give if give else 0.0]
    kind, first, size = (np.array(each, dtype=np.int64) for each in (kinds, firsts, sizes))
    numbers = np.array(data, dtype=dtype)
    return Stages(kind, first, size, numbers, kernels.tanh_tables(dtype), kernels.atanh_tables(dtype))


def _ageing(parts: Parts, span: float, reals: Callable[[Any, str], NDArray[Any]], roundoff: float) -> AgeingTables:
    """Gains over travel."""
    rows = [ageing.pieces(each) for each in parts.ageing]
    last = [float(pieces[-1, ageing.BEGIN] + 1.0 / pieces[-1, ageing.INVERSE_LENGTH]) for pieces in rows]
    numbers = [(1.0, 2.0, thermal.LEAST_GAIN, thermal.LARGEST_GAIN, end) for end in last]
    return AgeingTables(
        np.cumsum([0, *map(len, rows)]).astype(np.int64),
        reals(np.concatenate([np.empty((0, 6)), *rows]), "travels of the ageing"),
        reals(numbers, "travels of the ageing").reshape(-1, 5),
        np.array([ageing.turns(each, span, roundoff) for each in parts.ageing], dtype=np.int64),
    )


def _heat(
    parts: Parts,
    ends: tuple[float, float],
    span: float,
    seconds: float,
    reals: Callable[[Any, str], NDArray[Any]],
    roundoff: float,
) -> HeatTables:
    """Gains over the temperature of own heat."""
    return HeatTables(
        reals([thermal.heat_numbers(each, span, seconds) for each in parts.heat], "temperatures").reshape(-1, 7),
        np.array([thermal.heat_turns(each, ends, seconds, roundoff) for each in parts.heat], dtype=np.int64),
    )


def build(chain: Chain, arithmetic: str, seconds: float, how: Compensation = STANDARD) -> Compiled:
    """The model in 'float32' or 'float64' at steps of `seconds`.

    None of its effects is among the `refusals`. Raises FormatError when a
    number does not fit the arithmetic.
    """
    dtype = ARITHMETICS[arithmetic].computed.type
    largest = float(np.finfo(dtype).max) / 16
    static, parts = chain.cascade, Parts.of(chain.effects)

    def reals(values: Any, what: str) -> NDArray[Any]:
        found = np.array(values, dtype=np.float64)
        if found.size and not np.max(np.abs(found)) <= largest:
            message = f"{what} reach {np.max(np.abs(found)):.3g}, too large for {arithmetic}"
            raise FormatError((("model", "effects"), message))
        return found.astype(dtype)

    plays = build_float(dataclasses.replace(static, output_offset=0.0), arithmetic, "loop", True, True)
    low, high = inward(*output_range(static, parts, seconds), dtype)
    if not low < high:
        raise FormatError((("input_range",), f"the range of the output is narrower than {arithmetic} can tell apart"))
    plays.limits[slots.OUTPUT_MIN], plays.limits[slots.OUTPUT_MAX] = low, high

    creeps = [creep.numbers(each, seconds) for each in parts.creeps]
    rows = [(one.slope, 1.0 / one.slope, one.rest, 1.0 / one.rest) for one in creeps]
    lags = [lag.numbers(each, seconds) for each in parts.lags]
    span, drive_span = float(high) - float(low), static.input_range[1] - static.input_range[0]
    delay = parts.delay + (0.5 * seconds if how.drive_hold == "held" else 0.0)
    modes = parts.modes if how.resonance == "inverse" else []
    needed = preview.taps(delay, modes, seconds, how.taps, how.corner)
    led = preview.led(needed, how.preview)
    taps = led if len(led.weights) > 1 or led.first else None
    ahead = how.preview if how.preview is not None else max(taps.ahead, 0) if taps else 0
    rates = [(each.rate * seconds, each.falling_rate * seconds) for each in parts.slew]
    rising, falling = (min(each) for each in zip(*rates, strict=True)) if rates else (0.0, 0.0)
    lead = math.prod((2.0 / row[lag.LATE if exact else lag.RATE] for exact, row in lags), start=8.0)
    steepest = 1.0 / (min(static.pi.weights) if parts.lags and min(static.pi.weights) > 0.0 else 1.0)
    weights = float(np.sum(np.abs(taps.weights))) if taps else 1.0
    drives, outputs = ([own.linear(each, seconds) for each in side] for side in (parts.own_drives, parts.own_outputs))
    lead *= math.prod(max(one.backward.largest, 1.0) for one in (*drives, *outputs))
    most = max(map(abs, static.input_range)) * lead + span * weights * lead * steepest
    reals([most], "intermediate results")
    first = np.cumsum([0, *(len(one.terms) for one in creeps)])
    tables = ChainTables(
        plays,
        moving.build(static, parts.plays, seconds, dtype),
        LagTables(
            np.array([int(exact) for exact, _ in lags], dtype=np.int64),
            reals([row for _, row in lags], "constants of the lag").reshape(len(lags), 4),
        ),
        CreepTables(
            reals(rows, "constants of the creep").reshape(len(rows), 4),
            first.astype(np.int64),
            reals(np.concatenate([np.empty((0, 4)), *(one.terms for one in creeps)]), "constants of the creep"),
        ),
        _ageing(parts, drive_span, reals, float(np.finfo(dtype).eps) / 2),
        reals([thermal.numbers(each, span) for each in parts.thermal], "temperatures").reshape(-1, 8),
        _heat(parts, static.input_range, span, seconds, reals, float(np.finfo(dtype).eps) / 2),
        reals([drift.numbers(each, seconds, span, ahead) for each in parts.drift], "drift").reshape(-1, 8),
        own.build(drives, outputs, reals),
        _behind(parts, dtype),
        reals(taps.weights if taps else [], "weights of the preview"),
        reals([static.output_offset, span, rising, falling, VERIFIED_SHARE], "offset or rates"),
        int(bool(rates)),
    )
    if drives or outputs:
        tables = OwnChainTables(*tables)
        tables.own_effects = tuple(type(one.effect) for one in (*drives, *outputs))
    max_rate = how.max_rate or drive_span / (SAMPLES_A_SWEEP * seconds)
    return Compiled(tables, taps, parts, seconds, static, max_rate, how.preview)


def _behind_slew(chain: Chain) -> int:
    """Number of effects up to the slew limit, 0 without one."""
    return max((i for i, effect in enumerate(chain.effects) if effect.name == "slew_limit"), default=-1) + 1


def refusals(
    chain: Chain, operator: str, seconds: float, how: Compensation = STANDARD
) -> Iterator[tuple[Effect, str]]:
    """The effects that an operator cannot have in the C, each with its reason."""
    low, high = chain.cascade.input_range
    parts = Parts.of(chain.effects)
    for effect in chain.effects:
        if operator != "inverse" and effect.name in ("delay", "resonance"):
            yield effect, "only the inverse has it; emit the inverse alone"
        elif effect.name == "drift" and "drift" not in how.compensate:
            yield effect, (
                "a clock that runs alone, and nothing says when it began; set_offset takes it from outside, and "
                "emit.compensation.compensate: [drift] lets the module count from there"
            )
        elif isinstance(effect, SelfHeating) and "self_heating" in how.compensate:
            yield from ((effect, reason) for reason in thermal.heat_problems(effect, (low, high), seconds))
        elif isinstance(effect, SelfHeating):
            yield effect, (
                "the drive's own heat, open loop: its temperature drifts with the room's; measure it, or have it "
                "followed by emit.compensation.compensate: [self_heating]"
            )
        elif effect.name == "thermal" and not effect.columns:
            yield effect, "the heat of loops, open loop: its temperature drifts with the room's; measure it"
        elif effect.block:
            yield from ((effect, reason) for reason in own.problems(effect, seconds))
            if effect.place is Place.DRIVE and effect in chain.effects[: _behind_slew(chain)]:
                yield effect, "in front of the slew limit; give it an order: ClassVar[int] above that of slew_limit, 1"
        elif effect.name.startswith(USER):
            yield effect, "an effect of your own, which has no compensator"
        elif effect in parts.ageing[1:]:
            yield effect, "one gain follows the travel, and there is another one"
        elif isinstance(effect, AGEING):
            yield from ((effect, reason) for reason in ageing.problems(effect, high - low))
    if operator != "inverse":
        yield from moving.beyond_forward(chain.cascade, parts.plays, seconds)
    yield from moving.problems(chain.cascade, parts.plays)
