"""Drive records to measure for a diagnosis, in which every effect of the catalogue shows and no two look alike.

>>> planned = hystgen.plan("stage.yaml", max_rate=5000.0)
>>> planned.write("plan/")

Drives are computed in whole steps of a decimal grid and with the four basic operations alone, so that the files have
the same bytes on every machine.
"""

from __future__ import annotations

import itertools
import math
import os
import random
import shlex
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from decimal import Decimal
from functools import partial
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hystgen.basics import arguments
from hystgen.basics.problems import PlanError
from hystgen.planning import converter, header, session
from hystgen.planning.converter import Codes, Dac
from hystgen.planning.session import Part, Session

if TYPE_CHECKING:
    from hystgen.parameters.files import Parameters

Array = NDArray[np.float64]

MARGIN = 0.01
"""Share of the input range, at each end, that no record enters."""

OF_RATE = 0.98
"""Share of the rate limit that is used, so that rounding stays below the limit."""

SAMPLE_TIME = 1e-4
"""s, where neither the caller nor the parameter file gives one."""

FULL_SCALE = 8
"""Sample times of a move over the whole range, where no rate limit is given."""

EDGE = 4
"""Fewest samples of any move: three lie between its ends."""

LONGEST_EDGE = 32
"""Most samples of a full-scale move at the rate limit; a longer one is sampled less often."""

ROUND = 3
"""Samples over which every drive is averaged: a sharper corner would lie between samples, where no record sees it."""

MOVE = 12
"""Fewest samples of a full-scale move of a triangle."""

SLOW = 24.0
"""s of a slow record, at least."""

SLOWER = 1.5
"""Least ratio of the lengths of a slow and a fast record."""

FAST_SAMPLES = 1000
"""Samples of a fast record, about."""

REST = 0.125
"""Pause between records, in slow records."""

LONGEST_MOVE = 60.0
"""s of a move over the range: a plan of slower ones, which would take a day, is refused."""

MEASURED = "measured"
"""Folder of the measured records beside the drives."""

WHOLE, CODES, RECORDING = "session.csv", "session_codes.txt", "recording.csv"
"""Files of a session at one rate: its drives, its codes, and where its recording is looked for."""

MOST_SAMPLES = 10_000_000
"""Most samples of a session at one rate: about 500 MB of text."""


@dataclass(frozen=True)
class Drive:
    """A record to be measured: `t` (N,) in s of the session, `v` (N,) in input units; `shows`: catalogue names.

    `corner_time`: s from each sample that was drawn to the next, at one rate with others on a straight line between;
    `codes` (N,): what a converter is given for `v`, None without one.
    """

    name: str
    purpose: str
    shows: tuple[str, ...]
    held_out: bool
    sample_time: float
    corner_time: float
    t: Array
    v: Array
    codes: Codes | None = None

    @property
    def fastest(self) -> float:
        """Largest rate, input/s."""
        return float(np.max(np.abs(np.diff(self.v)) / np.diff(self.t)))


