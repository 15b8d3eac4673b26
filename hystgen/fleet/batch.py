"""Fitting and emitting a fleet: many units of one design, with one record each.

>>> fleet = hystgen.identify_batch("units/*.csv", "params", holdout="holdout/{unit}.csv")
>>> print(fleet.table())
>>> fleet.failed, fleet.outliers
"""

from __future__ import annotations

import contextlib
import csv
import glob
import hashlib
import inspect
import io
import json
import math
import os
import warnings
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from hystgen import identification
from hystgen.basics import arguments, display, extras, writing
from hystgen.basics.problems import counted
from hystgen.basics.progress import Progress
from hystgen.basics.version import __version__
from hystgen.emission.calls import emit_options
from hystgen.fleet import outliers, workers
from hystgen.fleet.workers import Task, UnitResult
from hystgen.identification import settings
from hystgen.identification.settings import Settings
from hystgen.records import Record, several, suffixes, write_atomically

KEPT_IN = ".hystgen"
"""Folder, inside the output folder, with the results of finished units."""

FIGURES = (
    "kind", "plays", "p_0", "width", "gain", "output_low", "output_high", "fit_rms", "fit_rms_percent",
    "held_out_rms", "held_out_rms_percent", "warnings",
)
COLUMNS = ("unit", "file", "status", "message", *FIGURES, "outlier", "outlier_in", "sha256")


@dataclass(frozen=True)
class Unit:
    """One row of the summary.

    `name`: C identifier of the model; `file`: the unit's record; `done`: whether it succeeded, otherwise `message`
    describes the failure in one line; `figures`: see `FIGURES`; `outlier`: the figures in which the unit differs from
    the rest, and by how much; empty if there are none; `sha256`: hash of records, options, settings and tool version;
    `kept`: whether an earlier call did the work; `settings`: keys kept from the existing parameter file.
    """

    name: str
    file: str
    done: bool
    message: str
    figures: Mapping[str, object]
    sha256: str
    outlier: str = ""
    kept: bool = False
    settings: tuple[str, ...] = ()


@dataclass(frozen=True)
class Fleet:
    """All units of a call, sorted by name; `judged` is False if there are too few to mark outliers. `folder`: of their
    parameter files; `options`: of `identify`."""

    units: tuple[Unit, ...]
    judged: bool
    folder: Path = field(default=Path(), compare=False)
    options: Mapping[str, object] = field(default_factory=dict, compare=False)

    def _repr_html_(self) -> str:
        head, *rows = csv.reader(io.StringIO(self.summary()))
        line = f"{counted(len(self.units), 'unit')}, {len(self.failed)} failed"
        return display.block(line, rows=[row[:-1] for row in (head, *rows)])  # without the hash

    @property
    def failed(self) -> tuple[Unit, ...]:
        """Units that have no model, or whose C could not be emitted."""
        return tuple(unit for unit in self.units if not unit.done)

    @property
    def outliers(self) -> tuple[Unit, ...]:
        """Units that differ from the rest."""
        return tuple(unit for unit in self.units if unit.outlier)

    def summary(self) -> str:
        """One CSV row per unit: the same bytes for any order and number of processes."""
        text = io.StringIO()
        table = csv.writer(text, lineterminator="\n")
        table.writerow(COLUMNS)
        for unit in self.units:
            judgement = ("yes" if unit.outlier else "no") if self.judged else "not judged"
            cells = [unit.name, unit.file, "done" if unit.done else "failed", unit.message]
            cells += [_cell(unit.figures.get(name)) for name in FIGURES]
            cells += [judgement if unit.done else "", unit.outlier, unit.sha256]
            table.writerow([cell.encode("utf-8", "backslashreplace").decode() for cell in cells])
        return text.getvalue()

    def table(self) -> str:
        """The counts, followed by a line for each failed unit and each outlier."""
        kept = sum(unit.kept for unit in self.units)
        found = f"{len(self.outliers)} of them outliers" if self.judged else "outliers not judged"
        lines = [
            f"{counted(len(self.units), 'unit')}: {len(self.units) - len(self.failed)} done "
            f"({kept} by an earlier call), {found}; {len(self.failed)} failed"
        ]
        if not self.judged:
            lines.append(f"outliers are marked only with {outliers.FEWEST} or more units")
        taken = [unit for unit in self.units if unit.settings and unit.done and not unit.kept]
        if taken:
            keys = ", ".join(dict.fromkeys(key for unit in taken for key in unit.settings))
            lines.append(f"{keys} kept from the existing parameter files of {len(taken)} units")
        marked = [("failed", unit.name, unit.message) for unit in self.failed]
        marked += [("outlier", unit.name, unit.outlier) for unit in self.outliers]
        width = max((len(name) for _, name, _ in marked), default=0)
        lines += [f"{what:7}  {name:{width}}  {why}" for what, name, why in marked]
        return "\n".join(lines) + "\n"


