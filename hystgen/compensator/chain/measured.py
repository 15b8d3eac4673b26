"""The largest error of an inverse found by a search, for models whose bound is the whole range of the drive.

A lag that is led misses its target by a second difference, so the memory of the plays behind it differs from the one
solved for, and no sum of roundings tells how far apart the drives of two arithmetics may get. The error found is
typical for references like these; it is not a bound.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar, cast

import numpy as np

from hystgen.basics import jit
from hystgen.chain.chain import Chain
from hystgen.compensator.chain.layout import Compiled
from hystgen.compensator.chain.moving import least_slope
from hystgen.compensator.chain.parts import BEHIND
from hystgen.compensator.chain.run import answers
from hystgen.compensator.chained import Compensator
from hystgen.effects.base import Array, Run
from hystgen.parameters.schema import Compensation

T = TypeVar("T")

SAMPLES = 800
"""[samples] Length of each kind of reference: the error found is then at least 0.79 times that with 3000, and takes
half a second. Set by: benchmarks/chosen_numbers.py samples."""

SPEEDS = (1.0, 0.3, 0.1)
"""[fractions of NAME_MAX_RATE] Slow references let the roundings of a lag add up, fast ones move all plays."""

SAID_BY = 10.0
"""[times the error found] A larger bound is left out, since it says nothing about the errors to expect. No run sets
this: it is the order of magnitude within which a bound is useful."""


_kept: dict[object, dict[object, object]] = {}
"""What was found for the last chain: drives by reference, for an emission with the other engine, and errors by tables,
for one of another operator or layout."""


@dataclass(frozen=True)
class Measured:
    """The largest error found, in drive units or codes, rounded up to two digits, and the number of samples."""

    error: float
    samples: int

    def confirms(self, bound: float) -> bool:
        """Whether a bound is close enough to the error found to be informative."""
        return bound <= SAID_BY * self.error


def measured(compiled: Compiled, chain: Chain, how: Compensation) -> Measured:
    """The largest error of the inverse against the compensator in double precision, from the start memory on, for
    references over the whole range of the output: triangular loops and multisines at `SPEEDS`; logged columns stay at
    the value at which their effect changes nothing. Errors of tables that the references do not reach, but a caller who
    sets the travel does, are added as they are known."""
    codes = compiled.codes
    lsbs = None if codes is None else (codes.drive_lsb, codes.output_lsb)
    about = compiled.seconds, compiled.max_rate, compiled.ahead, lsbs, SAMPLES
    return _once(chain, how, (_content(compiled.tables), about), lambda: _searched(compiled, chain, how))


def _once(chain: Chain, how: Compensation, of: object, make: Callable[[], T]) -> T:
    """What `make` returns for a chain, kept until another chain is asked for; `of`: all else that it depends on."""
    effects = tuple((type(each), repr(each.model_dump())) for each in chain.effects)  # their keys may hold lists
    key = chain.cascade, effects, how
    if key not in _kept:
        _kept.clear()
        _kept[key] = {}
    if of not in _kept[key]:
        _kept[key][of] = make()
    return cast("T", _kept[key][of])


def _content(table: object) -> object:
    """A table as a key of a dictionary."""
    if isinstance(table, np.ndarray):
        return table.dtype.str, table.tobytes()
    return tuple(map(_content, table)) if isinstance(table, tuple) else table


def _searched(compiled: Compiled, chain: Chain, how: Compensation) -> Measured:
    t, codes = compiled.tables, compiled.codes
    drive, output = (1.0, 1.0) if codes is None else (float(codes.drive_lsb), float(codes.output_lsb))
    ends = float(t.limits.drive.low[0]) * drive, float(t.limits.drive.high[0]) * drive
    low, high = (float(end) for end in t.limits.output[0])
    fastest = compiled.largest_step / (ends[1] - ends[0])
    worst, count = 0.0, 0
    columns = {name: getattr(effect, "reference", 0.0) for effect in chain.effects for name in effect.read}
    for share in (kind(fastest * speed) for kind in (_legs, _multisine) for speed in SPEEDS):
        whole = low + (high - low) * share
        given = whole.astype(t.threshold.dtype).astype(np.float64) if codes is None else np.rint(whole)
        times = compiled.seconds * np.arange(len(given), dtype=np.float64)
        extra = {name: np.full(len(given), at) for name, at in columns.items()}
        with jit.plain():
            found = answers(compiled, Run(times, given, extra), True).astype(np.float64)
        wanted = _exact(chain, how, Run(times, given * output, extra), ends) / drive
        known = len(given) - compiled.ahead
        worst = max(worst, float(np.max(np.abs(found - wanted)[:known], initial=0.0)))
        count += known
    unreached = sum(part.unreached for part in BEHIND if compiled.ones[part.name])
    slope = compiled.static.front_slopes[0] * least_slope(compiled.static, compiled.parts.plays)
    return Measured(_upward(worst + unreached * max(abs(low), abs(high)) * output / slope / drive), count)


def _exact(chain: Chain, how: Compensation, references: Run, ends: tuple[float, float]) -> Array:
    """The drives of the compensator in double precision. They take most of the time to emit a model and are the same
    for each engine, so they are kept for the next."""
    record = hashlib.sha256(references.t.tobytes() + references.v.tobytes())
    for name, values in sorted(references.extra.items()):
        record.update(name.encode() + values.tobytes())
    return _once(chain, how, (ends, record.digest()), lambda: Compensator(chain, how).drives(references, ends))


def _upward(x: float) -> float:
    """x rounded up to two digits, so that the last bits of a machine's tanh do not show."""
    if x == 0.0:
        return 0.0
    digits = 1 - math.floor(math.log10(x))
    return float(f"{math.ceil(x * 10.0**digits)}e{-digits}")


def _legs(step: float) -> Array:
    """Loops as fractions (0 .. 1) of a range: a full loop, shrinking loops, then pseudo-random ones; `step`: fraction
    of the range per sample."""
    points = [0.5, 1.0, 0.0, *(0.5 + 0.5 * (-0.7) ** k for k in range(1, 8))]
    seed = 12345
    while sum(map(abs, np.diff(points))) < SAMPLES * step:
        seed = (seed * 1103515245 + 12345) % 2**31
        points.append(seed / 2**31)
    way = np.append(0.0, np.cumsum(np.abs(np.diff(points))))
    return np.asarray(np.interp(np.arange(SAMPLES) * step, way, points))


def _multisine(step: float) -> Array:
    """Three sines as fractions (0 .. 1) of a range, together moving by at most `step` of it per sample."""
    parts = ((1.0, 0.25), (math.sqrt(7.0), 0.15), (math.sqrt(31.0), 0.1))
    turn = step / sum(rate * size for rate, size in parts)
    angle = turn * np.arange(SAMPLES)
    return np.asarray(0.5 + sum(size * np.sin(rate * angle) for rate, size in parts))
