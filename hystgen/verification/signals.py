"""The calls that verification makes: those that an ISR may make, and those that it should never make."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen.compensator import reference
from hystgen.compensator.chain.fixed_tables import setting_codes
from hystgen.compensator.chain.layout import ChainTables
from hystgen.compensator.converter import CodeConversion
from hystgen.compensator.health import Band
from hystgen.compensator.layout import FixedTables, Tables
from hystgen.front import curve
from hystgen.plays import slots
from hystgen.plays.slots import Bytes
from hystgen.verification import kinks

# Calls come in parts of `PART`; in each part, one of these fractions of the calls leaves the status unread
PART, UNREAD = 100, (0.0, 0.5, 0.9)

Calls = tuple[str, Bytes, NDArray[np.float64]]


def _steps(x: NDArray[np.float64]) -> Bytes:
    return np.full(len(x), slots.OP_STEP, dtype=np.uint8)


def _through(points: NDArray[np.float64], length: int) -> NDArray[np.float64]:
    """Straight moves between turning points."""
    return np.interp(np.linspace(0, len(points) - 1, length), np.arange(len(points)), points)


def _onto_the_plays(
    levels: NDArray[np.float64], least: Any, low: float, high: float, length: int, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Turns that end where another play starts to follow, give or take a few last bits; many are requested again."""
    turns = (rng.random(length) < 0.5).tolist()
    ways = (2 * rng.choice(levels, length) * rng.choice([-1.0, 1.0], length)).tolist()
    others = rng.uniform(low, high, length).tolist()
    bits = rng.integers(-2, 3, length).tolist()
    times = rng.integers(1, 3, length).tolist()
    x: list[float] = []
    at = (low + high) / 2
    for turn, way, other, bit, number in zip(turns, ways, others, bits, times, strict=True):
        if not turn:
            at = at + float(least(at)) * bit
        elif low <= at + way <= high:
            at = at + way
        else:
            at = at - way if low <= at - way <= high else other
        x += [at] * number
    return np.array(x[:length])


def _coincidences(
    tables: Tables | FixedTables, inverse: bool, low: float, high: float, length: int,
    rng: np.random.Generator,
) -> tuple[Bytes, NDArray[np.float64]]:
    """Turns right where plays start to follow, from other such turns and from the ends of the range.

    With round thresholds several corners end at the same drive, exactly or to within a last bit: no search may depend
    on the order of its checks.
    """
    drive_low, drive_high = (float(a) for a in tables.limits.drive[0])
    finer = 2.0 ** int(tables.limits.fine[0]) if isinstance(tables, FixedTables) else 1.0
    ways = np.append(tables.threshold[1:].astype(float) / finer, drive_high - drive_low)
    drive = np.empty(400)
    at = drive_low
    for i in range(len(drive)):
        at = at + float(rng.choice(ways)) * int(rng.choice([-2, -1, 1, 2]))
        drive[i] = at = min(max(at, drive_low), drive_high)
    if not inverse:
        return _steps(np.empty(length)), rng.choice(drive, length)
    outputs = reference.answers(tables, False, _steps(drive), drive)[0].astype(float)
    beyond = 0.1 * (high - low) * np.array([-1.0, 0.0, 0.0, 1.0]) + [low, low, high, high]
    near = low + (high - low) * np.array([0.004, 0.04, 0.5, 0.96, 0.996])
    asked = np.where(rng.random(length) < 0.6, rng.choice(outputs, length), rng.choice([*beyond, *near], length))
    op = np.where(rng.random(length) < 0.35, slots.OP_COMMIT, slots.OP_STEP).astype(np.uint8)
    op[rng.random(length) < 0.005] = slots.OP_RESET
    return op, np.where(op == slots.OP_COMMIT, rng.choice(drive, length), asked)


def _bends(tables: Tables | FixedTables) -> NDArray[np.float64]:
    """Drives at the boundaries between pieces of the memoryless part."""
    if not isinstance(tables, FixedTables):
        bent = len(tables.stage_kind) > 0 and tables.stage_kind[0] == slots.DEAD_ZONE
        return np.array(tables.stage_data[: tables.stage_size[0] if bent else 0], dtype=float)
    found: list[float] = []
    for which, (first, count) in enumerate(zip(tables.first, tables.pieces, strict=True)):
        knots = tables.knot[first : first + count]
        branch = curve.INVERSE + 1 - which
        found += knots.tolist() if which < curve.INVERSE else [curve.front_inverse(tables, w, branch)[0] for w in knots]
    return np.array(found, dtype=float)