@dataclass(frozen=True)
class _Job:
    """The task for a unit; `key`: hash of everything that the unit's outputs depend on."""

    unit: str
    file: str
    holdout: tuple[str, ...]
    settings: Settings = field(default_factory=Settings)
    key: str = ""


def identify_batch(
    sources: str | os.PathLike[str] | Iterable[str | os.PathLike[str]],
    output: str | os.PathLike[str],
    *,
    holdout: str | Iterable[str] = (),
    emit: bool = True,
    emission: Mapping[str, str | None] | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    progress: bool = False,
    **options: Any,
) -> Fleet:
    """Fit a model to every unit of a fleet, and emit its C.

    `sources`: files, patterns such as `units/*.csv`, and folders; every file is one unit, named after the file as a C
    identifier. `output`: a folder that receives, for each unit, `UNIT.yaml`, identical to the file that `identify`
    writes for that unit alone, and the C files of `emit` in a folder `UNIT`; and at the end `summary.csv`, sorted by
    unit. `holdout`: paths of held-out records in which `{unit}` stands for the name of the unit's file without its
    suffix; these files are not units. `emit`: False omits the C files; `emission`: options of `emit`. `jobs`: number of
    processes, all cores by default. `scheduler`: address of a Dask scheduler, whose workers then do the work and need
    the package, but no access to any file. `progress`: a progress bar on a terminal's stderr. Other options are those
    of `identify`.

    A unit that fails gets a row with its message and does not stop the others; its older files are kept. A later call
    does not repeat finished work, as long as the record, options and tool version are the same and the files are
    unchanged. After an interrupted call, all files are complete and finished units are kept. When an existing parameter
    file is rewritten, its description, `sample_time` and `emit` are kept.

    Units are outliers by the modified z-scores of `outliers`: a held-out rms error (logarithm of %) far above the
    others, or a gain (output range over drive range), width or p_0 far off; with fewer than 8 finished units, none is
    marked. Raises ValueError for arguments that do not suit any unit, FileNotFoundError if a source matches no file,
    workers.SchedulerError, an OSError, for an unusable scheduler.
    """
    extras.require_fit("identify_batch")
    output = arguments.path("output", output)
    options = _complete(options)
    identification.check_options(**options)
    if jobs is not None:
        arguments.whole("jobs", jobs, "processes", 1)
    if emission is not None:
        arguments.known_options("emission of identify_batch", emit_options, emission)
    patterns = [holdout] if isinstance(holdout, str) else list(holdout)
    found = _jobs(sources, patterns)
    folder = writing.destination(output)
    if any(Path(file).resolve().parent == folder for job in found for file in (job.file, *job.holdout)):
        what = f"{os.fspath(output)} contains records, and summary.csv would be taken for one of them"
        raise ValueError(f"{what}; use another folder")
    wanted = dict(emission or {}) if emit else None
    with workers.cluster(scheduler) if scheduler is not None else contextlib.nullcontext() as client:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / KEPT_IN).mkdir(exist_ok=True)
        writing.check_files(folder, ["summary.csv"])
        found = [replace(job, settings=settings.of(folder / f"{job.unit}.yaml")) for job in found]
        found = [_keyed(job, options, wanted) for job in found]
        rows = _kept_rows(folder, found)
        todo = {job.unit: job for job in found if job.unit not in rows}
        tasks = (_task(job, options, wanted) for job in todo.values())
        with Progress(len(found), progress, "fleet") as bar:
            bar.tick(len(rows))
            work = workers.on_cluster(tasks, client) if client else _here(tasks, len(todo), jobs, options)
            with contextlib.closing(work) as results:
                for result in results:
                    rows[result.unit] = _keep(folder, todo[result.unit], result)
                    bar.tick(1)
    fleet = replace(_judged([rows[job.unit] for job in found]), folder=folder, options=options)
    write_atomically(folder / "summary.csv", fleet.summary())
    return fleet