@dataclass(frozen=True)
class Plan:
    """Drive records of one session, in the order in which they are recorded.

    `source`, `effects`: files of the model and of the user's own effects; `history`: drive values visited before every
    record; `rest`: seconds of pause before each; `max_rate`: input/s; `defaults`: a sentence for each of these that was
    chosen here. `session`: where the records are in one drive at one rate, which is `whole`, with codes of `dac`; None
    where no rate was given. `stretches` of it: numbers of steps between samples that were drawn, and ticks of each.
    """

    parameters: Parameters
    source: str
    effects: tuple[str, ...]
    drives: tuple[Drive, ...]
    history: tuple[float, float]
    rest: float
    max_rate: float
    sample_time: float
    defaults: tuple[str, ...]
    session: Session | None = None
    whole: Drive | None = None
    dac: Dac | None = None
    stretches: tuple[tuple[int, int], ...] = ()

    @property
    def duration(self) -> float:
        """Seconds from the first to the last sample."""
        first = self.drives[0] if self.whole is None else self.whole
        return float(self.drives[-1].t[-1] - first.t[0])

    @property
    def samples(self) -> int:
        """Samples of all records."""
        return sum(len(drive.t) for drive in self.drives)

    @property
    def names(self) -> tuple[str, ...]:
        """The files that `write` makes."""
        codes = (CODES, header.file(self.parameters)) if self.dac else ()
        whole = () if self.whole is None else (WHOLE, *codes, session.FILE)
        return (*(drive.name for drive in self.drives), *whole, "plan.html")

    def left_over(self, folder: str | os.PathLike[str]) -> list[Path]:
        """Files in `folder` of an earlier plan with a session, which belong to other drives than these."""
        session_files = (WHOLE, CODES, header.file(self.parameters), session.FILE)
        return [path for name in session_files if name not in self.names and (path := Path(folder) / name).exists()]

    def sentence(self) -> str:
        """Number of records and samples, and the time they take."""
        held_out = sum(drive.held_out for drive in self.drives)
        return (
            f"{len(self.drives)} records, {held_out} of them held out, {self.samples} samples; the session takes "
            f"{lasting(self.duration)}, rests included."
        )

    def command(self, folder: str | os.PathLike[str]) -> str:
        """The command line that diagnoses the measured records, those in `folder`/measured, or the one recording."""
        home = PurePath(os.fspath(folder))
        own = [word for path in self.effects for word in ("--effects", path)]
        out = ["-o", (home / "diagnosis").as_posix()]
        if self.session is not None:
            cut = ["--session", (home / session.FILE).as_posix()]
            recording = (home / RECORDING).as_posix()
            return shlex.join(["hystgen", "diagnose", self.source, recording, *cut, *own, *out])
        files = {drive.name: (home / MEASURED / drive.name).as_posix() for drive in self.drives}
        words = ["hystgen", "diagnose", self.source]
        words += [files[drive.name] for drive in self.drives if not drive.held_out]
        for drive in self.drives:
            words += ["--holdout", files[drive.name]] if drive.held_out else []
        words += [*own, f"--history={','.join(map(repr, self.history))}", f"--rest={self.rest!r}"]
        return shlex.join([*words, *out])

    def tables(self) -> dict[str, str]:
        """Names and text of the files but the page: CSV of t, v and, with a converter, code; of a session all of it."""
        from hystgen.records import columns_text, headers

        names = ("t", "v") if self.dac is None else ("t", "v", "code")
        top = headers(names, {"t": "s", "v": self.parameters.units.input})

        def text(drive: Drive) -> str:
            return columns_text(top, (drive.t, drive.v, *(() if drive.codes is None else (drive.codes,))))

        made = {drive.name: text(drive) for drive in self.drives}
        if self.session is None or self.whole is None:
            return made
        made[WHOLE] = text(self.whole)
        if self.dac is not None and self.whole.codes is not None:
            codes = self.whole.codes
            made[CODES] = "\n".join(map(str, codes.tolist())) + "\n"
            made[header.file(self.parameters)] = header.header(
                self.parameters, self.session, self.dac, codes, self.stretches, self._options()
            )
        return {**made, session.FILE: self.session.to_json()}

    def _options(self) -> str:
        """Of the command line that makes the same session."""
        said = [f"--max-rate {self.max_rate!r}"]
        if self.session is not None:
            said.append(f"--rate {self.session.rate!r}")
        if self.dac is not None:
            dac = self.dac
            said.append(f"--dac-bits {dac.bits} --dac-range={dac.low!r},{dac.high!r} --dac-coding {dac.coding}")
        return " ".join(said)


