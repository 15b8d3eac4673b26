"""Drive records to measure for a diagnosis, which show every effect of the catalogue and tell all of them apart.

>>> planned = hystgen.plan("stage.yaml", max_rate=5000.0)
>>> planned.write("plan/")
"""

from __future__ import annotations

import math
import os
import shlex
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path, PurePath
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hystgen.basics import arguments
from hystgen.basics.problems import PlanError
from hystgen.planning import converter, header, session
from hystgen.planning.converter import Codes, Dac
from hystgen.planning.grid import FULL_SCALE, SLOW_SAMPLES, Grid, Tempo
from hystgen.planning.session import PlayedRecord, Session
from hystgen.planning.waveforms import RECORDS, lead_in, written

if TYPE_CHECKING:
    from hystgen.model import Model
    from hystgen.parameters.schema import Parameters

Array = NDArray[np.float64]

SAMPLE_TIME = 1e-4
"""[s] Default if neither the caller nor the parameter file gives one."""

MEASURED = "measured"
"""Folder for the measured records, next to the drives."""

WHOLE, CODES, RECORDING = "session.csv", "session_codes.txt", "recording.csv"
"""Files of a session at one rate: drives, codes, and the expected path of the recording."""

MOST_SAMPLES = 10_000_000
"""Maximum number of samples in a session at one rate: about 500 MB of text."""


@dataclass(frozen=True)
class Drive:
    """A record to be measured. `t` (N,): session time, s; `v` (N,): input units; `shows`: names of effects.

    `corner_time`: spacing of the drawn points in s; at one rate, samples between them are interpolated; `codes` (N,):
    the converter codes for `v`, None without a converter.
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
class PlannedDrives:
    """Drive records of one session, in recording order.

    `source`, `effects`: files of the model and of the user's own effects; `history`: drive values visited before every
    record; `rest`: seconds of pause before each; `max_rate`: input/s; `defaults`: a sentence about each rate or time
    chosen by default. If a rate was given, all drives are played as one, `whole`, with codes for `dac`; `session` gives
    the positions of the records in it, and `stretches` the steps between its drawn points and the ticks per step.
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
        """Number of samples in all records."""
        return sum(len(drive.t) for drive in self.drives)

    @property
    def names(self) -> tuple[str, ...]:
        """The files that `write` creates."""
        codes = (CODES, header.file(self.parameters)) if self.dac else ()
        whole = () if self.whole is None else (WHOLE, *codes, session.FILE)
        return (*(drive.name for drive in self.drives), *whole, "plan.html")

    def left_over(self, folder: str | os.PathLike[str]) -> list[Path]:
        """Files in `folder` from an earlier plan with a session, which belong to other drives."""
        session_files = (WHOLE, CODES, header.file(self.parameters), session.FILE)
        return [path for name in session_files if name not in self.names and (path := Path(folder) / name).exists()]

    def sentence(self) -> str:
        """Number of records and samples, and their duration."""
        held_out = sum(drive.held_out for drive in self.drives)
        return (
            f"{len(self.drives)} records, {held_out} of them held out, {self.samples} samples; the session takes "
            f"{lasting(self.duration)}, rests included."
        )

    def command(self, folder: str | os.PathLike[str]) -> str:
        """The command line that diagnoses the records measured into `folder`/measured, or the session's recording."""
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
        """Name and text of every file except the page: tables of t, v and, with a converter, codes."""
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
        """Command line options that reproduce the session."""
        said = [f"--max-rate {self.max_rate!r}"]
        if self.session is not None:
            said.append(f"--rate {self.session.rate!r}")
        if self.dac is not None:
            dac = self.dac
            said.append(f"--dac-bits {dac.bits} --dac-range={dac.low!r},{dac.high!r} --dac-coding {dac.coding}")
        return " ".join(said)