def _complete(options: Mapping[str, object]) -> dict[str, Any]:
    """All options of `identify` that are the same for every unit, with defaults for those not given."""
    own = {"holdout": (), "name": "", "progress": False}
    arguments.known_options("identify_batch", identification.identify, options)
    bound = inspect.signature(identification.identify).bind((), **own, **options)
    bound.apply_defaults()
    return {name: value for name, value in bound.arguments.items() if name not in ("records", *own)}


# -- units to fit -----------------------------------------------------------------------------------------------------


def _jobs(
    sources: str | os.PathLike[str] | Iterable[str | os.PathLike[str]], patterns: Sequence[str]
) -> list[_Job]:
    """The units, sorted by name. Raises ValueError if names clash, FileNotFoundError."""
    for pattern in patterns:
        if "{unit}" not in pattern:
            raise ValueError(f"holdout {pattern!r} would be the same for all units; write {{unit}} for the unit's name")
    paths: dict[Path, Path] = {}
    for source in several(sources):
        if not isinstance(source, str | os.PathLike):
            raise TypeError("a fleet consists of files, not of records in memory; fit those with hystgen.identify")
        paths |= {path.resolve(): path for path in _expanded(os.fspath(source))}
    jobs = []
    for path in paths.values():
        held = tuple(pattern.replace("{unit}", path.stem) for pattern in patterns)
        jobs.append(_Job(identification.identifier_from(path.stem), str(path), held))
    held_out = {Path(name).resolve() for job in jobs for name in job.holdout}
    jobs = sorted((job for job in jobs if Path(job.file).resolve() not in held_out), key=lambda job: job.unit)
    taken: dict[str, str] = {}
    clashes = []
    for job in jobs:
        other = taken.setdefault(job.unit.lower(), job.file)  # file systems and macros may ignore case
        if other != job.file:
            clashes.append(f"{other} and {job.file} would both be unit {job.unit}; rename one")
    if clashes:
        raise ValueError("\n".join(clashes))
    if not jobs:
        raise FileNotFoundError("there are no units; every file found is a held-out record of another")
    return jobs


def _expanded(source: str) -> list[Path]:
    """The files to which a path, a folder or a pattern refers, sorted."""
    path = Path(source)
    if path.is_dir():
        found = [file for file in path.iterdir() if file.suffix.lower() in suffixes() and not file.name.startswith(".")]
    else:
        found = [path] if path.is_file() else [Path(name) for name in glob.glob(source, recursive=True)]
    found = sorted(file for file in found if file.is_file())
    if not found:
        raise FileNotFoundError(f"no file matches {source}; give the recordings, one per unit, as a pattern in quotes")
    return found


# -- finished units ---------------------------------------------------------------------------------------------------


def _keyed(job: _Job, options: Mapping[str, object], emission: Mapping[str, str | None] | None) -> _Job:
    content = {
        "tool": __version__,
        "unit": job.unit,
        "record": [Path(job.file).name, _digest(Path(job.file))],
        "holdout": [[Path(path).name, _digest(Path(path))] for path in job.holdout],
        "options": options,
        "emission": emission,
    }
    if job.settings.values:
        content["settings"] = job.settings.values
    text = json.dumps(content, sort_keys=True, default=lambda value: np.asarray(value).tolist())
    return replace(job, key=hashlib.sha256(text.encode()).hexdigest())


def _digest(path: Path) -> str | None:
    """SHA-256 of a file, None if it cannot be read."""
    try:
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError:
        return None


