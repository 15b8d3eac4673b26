"""Floating-point form of a model with effects: the constants of its operators."""

from __future__ import annotations

import dataclasses
import math
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystgen.arithmetic import ARITHMETICS
from hystgen.basics.problems import FormatError
from hystgen.chain.chain import Chain
from hystgen.compensator.chain import moving
from hystgen.compensator.chain.layout import (
    MOST_SLEWED,
    VERIFIED_SHARE,
    ChainNumbers,
    Compiled,
    FloatChainTables,
    OwnChainTables,
    Stages,
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
from hystgen.compensator.chain.parts import BEHIND, LED, NAMES, PARTS, Parts
from hystgen.compensator.float_tables import build_float, inward
from hystgen.effects.part import FloatSurroundings
from hystgen.front.tanh import kernels
from hystgen.parameters.schema import Compensation

ROUNDINGS = 4.0
"""[half last bits of the largest drive] Rounding difference between the plays' input as solved for and as it arrives,
caused by a lag's goal and its state. Set by: tests/test_chain.py -k stands_still."""


def _behind(parts: Parts, arithmetic: str) -> Stages:
    """The stages of maps of the output, each an envelope or three linear pieces."""
    dtype = ARITHMETICS[arithmetic].computed.type
    rows = [each.stage(float(np.nextafter(dtype(1), dtype(0)))) for each in parts.maps]
    kind, size = (np.array(each, dtype=np.int64) for each in ([row[0] for row in rows], [row[1] for row in rows]))
    first = np.cumsum([0, *(len(data) for *_, data in rows)], dtype=np.int64)[: len(rows)]
    numbers = np.array([x for *_, data in rows for x in data], dtype=dtype)
    return Stages(kind, first, size, numbers, kernels.TANH_TABLES[arithmetic], kernels.ATANH_TABLES[arithmetic])


def _in_two(x: Fraction, dtype: Any) -> tuple[float, float]:
    """A nonnegative number in the arithmetic and the remainder lost to rounding; their sum never exceeds the number."""
    whole = dtype(min(float(x), float(np.finfo(dtype).max) / 32))
    rest = dtype(float(x - Fraction(float(whole))))
    if Fraction(float(whole)) + Fraction(float(rest)) > x:
        rest = np.nextafter(rest, dtype(-np.inf))
    return float(whole), float(rest)


def slewed(steps: float, dtype: Any) -> float:
    """Accumulated rounding of a slew-limited drive after this many steps, as a fraction of the range's end: per step,
    half a last bit of the remainder kept with the drive and half a last bit of the rate's."""
    u = float(np.finfo(dtype).eps) / 2
    return steps * 2.0 * u * u


def build(
    chain: Chain, arithmetic: str, seconds: float, how: Compensation, engine: str, drive_lsb: float | None
) -> Compiled:
    """The model in 'float32' or 'float64' at steps of `seconds`; `drive_lsb`: step of the drive's converter.

    None of its effects is among the `tables.refusals`. Raises FormatError if a number does not fit the arithmetic.
    """
    dtype = ARITHMETICS[arithmetic].computed.type
    largest = float(np.finfo(dtype).max) / 16
    static, parts = chain.cascade, Parts.of(chain.effects)

    def reals(values: ArrayLike, what: str) -> NDArray[Any]:
        found = np.array(values, dtype=np.float64)
        if found.size and not np.max(np.abs(found)) <= largest:
            message = f"{what} reach {np.max(np.abs(found)):.3g}, too large for {arithmetic}"
            raise FormatError((("model", "effects"), message))
        return found.astype(dtype)

    plays = build_float(dataclasses.replace(static, output_offset=0.0), arithmetic, engine, True, True)
    free = {end: getattr(plays.forward, end) for end in ("limit", "inside", "range")}
    plays = plays._replace(inverse=plays.inverse._replace(**free))  # the limit applies to the drive in front of a lag
    low, high = inward(*output_range(static, parts, seconds), dtype)
    if not low < high:
        raise FormatError((("input_range",), f"the range of the output is narrower than {arithmetic} can tell apart"))
    plays.limits.output.low[0], plays.limits.output.high[0] = low, high

    turning = parts.turning(static.branches_differ)
    ones = parts.ones(seconds, turning)
    leading, behind = ahead_of(ones), [one for part in BEHIND for one in ones[part.name]]
    span, drive_span = float(high) - float(low), static.input_range[1] - static.input_range[0]
    reading = read(static, parts, seconds, how)
    taps, ahead = reading.taps, reading.ahead(how.preview)
    slew = [rate for move in rates(parts, seconds) or (Fraction(0), Fraction(0)) for rate in _in_two(move, dtype)]
    steps = crossing(static, parts, seconds)
    if slewed(steps, dtype) > MOST_SLEWED * float(np.finfo(dtype).eps):
        raise FormatError((("model", "effects"), too_slow(steps, arithmetic, "float64")))
    lead_room = math.prod((one.room for one in (*leading, *behind)), start=8.0)
    steepest = 1.0 / (min(static.pi.weights) if ones[NAMES[LED]] and min(static.pi.weights) > 0.0 else 1.0)
    weights = float(np.sum(np.abs(taps.weights))) if taps else 1.0
    most = max(map(abs, static.input_range)) * lead_room + span * weights * lead_room * steepest
    reals([most], "intermediate results")
    max_rate = fastest(static, parts, seconds, how)
    rounded = ROUNDINGS * float(np.finfo(dtype).eps) / 2 * max(map(abs, static.input_range))
    dither = max(rounded * max(lead(leading), 1.0), drive_lsb or 0.0)
    if static.branches_differ:
        plays.limits.hold[0] = hold(plays.limits.hold[0], dither, turning)
    about = FloatSurroundings(
        seconds, static.input_range, span, ahead, braked(parts, ones), reals, float(np.finfo(dtype).eps) / 2
    )
    number = reals([static.output_offset, span, *slew[::2], *slew[1::2], VERIFIED_SHARE, dither], "offset or rates")
    tables = FloatChainTables(
        plays,
        plays.limits,
        moving.build(static, parts.plays, seconds, min(max_rate * seconds, drive_span), dtype),
        tuple(part.floating.tables(ones[part.name], about) for part in PARTS),
        parts.counts,
        _behind(parts, arithmetic),
        reals(taps.weights if taps else [], "weights of the preview"),
        ChainNumbers.of([number], dtype),
        int(bool(parts.slew)),
        quiet(how, taps),
        int(turning),
    )
    own = OwnChainTables.with_own(tables, parts)
    return Compiled(own, taps, parts, seconds, static, max_rate, how.preview, *reading[1:])