def _onto_the_bends(
    bends: NDArray[np.float64], least: Any, tables: Tables | FixedTables, inverse: bool, length: int,
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Drives at bends of the memoryless part, or references that lead there, give or take a few last bits.

    A piece between two bends can be as short as one code.
    """
    low, high = (float(a) for a in tables.limits.drive[0])
    drive: NDArray[np.float64] = rng.choice(bends, length)
    drive = np.clip(drive + least(drive) * rng.integers(-1, 2, length), low, high)
    if not inverse:
        return drive
    outputs: NDArray[np.float64] = reference.answers(tables, False, _steps(drive), drive)[0].astype(float)
    outputs += least(outputs) * rng.integers(-8, 9, length)
    return outputs


def codes(conversion: CodeConversion, length: int) -> NDArray[np.int64]:
    """At most `length` codes for both converters, the same every time: their ends and beyond, sweeps, random ones."""
    rng = np.random.default_rng(20261201)
    lines, word = (conversion.reference, conversion.drive), np.iinfo(np.int32)
    ends = [np.arange(end - 20, end + 21) for line in lines for end in (line.least, line.most)]
    least, most = (float(end) for end in (conversion.reference.least, conversion.reference.most))
    sweeps = least + (most - least) * _through(np.array([0.5, 1.0, 0.0, 0.8, 0.3, 0.6]), max(length // 2, 2))
    drawn = [rng.integers(line.least, line.most, length, endpoint=True) for line in lines]
    found: NDArray[np.int64] = np.rint(np.concatenate([[word.min, word.max], *ends, sweeps, *drawn])).astype(np.int64)
    return found[:length]


def displacements(
    real: np.dtype[Any], band: Band, lsb: float, length: int
) -> tuple[NDArray[np.number], NDArray[np.number]]:
    """Expected and measured displacements (length,), the same every time: blocks with errors from a tenth of the band
    to three times, with and without a mean; in the last tenth, extremes and numbers that are none."""
    rng = np.random.default_rng(20261205)
    count = max(length // max(band.window, 1), 12)
    block = -(-length // count)
    sizes = np.repeat(10.0 ** rng.uniform(-1.0, 0.5, count), block)[:length]
    shift = np.repeat(rng.uniform(-2.0, 2.0, count) * (rng.random(count) < 0.5), block)[:length]
    expected = 100.0 * band.rms * np.cumsum(rng.normal(0.0, 0.01, length)) / lsb
    measured = expected + (band.rms * sizes * rng.normal(0.0, 1.0, length) + shift * band.mean) / lsb
    if real.kind == "i":
        least, most = float(np.iinfo(real).min), float(np.iinfo(real).max)
        special = np.array([least, most, 0.0])
    else:
        most = float(np.finfo(real).max)
        special = np.array([np.nan, np.inf, -np.inf, most, -most, 1e19, 0.0])
    for each in (expected, measured):
        odd = (rng.random(length) < 0.01) & (np.arange(length) >= 0.9 * length)
        each[odd] = rng.choice(special, int(odd.sum()))
    if real.kind == "i":
        expected, measured = (np.clip(np.rint(each), least, most) for each in (expected, measured))
    return expected.astype(real), measured.astype(real)


def suite(
    tables: Tables | FixedTables | ChainTables, real: np.dtype[Any], inverse: bool, length: int = 100_000
) -> Iterator[Calls]:
    """Records of `length` calls: name, operations, and arguments with values of type `real`; the same every time.

    For a model with effects, these are records of its plays mixed with calls to its settings. Status is read after
    each call in some parts and after only some calls in others, since its bits must stay until they are read.
    """
    plays = tables.plays._replace(limits=tables.limits) if isinstance(tables, ChainTables) else tables
    records = _suite(plays, real, inverse, length)
    if isinstance(tables, ChainTables):
        records = itertools.chain(records, _settings(tables, inverse, length))
    rng = np.random.default_rng(20261203)
    for name, op, x in records:
        chance = np.repeat(rng.choice(UNREAD, -(-length // PART)), PART)[:length]
        op = np.where(rng.random(length) < chance, op | slots.OP_UNREAD, op).astype(np.uint8)
        with np.errstate(over="ignore"):
            if real.kind == "i":
                x = np.clip(np.rint(x), np.iinfo(real).min, np.iinfo(real).max)
            yield name, op, x.astype(real).astype(np.float64)


def _settings(tables: ChainTables, inverse: bool, length: int) -> Iterator[Calls]:
    """Steps mixed with all other calls, sparsely and densely."""
    low, high = (float(a) for a in (tables.limits.output[0] if inverse else tables.limits.drive[0]))
    drive_low, drive_high = (float(a) for a in tables.limits.drive[0])
    rng = np.random.default_rng(20261126)
    kinds = [slots.OP_SETTLE, slots.OP_OFFSET]
    columns = tables.columns
    set_by = np.where(columns.entry < 0, slots.OP_TEMPERATURE, slots.OP_INFLUENCE + columns.entry)
    kinds += set_by.tolist()
    if "travel" in tables.calls:
        kinds += [slots.OP_GAIN, slots.OP_TRAVEL, slots.OP_TRAVELLED]
    if inverse:
        kinds += [slots.OP_COMMIT, slots.OP_EXPECTED, slots.OP_CORRECT, *([slots.OP_PUSH] * (len(tables.tap) > 0))]
    names = [("settings now and then", 0.01), ("settings", 0.4)]
    names += [("settings at rest", 0.02)] * (inverse and tables.quiet > 0)
    for name, chance in names:
        walk = np.cumsum(rng.normal(0, 0.02, length))
        x = (low + high) / 2 + 0.6 * (high - low) * np.sin(walk)
        if name == "settings at rest":
            x = np.repeat(x, 5 * tables.quiet)[:length]
        op = np.where(rng.random(length) < chance, rng.choice(kinds, length), slots.OP_STEP).astype(np.uint8)
        op[rng.random(length) < 0.003] = slots.OP_RESET
        op[rng.random(length) < 0.001] = slots.OP_INIT
        drives = rng.uniform(drive_low - 5.0, drive_high + 5.0, length)
        x = np.where((op == slots.OP_SETTLE) | (op == slots.OP_COMMIT), drives, x)
        _, gain = setting_codes(tables)
        x = np.where(op == slots.OP_OFFSET, rng.normal(0.0, 0.3 * (high - low), length), x)
        for j, call in enumerate(set_by.tolist()):
            far = 30.0 if call == slots.OP_TEMPERATURE else math.inf
            span = min(columns.highest[j] - columns.lowest[j], far)
            x = np.where(op == call, columns.unit[j] * (columns.middle[j] + rng.standard_cauchy(length) * span), x)
        x = np.where(op == slots.OP_GAIN, gain * rng.uniform(0.3, 2.2, length), x)
        x = np.where(op == slots.OP_TRAVEL, 10.0 ** rng.uniform(-1.0, 9.0, length), x)
        odd = rng.random(length) < np.where(op == slots.OP_STEP, 0.01, 0.1)
        codes = tables.threshold.dtype.kind == "i"
        strange = [0.0, 1e30, -1e30] if codes else [np.nan, np.inf, -np.inf, 0.0, -0.0, 1e30, -1e30]
        x[odd] = rng.choice(strange, int(odd.sum()))
        yield name, op, x
    if inverse:
        yield "settled where it is", *_settled(tables, low, high, length)
    # held for a long time, with slow states still moving
    yield "held", _steps(np.empty(length)), np.where(np.arange(length) < 50, low, 0.7 * high + 0.3 * low)


def _settled(tables: ChainTables, low: float, high: float, length: int) -> tuple[Bytes, NDArray[np.float64]]:
    """From init to a reference, sometimes 0, held until a quiet drive stops; then a settle at that drive, often with
    another drive committed right after it, and a further move. The drive at which the move ends shows any trace of
    the past that a settle leaves."""
    rng = np.random.default_rng(20261204)
    steps = max(4, 2 * tables.quiet + 4)
    count = -(-length // (2 * steps + 3))
    begin, end, last = rng.uniform(low, high, (3, count, 1))
    end = np.where(rng.random((count, 1)) < 0.25, 0.0, end)
    begin, last = (np.where(rng.random((count, 1)) < 0.5, end, each) for each in (begin, last))
    at = np.arange(2 * steps + 3)
    x = begin + (end - begin) * np.minimum(at / steps, 1.0) + (last - end) * np.clip(at / steps - 1.0, 0.0, 1.0)
    op = np.full(x.shape, slots.OP_STEP, dtype=np.uint8)
    op[:, 0] = slots.OP_INIT
    before = slice(0, steps + 1)
    drives = reference.answers(tables, True, op[:, before].ravel(), x[:, before].ravel())[0].reshape(count, -1)[:, -1]
    op[:, steps + 1], x[:, steps + 1] = slots.OP_SETTLE, drives
    committed = rng.random(count) < 0.5
    op[committed, steps + 2] = slots.OP_COMMIT
    x[committed, steps + 2] = (drives * rng.uniform(0.9, 1.1, count))[committed]
    return op.ravel()[:length], x.ravel()[:length]


def _suite(
    tables: Tables | FixedTables, real_type: np.dtype[Any], inverse: bool, length: int
) -> Iterator[Calls]:
    low, high = (float(x) for x in (tables.limits.output[0] if inverse else tables.limits.drive[0]))
    middle, half = (low + high) / 2, (high - low) / 2
    whole = real_type.kind == "i"
    real = np.float64 if whole else real_type.type
    info = np.finfo(real)
    rng = np.random.default_rng(20220916)
    phase = np.linspace(0, 1, length)

    def record(name: str, x: NDArray[np.float64]) -> Calls:
        return name, _steps(x), x

    sizes = np.repeat(10.0 ** rng.uniform(-6, 0, 50), -(-length // 50))[:length]
    yield record("sines of many sizes", middle + half * sizes * np.sin(2 * np.pi * 400 * phase))
    yield record("slow sine", middle + half * np.sin(2 * np.pi * 7 * phase))
    shrinking = middle + half * np.exp(-5 * phase) * np.sin(2 * np.pi * 300 * phase)
    yield record("shrinking swing", shrinking)
    yield record("growing swing", shrinking[::-1].copy())
    points = rng.uniform(low, high, max(2, length // 25))
    yield record("nested loops", _through(points, length))
    walk = np.cumsum(rng.normal(0, 0.02, length))
    yield record("random walk", middle + half * np.sin(walk))
    yield record("steps", np.repeat(rng.uniform(low, high, -(-length // 4)), 4)[:length])
    plateaus = np.repeat(rng.uniform(low, high, -(-length // 100)), 100)[:length]
    moving = rng.random(length) < 0.2
    yield record("plateaus", np.where(moving, rng.uniform(low, high, length), plateaus))
    yield record("beyond the range", middle + 1.5 * half * np.sin(2 * np.pi * 150 * phase) + 0.1 * half * walk)
    if not whole:
        tiny = float(info.smallest_subnormal) * rng.integers(-1000, 1000, length)
        small = float(info.tiny) * rng.normal(0, 3, length)
        yield record("denormals", np.where(rng.random(length) < 0.7, tiny, small))
    least = 1.0 if whole else np.spacing(real(abs(middle)))
    yield record("last bits", middle + float(least) * np.round(rng.normal(0, 4, length)))

    levels = (tables.start_level if inverse else tables.threshold)[1:].astype(float)
    if isinstance(tables, FixedTables):
        levels = levels / 2.0 ** int(tables.limits.fraction[0] if inverse else tables.limits.fine[0])
    bit = (lambda _: 1.0) if whole else (lambda at: np.spacing(np.abs(at).astype(real)))
    if len(levels) > 0:
        yield record("onto the plays", _onto_the_plays(levels, bit, low, high, length, rng))
        yield "coincidences", *_coincidences(tables, inverse, low, high, length, np.random.default_rng(20220917))

    bends = _bends(tables)
    if len(bends) > 0:
        generator = np.random.default_rng(20220918)
        yield record("onto the bends", _onto_the_bends(bends, bit, tables, inverse, length, generator))

    generator = np.random.default_rng(20220919)
    path = kinks.path(tables, real_type, min(length, kinks.POINTS), generator)
    odd_ones = np.array([low, high] if whole else [np.nan, np.inf, low, high])
    yield "from kink to kink", *kinks.along(path, bit, inverse, odd_ones, length, generator)

    if whole:
        most = float(np.iinfo(real_type).max)
        special = np.array([most, -most, -most - 1, 0.0, 1.0, -1.0, low, high, low + 1, high - 1])
    else:
        special = np.array(
            [np.nan, np.inf, -np.inf, 0.0, -0.0, float(info.max), -float(info.max), float(info.tiny), low, high]
        )
    x = _through(points, length)
    places = rng.random(length) < 0.2
    x[places] = rng.choice(special, int(places.sum()))
    yield record("extremes" if whole else "NaN, infinities, extremes", x)

    kinds = np.array([slots.OP_STEP, slots.OP_RESET, slots.OP_INIT], dtype=np.uint8)
    chances = [0.995, 0.004, 0.001]
    x = middle + 1.1 * half * np.sin(walk * 2)
    x[places] = rng.choice(special, int(places.sum()))
    yield "resets", rng.choice(kinds, length, p=chances), x
    if inverse:
        drive_low, drive_high = (float(a) for a in tables.limits.drive[0])
        for name, chance in (("commits", 0.3), ("rare commits", 0.01)):
            op = np.where(rng.random(length) < chance, slots.OP_COMMIT, slots.OP_STEP).astype(np.uint8)
            spread = drive_high - drive_low
            drives = rng.uniform(drive_low - 0.05 * spread, drive_high + 0.05 * spread, length)
            odd = rng.random(length) < np.where(op == slots.OP_COMMIT, 0.1, 0.02)
            drives[odd] = rng.choice(special, int(odd.sum()))
            smooth = middle + 1.1 * half * np.sin(walk)
            smooth[odd] = rng.choice(special, int(odd.sum()))
            yield name, op, np.where(op == slots.OP_COMMIT, drives, smooth)