@arguments.checked
def plan(
    source: Any,
    *,
    max_rate: float | None = None,
    sample_time: float | None = None,
    rate: float | None = None,
    dac_bits: int | None = None,
    dac_range: Sequence[float] | None = None,
    dac_coding: str = converter.CODINGS[0],
    effects: Sequence[str | os.PathLike[str]] = (),
) -> Plan:
    """The drive records that make all effects of the catalogue separable.

    `source`: a `Model` or a parameter file, with `effects`, files of effects of the user's own; `max_rate`: the
    fastest that the drive may change, input/s (default: the whole range in `FULL_SCALE` sample times); `sample_time`:
    shortest time between samples, s (default: the file's, else `SAMPLE_TIME`). Every drive stays inside `input_range`
    and below `max_rate`.

    `rate`: the one sample rate of a converter, Hz, in place of `sample_time`: every drive has a sample a tick, and all
    are parts of one session, with the rests between them. `dac_bits`, `dac_range` and `dac_coding` say how its codes
    are made (see `Dac`); drives are then what the codes give, and pass `max_rate` by no more than a code.

    Raises ParameterError, PlanError with every problem.
    """
    from hystgen.model import Model, as_model, load

    model = load(source, effects) if isinstance(source, str | os.PathLike) else as_model(source)
    named = f"{model.name}.yaml" if isinstance(source, Model) else os.fspath(source)
    file = model.parameters
    if max_rate is not None:
        max_rate = arguments.real("max_rate", max_rate, "input units per second")
    if sample_time is not None:
        sample_time = arguments.real("sample_time", sample_time, "seconds")
    if rate is not None:
        rate = arguments.real("rate", rate, "samples per second")
    given = (
        ("max rate", max_rate, "input units per second"),
        ("sample time", sample_time, "seconds"),
        ("rate", rate, "samples per second"),
    )
    problems = [
        f"the {name} {value!r} is no number above 0; give {unit}"
        for name, value, unit in given
        if value is not None and not 0.0 < value < math.inf
    ]
    if rate is not None and sample_time is not None:
        problems.append("a rate is one over a sample time; give one of both")
    low, high = file.input_range
    grid = Grid.over(low, high)
    top, bottom = grid.values((grid.high, grid.low))
    dac = _dac(rate, dac_bits, dac_range, dac_coding, problems)
    if dac is not None:
        problems += dac.problems(bottom, top)
    if problems:
        raise PlanError(problems)
    defaults = []
    if rate is not None:
        sample_time = 1.0 / rate
    elif sample_time is None:
        sample_time = file.sample_time or SAMPLE_TIME
        whose = "the parameter file's" if file.sample_time else "chosen here, since the parameter file has none"
        defaults.append(f"The sample time of {sample_time:g} s is {whose}; --sample-time gives another.")
    if max_rate is None:
        max_rate = (high - low) / (FULL_SCALE * sample_time)
        unit = f" {file.units.input}/s" if file.units.input else "/s"
        defaults.append(
            f"The rate limit of {max_rate:.4g}{unit} was chosen here: the whole range in {FULL_SCALE} sample times. If "
            "amplifier or stage must not see that, plan again with --max-rate."
        )
    tempo = Tempo.of(grid, max_rate, sample_time)
    written = [(record, every := record.every(tempo), _written(record, grid, tempo, every)) for record in RECORDS]
    player = None if rate is None else _Player.of(grid, tempo, rate, dac, [(len(c) - 1) * e for _, e, c in written])
    drives, tick = [], 0 if player is None else player.first
    for number, (record, every, nodes) in enumerate(written, 1):
        v, codes = (np.array(grid.values(nodes)), None) if player is None else player.played(nodes, every)
        step = every if player is None else 1
        ticks = range(tick, tick + step * len(v), step)
        tick = ticks[-1] + tempo.rest
        drives.append(
            Drive(
                f"{number:02d}_{record.name}.csv", record.purpose, record.shows, record.held_out,
                tempo.seconds(step), tempo.seconds(every), np.array([tempo.seconds(k) for k in ticks]), v, codes,
            )
        )  # fmt: skip
    rest = tempo.seconds(tempo.rest)
    own = tuple(os.fspath(path) for path in effects)
    made = Plan(file, named, own, tuple(drives), (top, bottom), rest, max_rate, sample_time, tuple(defaults))
    return made if player is None else player.session(made)


