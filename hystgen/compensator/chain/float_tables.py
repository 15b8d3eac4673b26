"""From a model with effects to the numbers that its operators work with in floating point."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen.arithmetic import ARITHMETICS
from hystgen.basics.problems import FormatError
from hystgen.chain.chain import Chain
from hystgen.compensator.chain import moving, own
from hystgen.compensator.chain.layout import (
    MOST_SLEWED,
    VERIFIED_SHARE,
    ChainTables,
    Compiled,
    OwnChainTables,
    Stages,
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
from hystgen.compensator.chain.parts import Parts
from hystgen.compensator.float_tables import build_float, inward
from hystgen.effects.ageing import compensator as ageing
from hystgen.effects.ageing.compensator import AgeingTables
from hystgen.effects.creep import compensator as creep
from hystgen.effects.delay import compensator as delay
from hystgen.effects.delay.compensator import DelayTables
from hystgen.effects.drift import compensator as drift
from hystgen.effects.lag import compensator as lag
from hystgen.effects.resonance import compensator as resonance
from hystgen.effects.saturation.model import HardSaturation, Stops, TanhSaturation
from hystgen.effects.thermal import compensator as thermal
from hystgen.effects.thermal.compensator import HeatTables
from hystgen.front.tanh import kernels
from hystgen.parameters.schema import Compensation
from hystgen.plays import slots

ROUNDINGS = 4.0
"""[half last bits of the largest drive] What rounding leaves between the input of the plays that is sought and the one
that arrives: those of the goal and of the state of a lag. Set by: tests/test_chain.py -k stands_still."""


def _behind(parts: Parts, arithmetic: str) -> Stages:
    """The stages of saturation, each an envelope or three straight pieces."""
    dtype = ARITHMETICS[arithmetic].computed.type
    kinds: list[int] = []
    firsts: list[int] = []
    sizes: list[int] = []
    data: list[float] = []
    for effect in parts.saturations:
        firsts.append(len(data))
        if isinstance(effect, TanhSaturation):
            kinds.append(slots.TANH)
            sizes.append(0)
            one = [*effect.envelope, 1.0 / effect.level, effect.level]
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
    return Stages(kind, first, size, numbers, kernels.TANH_TABLES[arithmetic], kernels.ATANH_TABLES[arithmetic])


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
    rubbing = [thermal.thresholds(each, ends) for each in parts.heat]
    return HeatTables(
        reals([thermal.heat_numbers(each, ends, span, seconds) for each in parts.heat], "temperatures").reshape(-1, 7),
        np.array([thermal.heat_turns(each, ends, seconds, roundoff) for each in parts.heat], dtype=np.int64),
        reals(thermal.padded(rubbing), "thresholds"),
        np.array([len(each) for each in rubbing], dtype=np.int64),
    )


def _in_two(x: Fraction, dtype: Any) -> tuple[float, float]:
    """A number that is at least 0 as one of the arithmetic and what rounding took from that, together no larger."""
    whole = dtype(min(float(x), float(np.finfo(dtype).max) / 32))
    rest = dtype(float(x - Fraction(float(whole))))
    if Fraction(float(whole)) + Fraction(float(rest)) > x:
        rest = np.nextafter(rest, dtype(-np.inf))
    return float(whole), float(rest)


def slewed(steps: float, dtype: Any) -> float:
    """What rounding a drive at a limited rate adds up to in that many steps, share of the range's end: in each half a
    last bit of what is kept beside the drive, and of the rate."""
    u = float(np.finfo(dtype).eps) / 2
    return steps * 2.0 * u * u


def build(
    chain: Chain, arithmetic: str, seconds: float, how: Compensation, engine: str, drive_lsb: float | None
) -> Compiled:
    """The model in 'float32' or 'float64' at steps of `seconds`; `drive_lsb`: code of the drive's converter.

    None of its effects is among the `tables.refusals`. Raises FormatError if a number does not fit the arithmetic.
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

    plays = build_float(dataclasses.replace(static, output_offset=0.0), arithmetic, engine, True, True)
    free = {end: getattr(plays.forward, end) for end in ("limit", "inside", "range")}
    plays = plays._replace(inverse=plays.inverse._replace(**free))  # what is limited is the drive in front of a lag
    low, high = inward(*output_range(static, parts, seconds), dtype)
    if not low < high:
        raise FormatError((("input_range",), f"the range of the output is narrower than {arithmetic} can tell apart"))
    plays.limits[slots.OUTPUT_MIN], plays.limits[slots.OUTPUT_MAX] = low, high

    creeps = [creep.numbers(each, seconds) for each in parts.creeps]
    turning = parts.turning(static.branches_differ)
    lags = [lag.numbers(each, seconds, turning) for each in parts.lags]
    span, drive_span = float(high) - float(low), static.input_range[1] - static.input_range[0]
    reading = read(static, parts, seconds, how)
    taps, ahead = reading.taps, reading.ahead(how.preview)
    slew = [rate for move in rates(parts, seconds) or (Fraction(0), Fraction(0)) for rate in _in_two(move, dtype)]
    steps = crossing(static, parts, seconds)
    if slewed(steps, dtype) > MOST_SLEWED * float(np.finfo(dtype).eps):
        raise FormatError((("model", "effects"), too_slow(steps, arithmetic, "float64")))
    lead_room = math.prod((2.0 / row[lag.LATE if exact else lag.RATE] for exact, row in lags), start=8.0)
    steepest = 1.0 / (min(static.pi.weights) if parts.lags and min(static.pi.weights) > 0.0 else 1.0)
    weights = float(np.sum(np.abs(taps.weights))) if taps else 1.0
    drives, outputs = ([own.linear(each, seconds) for each in side] for side in (parts.own_drives, parts.own_outputs))
    lead_room *= math.prod(max(one.backward.largest, 1.0) for one in (*drives, *outputs))
    most = max(map(abs, static.input_range)) * lead_room + span * weights * lead_room * steepest
    reals([most], "intermediate results")
    waited, waiting = delay.numbers(parts.delay, seconds)
    max_rate = fastest(static, parts, seconds, how)
    rounded = ROUNDINGS * float(np.finfo(dtype).eps) / 2 * max(map(abs, static.input_range))
    dither = max(rounded * max(lead(lags, drives), 1.0), drive_lsb or 0.0)
    if static.branches_differ:
        plays.limits[slots.HOLD] = hold(plays.limits[slots.HOLD], dither, turning)
    tables = ChainTables(
        plays,
        plays.limits,
        moving.build(static, parts.plays, seconds, min(max_rate * seconds, drive_span), dtype),
        (
            DelayTables(reals([waited] * (waiting > 0), "the delay"), waiting),
            lag.tables(lags, reals, braked(parts, [exact for exact, _ in lags])),
            own.build(drives, reals),
            creep.tables(creeps, reals),
            own.build(outputs, reals),
            _ageing(parts, drive_span, reals, float(np.finfo(dtype).eps) / 2),
            _heat(parts, static.input_range, span, seconds, reals, float(np.finfo(dtype).eps) / 2),
            reals([thermal.numbers(each, span) for each in parts.thermal], "temperatures").reshape(-1, 8),
            reals([resonance.numbers(each, seconds).table for each in parts.modes], "the modes").reshape(-1, 5),
            reals([drift.numbers(each, seconds, span, ahead) for each in parts.drift], "drift").reshape(-1, 8),
        ),
        parts.count(waiting),
        _behind(parts, arithmetic),
        reals(taps.weights if taps else [], "weights of the preview"),
        reals([static.output_offset, span, *slew[::2], *slew[1::2], VERIFIED_SHARE, dither], "offset or rates"),
        int(bool(parts.slew)),
        quiet(how, taps),
        int(turning),
    )
    if drives or outputs:
        tables = OwnChainTables(*tables)
        tables.own_sides = tuple(map(type, parts.own_drives)), tuple(map(type, parts.own_outputs))
    return Compiled(tables, taps, parts, seconds, static, max_rate, how.preview, *reading[1:])
