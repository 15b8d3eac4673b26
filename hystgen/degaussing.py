"""A sequence of drives that erases what an actuator remembers: turns that decay about the drive at which it ends.

The first two turns are the ends of the drive range; they take along every play that some drive in range moves. Then
comes a turn for each play, on alternating sides: at a turn that its threshold away from the end, a play arrives at the
input of the plays for the end itself, and all later turns are too small to move it. A play whose turn lies out of range
stays where the ends have left it. Either way the plays no longer depend on earlier drives.

>>> sequence = hystgen.degauss("stage_x.yaml", end=50.0)
>>> sequence.drives(start=12.0)
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hystgen.arithmetic import ARITHMETICS
from hystgen.basics import arguments
from hystgen.basics.problems import PlanError, counted, duration
from hystgen.chain.chain import Chain
from hystgen.chain.settling import FOREVER, HORIZON, settling
from hystgen.compensator.chain.layout import SAMPLES_A_SWEEP
from hystgen.effects.base import Place, Run
from hystgen.model import SETTLED, Model, as_model, check_arithmetic, load

if TYPE_CHECKING:
    from hystgen.effects import Effect

Array = NDArray[np.float64]

RESTS = 400
"""Rests that are tried, up to an hour: neighbours differ by 3 % or so."""

MOST_SAMPLES = 2**31
"""Fewer samples than this, so that a counter of 32 bits holds them."""


@dataclass(frozen=True)
class Degauss:
    """A sequence in the numbers of an arithmetic: drives in input units, or codes of `lsb` input units.

    `low`, `high`: ends of the drives; `turns`: drives to which it moves in turn, by at most `step` per sample; `hold`:
    samples for which it stays at each turn, `rest`: at the last one; `seconds`: between samples, None without a sample
    time; `residual`: largest difference that earlier drives make to the displacement at the end, output units;
    `lasting`: names of effects that it leaves out because no sequence erases them.
    """

    model: Model
    arithmetic: str
    low: Any
    high: Any
    turns: tuple[Any, ...]
    step: Any
    hold: int
    rest: int
    lsb: float
    seconds: float | None
    residual: float
    lasting: tuple[str, ...]

    @property
    def end(self) -> float:
        """The drive at its end, input units."""
        return float(self.turns[-1]) * self.lsb

    @cached_property
    def samples(self) -> int:
        """Number of samples, at most, whatever the drive at the start."""
        ramps = [self._ramp(a, b) for a, b in zip((self.low, *self.turns), self.turns, strict=False)]
        return sum(ramps) + 1 + (len(self.turns) - 1) * self.hold + self.rest  # 1: rounding of the first ramp

    def _ramp(self, begin: Any, end: Any) -> int:
        return max(1, math.ceil(abs(float(end) - float(begin)) / float(self.step)))

    def drives(self, start: float) -> NDArray[Any]:
        """The drives (N,), one per sample, from the drive `start` on: input units, or codes in fixed point; the same
        bits as NAME_degauss_step. Raises TypeError unless `start` is a number."""
        begin = arguments.real("start", start, "the present drive")
        return np.fromiter(self._drives(begin), dtype=ARITHMETICS[self.arithmetic].number)

    def _drives(self, start: float) -> Iterator[Any]:
        drive = self.low if not start > self.low else min(type(self.low)(start), self.high)
        for k, turn in enumerate(self.turns):
            while abs(turn - drive) > self.step:
                drive = drive + self.step if turn > drive else drive - self.step
                yield drive
            drive = turn
            for _ in range(1 + (self.hold if k + 1 < len(self.turns) else self.rest)):
                yield drive

    def run(self, start: float) -> Run:
        """The drives in input units, with their times; the last rest is a single sample of its duration."""
        drives = self.drives(start)[: -self.rest or None].astype(np.float64) * self.lsb
        seconds = self.seconds or 1.0
        return Run(
            np.append(np.arange(len(drives)), len(drives) - 1 + max(self.rest, 1)) * seconds,
            np.append(drives, drives[-1]),
        )

    @cached_property
    def memory(self) -> Array:
        """The plays (n + 1,) at its end in units of their input, as for `initial_state`; entry 0 is that input."""
        chain = Chain(self.model.cascade, _fading(self.model))
        run = self.run(float(self.low))
        w = chain.play_input(run)
        pi = chain.cascade.pi
        found: Array = chain.moved(w, run, np.asarray(pi.thresholds), np.asarray(pi.start))[:, -1]
        return np.round(found, 12 - math.frexp(float(np.max(np.abs(chain.cascade.play_range))))[1] * 3 // 10)

    def sentences(self) -> list[str]:
        """What the sequence does, and what it leaves, one sentence each."""
        units = self.model.parameters.units
        drive, output = (f" {unit}" if unit else "" for unit in (units.input, units.output))
        lasts = "" if self.seconds is None else f", {duration(self.samples * self.seconds)}"
        found = [
            f"{counted(len(self.turns), 'turn')}, at most {self.samples} samples{lasts}; ends at {self.end:.6g}{drive}",
            "plays at the end, as initial_state: [" + ", ".join(f"{x:.9g}" for x in self.memory) + "]",
            "the plays keep nothing of earlier drives" + (
                f", the displacement at most {self.residual:.2g}{output}" if self.residual else ""
            ),
        ]
        if self.lasting:
            found.append(f"not erased: {' and '.join(self.lasting)}, which no drive brings back")
        return found


def _fading(model: Model) -> list[Effect]:
    """The effects that respond to the drive and forget it."""
    return [each for each in model.effects if each.place is not Place.ADDED and not each.columns and each.forgets]


@arguments.checked
def degauss(
    source: Model | str | os.PathLike[str],
    *,
    end: float | None = None,
    within: float | None = None,
    max_rate: float | None = None,
    arithmetic: str | None = None,
) -> Degauss:
    """The drives that erase an actuator's memory.

    `source`: a `Model` or a parameter file. `end`: drive at the end, input units (default: that of the start memory);
    `within`: fraction of the output's range that earlier drives may leave in effects with memory in time, and of a step
    to which a lag settles at each turn (default: 0.01); `max_rate`: fastest change, input units per second (default:
    the model's `max_rate`, else the range in 50 samples), never above a slew limit of the model. Missing options come
    from `emit.degauss` of the file. Without `arithmetic` the drives are in double precision, else as the emitted C
    gives them.

    Raises ParameterError, FormatError, and PlanError with every problem.
    """
    model = load(source) if isinstance(source, str | os.PathLike) else as_model(source)
    return of(model, arithmetic or "float64", **{
        name: value for name, value in (("end", end), ("within", within), ("max_rate", max_rate)) if value is not None
    })


def of(model: Model, arithmetic: str, **given: float) -> Degauss:
    """The sequence of a model in an arithmetic; `given`: options of `degauss`, the others are those of the file."""
    check_arithmetic(arithmetic)
    parameters = model.parameters
    file = parameters.emit.degauss
    options = {**({} if file is None else file.model_dump(exclude_none=True)), **given}
    low, high = parameters.input_range
    within, end = float(options.get("within", SETTLED)), float(options.get("end", _start(model)))
    problems = []
    if not low <= end <= high:
        problems.append(f"the end {end:g} is outside input_range {low:g} .. {high:g}; give a drive inside it")
    if not 0.0 < within < 1.0:
        problems.append(f"within is {within:g}; give a fraction of a step, above 0 and below 1")
    rate, seconds = options.get("max_rate"), parameters.sample_time
    if rate is not None and not 0.0 < rate < math.inf:
        problems.append(f"the max rate is {rate:g}; give input units per second, above 0")
    if seconds is None and (rate is not None or any(effect.timed for effect in model.effects)):
        problems.append("a rate and effects that take time need sample_time in the parameter file; add it")
    if problems:
        raise PlanError(problems)
    numbers = _numbers(model, arithmetic)
    move = (high - low) / SAMPLES_A_SWEEP if rate is None else rate * (seconds or 1.0)
    if rate is None and (own := parameters.emit.compensation.max_rate) and seconds:
        move = own * seconds
    for effect in model.effects:
        if effect.slews:
            falling = getattr(effect, "falling_rate", None)
            move = min(move, *(each * (seconds or 1.0) for each in (effect.rate, falling) if each))  # type: ignore[attr-defined]
    step = numbers.step(move)
    effects = _fading(model)
    drive_side = [each for each in effects if (each.place is Place.DRIVE or each.moves_plays()) and not each.slews]
    hold, rest = (
        _settled(model, each, within, seconds) for each in (drive_side, [each for each in effects if not each.slews])
    )
    turns = tuple(numbers.nearest(turn) for turn in _turns(model, end))
    lasting = tuple(dict.fromkeys(each.name for each in model.effects if each not in effects))
    made = Degauss(
        model, arithmetic, numbers.low, numbers.high, turns, step, hold, rest, numbers.lsb, seconds, 0.0, lasting
    )
    if seconds is not None and any(each.timed for each in effects):
        made = _rested(made, effects, within, seconds)
    if made.samples >= MOST_SAMPLES:
        raise PlanError([f"the sequence has {made.samples} samples, too many; allow more within, or a larger max rate"])
    return made


def _start(model: Model) -> float:
    """The drive of the start memory, limited to the range."""
    low, high = model.parameters.input_range
    cascade = model.cascade
    at = float(cascade.front_inverse(cascade.pi.start[0])) if cascade.start_is_defined else low
    return min(max(at, low), high)


def _turns(model: Model, end: float) -> Iterator[float]:
    """The drives at which the sequence turns, in input units."""
    cascade = model.cascade
    low, high = cascade.input_range
    yield high
    yield low
    middle, rising = float(cascade.front(end, True)), True
    for r in sorted(cascade.pi.thresholds[1:], reverse=True):
        ends = [float(cascade.front(each, rising)) for each in (low, high)]
        w = min(max(middle + r if rising else middle - r, ends[0]), ends[1])
        yield min(max(float(cascade.front_inverse(w, rising)), low), high)
        rising = not rising
    yield end


def _settled(model: Model, effects: list[Effect], within: float, seconds: float | None) -> int:
    """Samples until these effects have settled after a step over the range. Raises PlanError."""
    if not any(effect.timed for effect in effects):
        return 0
    assert seconds is not None
    found = settling(Chain(model.cascade, effects), within)
    if math.isinf(found.seconds):
        raise PlanError([f"{' and '.join(found.because)} settles too slowly: {found.sentence()}; allow more within"])
    return math.ceil(found.seconds / seconds)


def _rested(made: Degauss, effects: list[Effect], within: float, seconds: float) -> Degauss:
    """The sequence with a rest after which displacements differ by at most `within` of the output's range, whatever
    the drives before it: at rest at either end of the drive's range, or just after a jump there from the other.

    Plays, creep, lags and elements keep the order of two states, so their states at rest at the ends bound all
    others; a mode rings most after a jump. Raises PlanError.
    """
    chain = Chain(made.model.cascade, effects)
    low, high = made.model.parameters.input_range
    rests = np.geomspace(max(made.rest, 1), max(HORIZON / seconds, made.rest + 1.0), RESTS)
    found = []
    for before, last in ((low, low), (high, high), (low, high), (high, low)):
        run = made.run(last / made.lsb)
        past = np.array([-3.0 * FOREVER, -2.0 * FOREVER, -FOREVER, -2.0, -1.0]) * seconds
        times = np.concatenate([past, run.t[:-1], run.t[-2] + rests * seconds])
        ends = np.full(RESTS, run.v[-1])
        drives = np.concatenate([[low + high - before, before, before, before, last], run.v[:-1], ends])
        found.append(chain.simulate([Run(times, drives)])[0][-RESTS:])
    spread = np.max(found, axis=0) - np.min(found, axis=0)
    most = within * (chain.cascade.output_range[1] - chain.cascade.output_range[0])
    late = np.flatnonzero(spread > most)
    first = int(late[-1]) + 1 if len(late) else 0
    if first == RESTS:
        names = " and ".join(dict.fromkeys(each.name for each in effects if each.timed))
        left = spread[-1] / most * within
        raise PlanError([f"after {HORIZON:g} s, {left:.2g} of the range is left of {names}; allow more within"])
    return replace(made, rest=math.ceil(rests[first]), residual=float(np.max(spread[first:])))


@dataclass(frozen=True)
class _InArithmetic:
    """Drives of an arithmetic: `low`, `high`, and the distance `unit` of those used, so that sums of them are exact."""

    low: Any
    high: Any
    unit: float
    lsb: float
    name: str

    def nearest(self, drive: float) -> Any:
        """The number nearest to a drive in input units."""
        kind = type(self.low)
        least, most = math.ceil(float(self.low) / self.unit), math.floor(float(self.high) / self.unit)
        return kind(min(max(round(drive / self.lsb / self.unit), least), most) * self.unit)

    def step(self, move: float) -> Any:
        """The largest move that is no larger. Raises PlanError if there is none."""
        whole = math.floor(move / self.lsb / self.unit)
        if whole < 1:
            what = f"a move of {move:.3g} per sample is finer than {self.name} can make it"
            raise PlanError([f"{what}; allow a larger max rate, or give a longer sample_time"])
        return type(self.low)(whole * self.unit)


def _numbers(model: Model, arithmetic: str) -> _InArithmetic:
    """The drives of an arithmetic. Raises FormatError."""
    about = ARITHMETICS[arithmetic]
    low, high = model.parameters.input_range
    if about.fixed:
        least, most = model.tables(arithmetic, model.engine(arithmetic=arithmetic)).limits.drive[0]
        return _InArithmetic(int(least), int(most), 1.0, model.units_per_code(arithmetic)[0], arithmetic)
    kind = about.real
    ends: list[Any] = [kind(low), kind(high)]
    for end, (given, up) in enumerate(((low, 1), (high, -1))):  # inward
        if up * float(ends[end]) < up * given:
            ends[end] = np.nextafter(ends[end], kind(up * np.inf))
    unit = float(np.spacing(max(map(abs, ends))))
    return _InArithmetic(ends[0], ends[1], unit, 1.0, arithmetic)