def _kept_rows(folder: Path, jobs: Sequence[_Job]) -> dict[str, Unit]:
    """The units finished by an earlier call; warns if the notes on some of them cannot be read."""
    rows = {}
    unreadable = []
    for job in jobs:
        try:
            kept = _kept(folder, job)
        except (OSError, ValueError, RecursionError):
            unreadable.append(job.unit)
            continue
        if kept is not None:
            rows[job.unit] = kept
    if unreadable:
        files_of = f"{folder / KEPT_IN / unreadable[0]}.json cannot be read"
        more = f", and {len(unreadable) - 1} more" if len(unreadable) > 1 else ""
        warnings.warn(f"{files_of}{more}; these units are fitted again", stacklevel=3)
    return rows


def _kept(folder: Path, job: _Job) -> Unit | None:
    """The unit as finished by an earlier call; None if it was not finished or if anything has changed since.

    Raises OSError, ValueError or RecursionError for notes not written by this package.
    """
    try:
        known = json.loads((folder / KEPT_IN / f"{job.unit}.json").read_text("ascii"))
    except FileNotFoundError:
        return None
    if not (isinstance(known, dict) and isinstance(known.get("sha256"), str)):
        raise ValueError("not the notes of a unit")
    if known["sha256"] != job.key:
        return None
    outputs, figures = known.get("outputs"), known.get("figures")
    if not (isinstance(outputs, dict) and isinstance(figures, dict) and figures.keys() == set(FIGURES)):
        raise ValueError("no outputs or figures")
    for name, value in figures.items():
        sort = str if name == "kind" else int | float | None
        if not isinstance(value, sort) or isinstance(value, bool):
            raise ValueError(f"{name} has no usable value")
    if any(_digest(folder / name) != digest for name, digest in outputs.items()):
        return None
    return Unit(job.unit, job.file, True, "", figures, job.key, kept=True)


def _keep(folder: Path, job: _Job, result: UnitResult) -> Unit:
    """Write the files of a unit and, last, the note that it is done."""
    message = result.message
    try:
        written = []
        if result.files:
            written += writing.write_files(folder / job.unit, result.files)
        if result.parameters:
            write_atomically(folder / f"{job.unit}.yaml", result.parameters)
            written.append(folder / f"{job.unit}.yaml")
        if not message:
            known = {
                "sha256": job.key,
                "outputs": {path.relative_to(folder).as_posix(): _digest(path) for path in written},
                "figures": result.figures,
            }
            write_atomically(folder / KEPT_IN / f"{job.unit}.json", json.dumps(known, indent=1) + "\n")
    except OSError as failure:
        message = f"cannot be written: {failure}"
    return Unit(job.unit, job.file, not message, message, result.figures, job.key, settings=tuple(job.settings.values))


# -- the work ---------------------------------------------------------------------------------------------------------


def _task(job: _Job, options: Mapping[str, object], emission: Mapping[str, str | None] | None) -> Task:
    held = tuple((path, _bytes(path)) for path in job.holdout)
    return Task(job.unit, ((job.file, _bytes(job.file)),), held, options, emission, job.settings)


def _bytes(path: str) -> bytes | None:
    try:
        return Path(path).read_bytes()
    except OSError:
        return None


def _here(
    tasks: Iterator[Task], number: int, jobs: int | None, options: Mapping[str, object]
) -> Generator[UnitResult, None, None]:
    """Results from this machine, once its cache of compiled functions is filled."""
    import joblib

    processes = max(min(jobs or joblib.cpu_count(), number), 1)
    if processes > 1:
        _compile(str(options.get("model", "pi")))
    return workers.on_this_machine(tasks, processes)


def _compile(model: str) -> None:
    """Fill the machine's cache of compiled code, which every process would otherwise compile for itself."""
    t = np.arange(240.0)
    v = np.sin(t / 20.0) * np.linspace(0.3, 1.0, len(t))
    with contextlib.suppress(ValueError):
        identification.identify(Record("", t, v, v + 0.1 * np.roll(v, 3)), model=model, thresholds=2)


# -- the summary ------------------------------------------------------------------------------------------------------


def _judged(units: Sequence[Unit]) -> Fleet:
    found = outliers.find({unit.name: unit.figures for unit in units if unit.done})
    marks = found or {}
    return Fleet(tuple(replace(unit, outlier=marks.get(unit.name, "")) for unit in units), found is not None)


def _cell(value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, float):
        return f"{value:.6g}" if math.isfinite(value) else ""
    return str(value)