@arguments.checked
def plan(
    source: Model | str | os.PathLike[str],
    *,
    max_rate: float | None = None,
    sample_time: float | None = None,
    rate: float | None = None,
    dac_bits: int | None = None,
    dac_range: Sequence[float] | None = None,
    dac_coding: str = converter.CODINGS[0],
    effects: Sequence[str | os.PathLike[str]] = (),
) -> PlannedDrives:
    """The drive records that make all effects of the catalogue separable.

    `source`: a `Model` or a parameter file; `effects`: files with the user's own effects; `max_rate`: fastest rate of
    the drive, input/s (default: the whole range in `FULL_SCALE` sample times); `sample_time`: shortest time between
    samples, s (default: the file's, else `SAMPLE_TIME`). Every drive stays inside `input_range` and below `max_rate`.

    `rate`: the sample rate of a converter, Hz, instead of `sample_time`: every drive has one sample per tick, and all
    drives are parts of one session, with rests between them. `dac_bits`, `dac_range` and `dac_coding` describe the
    converter's codes (see `Dac`); the drives are then the values that the codes produce, which exceed `max_rate` by no
    more than one code.

    Raises ParameterError, PlanError with every problem.
    """
    from hystgen.model import Model, as_model, load

    model = load(source, effects) if isinstance(source, str | os.PathLike) else as_model(source)
    named = f"{model.name}.yaml" if isinstance(source, Model) else os.fspath(source)
    file = model.parameters
    problems: list[str] = []

    def above_zero(name: str, value: float | None, unit: str) -> float | None:
        found = None if value is None else arguments.real(name, value, unit)
        if found is not None and not 0.0 < found < math.inf:
            problems.append(f"the {name.replace('_', ' ')} {found!r} is not a number above 0; give {unit}")
        return found

    max_rate = above_zero("max_rate", max_rate, "input units per second")
    sample_time = above_zero("sample_time", sample_time, "seconds")
    rate = above_zero("rate", rate, "samples per second")
    if rate is not None and sample_time is not None:
        problems.append("the rate is the reciprocal of the sample time; give only one of them")
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
        sample_time = file.sample_time or file.recorded_at or SAMPLE_TIME
        whose = "the parameter file's" if file.sample_time else (
            "that of the records behind the model" if file.recorded_at
            else "chosen by default, since the parameter file has none"
        )
        defaults.append(f"The sample time of {sample_time:g} s is {whose}; --sample-time sets another.")
    if max_rate is None:
        max_rate = (high - low) / (FULL_SCALE * sample_time)
        unit = f" {file.units.input}/s" if file.units.input else "/s"
        defaults.append(
            f"The rate limit of {max_rate:.4g}{unit} was chosen by default: the whole range in {FULL_SCALE} sample "
            "times. If that is too fast for the amplifier or the stage, plan again with --max-rate."
        )
    tempo = Tempo.of(grid, max_rate, sample_time)
    records = [(each, every := each.every(tempo), written(each, grid, tempo, every)) for each in RECORDS]
    player = None if rate is None else _Player.of(grid, tempo, rate, dac, [(len(c) - 1) * e for _, e, c in records])
    drives, tick = [], 0 if player is None else player.first
    for number, (record, every, nodes) in enumerate(records, 1):
        v, codes = (np.array(grid.values(nodes)), None) if player is None else player.played(nodes, every)
        step = every if player is None else 1
        ticks = range(tick, tick + step * len(v), step)
        tick = ticks[-1] + tempo.rest
        drives.append(
            Drive(
                f"{number:02d}_{record.name}.csv", record.purpose, record.shows, record.held_out,
                tempo.seconds(step), tempo.seconds(every), np.array([tempo.seconds(k) for k in ticks]), v, codes,
            )
        )
    rest = tempo.seconds(tempo.rest)
    own = tuple(os.fspath(path) for path in effects)
    made = PlannedDrives(file, named, own, tuple(drives), (top, bottom), rest, max_rate, sample_time, tuple(defaults))
    return made if player is None else player.session(made)


def _dac(
    rate: float | None, bits: int | None, ends: Sequence[float] | None, coding: str, problems: list[str]
) -> Dac | None:
    """The requested converter; anything missing is added to `problems`."""
    arguments.choice("dac_coding", coding, converter.CODINGS)
    if bits is None and ends is None:
        return None
    if rate is None:
        problems.append("codes of a DAC need a rate; give the rate at which they are played, Hz")
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
    # the given options are still checked
    problems += () if bits is None else converter.wrong_bits(bits)
    problems += () if low_high is None else converter.wrong_range(*low_high)
    return None


@dataclass(frozen=True)
class _Player:
    """Plays drives through a converter at one rate: fills the ticks between their samples and joins the drives.

    `nodes`, `every`: the lead-in that establishes the history; `first`: tick at which the first record begins.
    """

    grid: Grid
    tempo: Tempo
    rate: float
    dac: Dac | None
    nodes: list[int]
    every: int

    @classmethod
    def of(cls, grid: Grid, tempo: Tempo, rate: float, dac: Dac | None, lengths: Sequence[int]) -> _Player:
        """A player for records of `lengths` ticks. Raises PlanError for more samples than a file should have."""
        every = tempo.every_of(1.0, SLOW_SAMPLES)
        made = cls(grid, tempo, rate, dac, lead_in(grid, tempo, every), every)
        samples = made.first + sum(lengths) + (len(lengths) - 1) * tempo.rest + 1
        if samples > MOST_SAMPLES:
            unit = 10.0 ** math.floor(math.log10(rate * MOST_SAMPLES / samples))
            fits = unit * math.floor(rate * MOST_SAMPLES / samples / unit)
            what = f"at {rate:g} Hz the session has {samples} samples, more than {MOST_SAMPLES}"
            raise PlanError([f"{what}; give a rate of {fits:g} Hz or less"])
        return made

    @property
    def first(self) -> int:
        """Tick at which the first record begins."""
        return (len(self.nodes) - 1) * self.every + self.tempo.rest

    def played(self, nodes: Sequence[int], every: int) -> tuple[Array, Codes | None]:
        """Drives and codes at every tick, from samples spaced `every` ticks apart."""
        if self.dac is None:
            return np.array(self.grid.values(converter.filled(nodes, every).tolist())), None
        codes = converter.filled(self.dac.codes(self.grid.values(nodes)), every)
        return self.dac.drives(codes), codes

    def session(self, plan: PlannedDrives) -> PlannedDrives:
        """The plan with its drives joined into one session."""
        parts, at, stretches = [], self.first, [(len(self.nodes) - 1, self.every)]
        lead = self.played(self.nodes, self.every)
        pieces = [lead]
        for drive in plan.drives:
            hold = at - sum(len(v) for v, _ in pieces)
            before, code = pieces[-1]
            pieces.append((np.repeat(before[-1:], hold), None if code is None else np.repeat(code[-1:], hold)))
            pieces.append((drive.v, drive.codes))
            parts.append(PlayedRecord(drive.name, at, len(drive.v), drive.held_out))
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


def lasting(seconds: float) -> str:
    """A duration in everyday words."""
    for unit, size in (("h", 3600.0), ("min", 60.0)):
        if seconds >= 2.0 * size:
            return f"{seconds / size:.1f} {unit}"
    return f"{seconds:.3g} s"