def _dac(
    rate: float | None, bits: int | None, ends: Sequence[float] | None, coding: str, problems: list[str]
) -> Dac | None:
    """The converter that is asked for; what is missing for it goes to `problems`."""
    arguments.choice("dac_coding", coding, converter.CODINGS)
    if bits is None and ends is None:
        return None
    if rate is None:
        problems.append("codes of a DAC are for one rate; give the rate at which it is played, Hz")
    if bits is None or ends is None:
        problems.append("codes of a DAC need its bits and its range, the drive at its lower and upper end; give both")
    if bits is not None:
        bits = arguments.whole("dac_bits", bits, "bits", 1)
    low_high = None if ends is None else arguments.numbers("dac_range", ends, "[0, 150]")
    if low_high is not None and len(low_high) != 2:
        problems.append(f"the DAC range has {len(low_high)} numbers; give two, the drive at its lower and upper end")
        low_high = None
    if bits is not None and low_high is not None:
        return Dac(bits, *low_high, coding)
    # What is there is judged all the same
    problems += () if bits is None else converter.wrong_bits(bits)
    problems += () if low_high is None else converter.wrong_range(*low_high)
    return None


@dataclass(frozen=True)
class _Player:
    """A converter at one rate: its ticks between the samples of a drive, and all drives in one session.

    `nodes`, `every`: the lead-in that makes the history true; `first`: tick at which the first record begins.
    """

    grid: Grid
    tempo: Tempo
    rate: float
    dac: Dac | None
    nodes: list[int]
    every: int

    @classmethod
    def of(cls, grid: Grid, tempo: Tempo, rate: float, dac: Dac | None, lengths: Sequence[int]) -> _Player:
        """`lengths`: of the records, ticks. Raises PlanError for more samples than a file should have."""
        every = tempo.every_of(1.0, SLOW_SAMPLES)
        made = cls(grid, tempo, rate, dac, _lead_in(grid, tempo, every), every)
        samples = made.first + sum(lengths) + (len(lengths) - 1) * tempo.rest + 1
        if samples > MOST_SAMPLES:
            unit = 10.0 ** math.floor(math.log10(rate * MOST_SAMPLES / samples))
            fits = unit * math.floor(rate * MOST_SAMPLES / samples / unit)
            what = f"at {rate:g} Hz the session has {samples} samples, more than {MOST_SAMPLES}"
            raise PlanError([f"{what}; give a rate of {fits:g} Hz or less"])
        return made

    @property
    def first(self) -> int:
        return (len(self.nodes) - 1) * self.every + self.tempo.rest

    def played(self, nodes: Sequence[int], every: int) -> tuple[Array, Codes | None]:
        """Drives and codes at every tick of samples that are `every` ticks apart."""
        if self.dac is None:
            return np.array(self.grid.values(converter.filled(nodes, every).tolist())), None
        codes = converter.filled(self.dac.codes(self.grid.values(nodes)), every)
        return self.dac.drives(codes), codes

    def session(self, plan: Plan) -> Plan:
        """The plan with its drives as one."""
        parts, at, stretches = [], self.first, [(len(self.nodes) - 1, self.every)]
        lead = self.played(self.nodes, self.every)
        pieces = [lead]
        for drive in plan.drives:
            hold = at - sum(len(v) for v, _ in pieces)
            before, code = pieces[-1]
            pieces.append((np.repeat(before[-1:], hold), None if code is None else np.repeat(code[-1:], hold)))
            pieces.append((drive.v, drive.codes))
            parts.append(Part(drive.name, at, len(drive.v), drive.held_out))
            every = round(drive.corner_time / drive.sample_time)
            stretches += [(1, self.tempo.rest), ((len(drive.v) - 1) // every, every)]
            at += len(drive.v) - 1 + self.tempo.rest
        v = np.concatenate([each for each, _ in pieces])
        codes = None if self.dac is None else np.concatenate([each for _, each in pieces if each is not None])
        t = np.array([self.tempo.seconds(k) for k in range(len(v))])
        top, bottom = (float(self.played([code], 1)[0][0]) for code in (self.grid.high, self.grid.low))
        rise = session.crossing(t, v, 0.5 * (top + bottom))
        assert rise is not None
        dac = None if self.dac is None else asdict(self.dac)
        where = Session(self.rate, len(v), (top, bottom), plan.rest, rise, tuple(parts), dac)
        whole = Drive(WHOLE, "", (), False, plan.sample_time, plan.sample_time, t, v, codes)
        return replace(
            plan, history=(top, bottom), session=where, whole=whole, dac=self.dac, stretches=tuple(stretches)
        )


def _lead_in(grid: Grid, tempo: Tempo, every: int) -> list[int]:
    """Moves to the top and the bottom, the history of the first record, slow enough for any stage."""
    course = Course(grid, grid.rate(tempo.max_rate, tempo.seconds(every)), 2 * MOVE)
    course.hold(EDGE)
    _ends(course, 2 * MOVE)
    return course.rounded()


def lasting(seconds: float) -> str:
    """A duration in everyday words."""
    for unit, size in (("h", 3600.0), ("min", 60.0)):
        if seconds >= 2.0 * size:
            return f"{seconds / size:.1f} {unit}"
    return f"{seconds:.3g} s"


# Grids of drive and time --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Grid:
    """Drive values as whole numbers of 10^-digits, from the lowest to the highest that a record visits."""

    digits: int
    low: int
    high: int

    @classmethod
    def over(cls, low: float, high: float) -> Grid:
        """A grid of a millionth of the range or finer. Raises PlanError where numbers are too coarse for it."""
        a, b = Decimal(low), Decimal(high)
        digits = 6 - (b - a).adjusted()
        if max(abs(low), abs(high)) > 1e8 * (high - low):
            raise PlanError([f"input_range [{low!r}, {high!r}] is too narrow for numbers of its size"])
        margin = Decimal(str(MARGIN)) * (b - a)
        first, last = (x.scaleb(digits) for x in (a + margin, b - margin))
        return cls(digits, math.ceil(first), math.floor(last))

    def values(self, codes: Sequence[int]) -> list[float]:
        """The drive of codes: the doubles nearest to their decimals."""
        unit = 10 ** abs(self.digits)
        return [code / unit if self.digits >= 0 else float(code * unit) for code in codes]

    def rate(self, per_second: float, seconds: float) -> int:
        """The largest number of codes that the drive moves in `seconds`."""
        return math.floor(Decimal(OF_RATE * per_second) * Decimal(seconds) * Decimal(1).scaleb(self.digits))


@dataclass(frozen=True)
class Tempo:
    """Times in whole numbers of the sample time: between samples of `fast`, a duration of `slow` records, the `rest`.

    `move`: samples of a full-scale move of the fast triangles.
    """

    sample_time: float
    max_rate: float
    fast: int
    slow: int
    rest: int
    move: int

    @classmethod
    def of(cls, grid: Grid, max_rate: float, sample_time: float) -> Tempo:
        """Fast records as fast as sampling and rate allow, slow ones slower. Raises PlanError for days of drive."""
        span = grid.high - grid.low
        across = float(span) * 10.0**-grid.digits / (OF_RATE * max_rate * sample_time)
        seconds = max(across, FULL_SCALE) * sample_time
        if not seconds <= LONGEST_MOVE:
            what = f"one move over the input range takes {seconds:.3g} s, and a plan hundreds of them"
            raise PlanError([f"{what}; give a larger max rate or a shorter sample time"])
        fast = max(1, math.ceil(across / LONGEST_EDGE))
        slow = max(math.ceil(SLOW / sample_time), math.ceil(SLOWER * FAST_SAMPLES * fast))
        move = max(MOVE, math.ceil(across / fast))
        return cls(sample_time, max_rate, fast, slow, math.ceil(REST * slow), move)

    def seconds(self, ticks: int) -> float:
        """The double nearest to the decimal of `ticks` sample times."""
        return float(ticks * Decimal(repr(self.sample_time)))

    def every_of(self, share: float, samples: int) -> int:
        """Sample times between the `samples` of a record that lasts this share of a slow one."""
        return max(self.fast, round(share * self.slow / samples))

    @property
    def middle(self) -> int:
        """Between fast and slow, halfway in the logarithm."""
        return max(self.fast, math.isqrt(self.fast * self.every_of(1.0, SLOW_SAMPLES)))


# Waveforms ----------------------------------------------------------------------------------------------------


class Course:
    """A drive as it is written: codes sample by sample, from the lowest on; places are shares of the range.

    `pace`: samples of a quick full-scale move.
    """

    def __init__(self, grid: Grid, step: int, pace: int) -> None:
        self._grid, self._step, self.pace = grid, step, pace
        self.codes = [grid.low]

    @property
    def place(self) -> float:
        """Where the drive is."""
        return (self.codes[-1] - self._grid.low) / (self._grid.high - self._grid.low)

    def go(self, place: float, pace: float = 0.0) -> None:
        """A straight move at `pace` samples a full-scale one, in `EDGE` samples or more, within the rate limit.

        Then the drive stands still, so that with round corners two samples remain at the turning point: it is sampled
        behind a delay of any fraction of a sample, too.
        """
        begin, end = self.codes[-1], self._code(place)
        size = abs(end - begin)
        samples = max(EDGE, math.ceil(pace * abs(place - self.place)), -(-size // max(self._step - 1, 1)))
        for k in range(1, samples + 1):
            self.codes.append(begin + (2 * (end - begin) * k + samples) // (2 * samples))
        self.hold(ROUND)

    def hold(self, samples: int) -> None:
        """The drive stands still."""
        self.codes += [self.codes[-1]] * samples

    def wave(self, values: Sequence[float]) -> None:
        """A wave about the middle of the range, as large as range and rate limit allow; a move to it comes first."""
        steepest = max(abs(b - a) for a, b in itertools.pairwise(values))
        size = 0.5 * (self._grid.high - self._grid.low - 2) / max(map(abs, values))
        size = min(size, (self._step - 1) / steepest)
        middle = (self._grid.low + self._grid.high) // 2
        codes = [middle + round(size * value) for value in values]
        self.go((codes[0] - self._grid.low) / (self._grid.high - self._grid.low), self.pace)
        self.codes += codes[1:]

    def rounded(self) -> list[int]:
        """The drive with round corners."""
        half = ROUND // 2
        padded = [self.codes[0]] * half + self.codes + [self.codes[-1]] * half
        return [(2 * sum(padded[k : k + ROUND]) + ROUND) // (2 * ROUND) for k in range(len(self.codes))]

    def _code(self, place: float) -> int:
        return self._grid.low + round(place * (self._grid.high - self._grid.low))


def sine(turns: float) -> float:
    """sin(2 pi turns), to 1e-13: the C library's differs from machine to machine in the last bit."""
    x = turns - math.floor(turns + 0.5)
    if abs(x) > 0.25:
        x = math.copysign(0.5, x) - x
    x *= 2.0 * math.pi
    total = term = x
    for k in range(1, 10):
        term *= -x * x / ((2 * k) * (2 * k + 1))
        total += term
    return total


def _written(record: Kind, grid: Grid, tempo: Tempo, every: int) -> list[int]:
    """The codes of a record, which ends with moves to the top and the bottom: the history of the next."""
    pace = tempo.move if every == tempo.fast else 2 * MOVE
    course = Course(grid, grid.rate(tempo.max_rate, tempo.seconds(every)), pace)
    course.hold(EDGE)
    record.draw(course)
    _ends(course, pace)
    return course.rounded()


def _ends(course: Course, pace: float) -> None:
    """Moves to the top and the bottom: the history of the record that comes next."""
    course.go(1.0, pace)
    course.go(0.0, pace)
    course.hold(EDGE)


def _triangles(course: Course) -> None:
    for slower, cycles in ((1, 4), (2, 2), (4, 1)):
        for _ in range(cycles):
            course.go(1.0, slower * course.pace)
            course.go(0.0, slower * course.pace)
    _nested(course, 2 * course.pace)


def _nested(course: Course, pace: float) -> None:
    for k in range(6):
        course.go(1.0 - 0.08 * k, pace)
        course.go(0.08 * (k + 1), pace)


def _slow(course: Course) -> None:
    for k in range(5):
        course.go(1.0 - 0.1 * k, 75)
        course.go(0.1 * k, 75)


def _minor(course: Course, pace: float, size: float = 0.25) -> None:
    course.go(1.0, pace)
    course.go(0.0, pace)
    for bias in (0.02, 0.5 - 0.5 * size, 0.98 - size):
        course.go(bias + size, pace)
        for _ in range(2):
            course.go(bias, pace)
            course.go(bias + size, pace)
    course.go(1.0, pace)
    for bias in (0.98 - size, 0.5 - 0.5 * size, 0.02):
        course.go(bias, pace)
        course.go(bias + size, pace)
        course.go(bias, pace)


def _slow_minor(course: Course) -> None:
    _minor(course, 60)


def _fast_minor(course: Course) -> None:
    _minor(course, 3 * course.pace)
    _minor(course, course.pace)
    for bias in (0.15, 0.5, 0.85):
        course.go(bias, course.pace)
        for _ in range(4):
            course.go(bias + 0.1, course.pace)
            course.go(bias - 0.1, course.pace)


def _steps(course: Course, hold: int, levels: Sequence[float]) -> None:
    course.hold(hold // 3)
    for level in levels:
        course.go(level)
        course.hold(hold)


def _sweep(course: Course, samples: int = 1100) -> None:
    """Frequency rises with time squared to an eighth of the sampling rate, amplitude falls as the limit demands."""
    first, last = 1.0 / (16.0 * course.pace), 1.0 / 8.0
    turns, values = 0.0, []
    for k in range(samples):
        x = k / samples
        frequency = first + (last - first) * x * x
        values.append(min(1.0, 1.0 / (6.0 * course.pace * frequency)) * -sine(turns + 0.25))
        turns += frequency
    course.wave(values)


def _multisine(course: Course, period: int = 240, periods: int = 4) -> None:
    """Odd lines with random phases, whole periods."""
    phases = random.Random(1)
    lines = [(line, phases.random()) for line in range(1, 24, 2)]
    one = [sum(sine(line * k / period + phase) / line for line, phase in lines) for k in range(period)]
    course.wave([*(one * periods), one[0]])


def _cycles(course: Course) -> None:
    for _ in range(28):
        course.go(1.0, MOVE)
        course.go(0.0, MOVE)


def _settling(course: Course) -> None:
    _nested(course, course.pace)
    _steps(course, 50, (1.0, 0.3, 0.7, 0.0))


def _staircase(course: Course) -> None:
    course.hold(2 * course.pace)
    for level, slower in (
        (0.35, 0), (0.8, 2), (0.55, 0), (1.0, 0), (0.0, 0), (0.9, 0), (0.45, 4), (0.65, 0), (0.2, 0)
    ):  # fmt: skip
        course.go(level, slower * course.pace)
        course.hold(70)


def _reversals(course: Course, seed: int, turns: int, slowest: float) -> None:
    """Random turning points at random speeds, now and then a hold; both ends come first."""
    chance = random.Random(seed)
    course.go(1.0, slowest * course.pace)
    course.go(0.0, slowest * course.pace)
    for _ in range(turns):
        course.go(0.02 + 0.96 * chance.random(), (1.0 + (slowest - 1.0) * chance.random()) * course.pace)
        if chance.random() < 0.2:
            course.hold(2 * course.pace)


# The records --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Kind:
    """A record: file name, purpose, effects that it shows, waveform and time between samples."""

    name: str
    purpose: str
    shows: tuple[str, ...]
    draw: Callable[[Course], None]
    every: Callable[[Tempo], int]
    held_out: bool = False


def _fast(tempo: Tempo) -> int:
    return tempo.fast


def _middle(tempo: Tempo) -> int:
    return tempo.middle


SLOW_SAMPLES = 480


def _lasting(share: float, samples: int = SLOW_SAMPLES) -> Callable[[Tempo], int]:
    return lambda tempo: tempo.every_of(share, samples)


FULL_STEPS = (1.0, 0.0, 0.5, 1.0, 0.25, 0.75, 0.0)
LONG_HOLDS = (1.0, 0.0, 0.5, 1.0, 0.5, 0.0)

RECORDS = (
    Kind(
        "slow", "One slow full loop, then nested ones: the hysteresis itself, and what bends it at every amplitude.",
        ("asymmetry", "saturation", "sensor_nonlinearity"), _slow, _lasting(1.0),
    ),
    Kind(
        "fast_triangles", "The same loops at the rate limit and two and four times slower: what widens them with rate.",
        ("rate_dependence", "lag", "delay", "slew_limit"), _triangles, _fast,
    ),
    Kind(
        "fast_steps", "Full-scale and smaller steps with resolved edges: a tail is a lag, a shift a delay, a straight "
        "slope a slew limit, ringing a resonance.",
        ("lag", "delay", "slew_limit", "resonance"), partial(_steps, hold=130, levels=FULL_STEPS), _fast,
    ),
    Kind(
        "holds", "Long holds after moves both ways: creep follows the last move, drift does not.",
        ("creep", "drift", "thermal"), partial(_steps, hold=100, levels=LONG_HOLDS), _lasting(4.0, 700),
    ),
    Kind(
        "staircase", "Steps of other sizes and speeds, to judge what the fast records say.",
        ("lag", "delay", "slew_limit", "resonance"), _staircase, _fast, True,
    ),
    Kind(
        "slow_minor", "Equal small loops at three biases, reached from both sides: congruent or not.",
        ("noncongruent", "asymmetry", "sensor_nonlinearity"), _slow_minor, _lasting(1.0),
    ),
    Kind(
        "fast_minor", "Small loops at high rate with many reversals: a lag opens the smallest ones, plays do not.",
        ("rate_dependence", "lag", "noncongruent"), _fast_minor, _fast,
    ),
    Kind(
        "slow_reversals", "Random turning points with pauses, to judge what the slow records say.",
        ("creep", "asymmetry", "saturation", "sensor_nonlinearity", "noncongruent"),
        partial(_reversals, seed=2, turns=14, slowest=3.0), _lasting(1.25, 600), True,
    ),
    Kind(
        "sweep", "A sine from slow to an eighth of the sampling rate: the peak of a resonance, the phase of a lag.",
        ("resonance", "lag", "delay"), _sweep, _fast,
    ),
    Kind(
        "cycles", "Many equal full loops: they travel and heat; later ones differ from earlier ones.",
        ("ageing", "thermal"), _cycles, _lasting(1.0, 720),
    ),
    Kind(
        "settling", "Nested loops and short holds at a middle pace, while it cools: creep and rate in between.",
        ("creep", "rate_dependence", "thermal"), _settling, _middle,
    ),
    Kind(
        "fast_reversals", "Random turning points at random speeds near the limit, to judge.",
        ("rate_dependence", "lag", "delay", "slew_limit"), partial(_reversals, seed=3, turns=40, slowest=4.0), _fast,
        True,
    ),
    Kind(
        "multisine", "Equal periods of an odd multisine with random phases: the noise without a model, what is even.",
        ("asymmetry", "sensor_nonlinearity", "resonance"), _multisine, _fast,
    ),
    Kind(
        "reversals", "Random turning points at a middle pace, to judge what lies between slow and fast.",
        ("creep", "rate_dependence", "noncongruent"), partial(_reversals, seed=5, turns=25, slowest=3.0), _middle, True,
    ),
    Kind(
        "slow_again", "The first record once more: what has changed in the session, and is neither rate nor amplitude.",
        ("drift", "ageing", "thermal"), _slow, _lasting(1.0),
    ),
)  # fmt: skip
"""The records of a session, in their order."""
