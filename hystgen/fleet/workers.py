"""Fitting units in other processes: on this machine (joblib) or on the workers of a Dask cluster.

A task contains the bytes of its records, and a result the text of its files, so a worker needs the package but access
to neither the records nor the output folder.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import signal
import tempfile
import threading
import time
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hystgen.basics import extras, writing
from hystgen.basics.version import __version__
from hystgen.identification.settings import Settings

if TYPE_CHECKING:
    from distributed import Client, Future

    from hystgen.identification.fit import Fit
    from hystgen.model import Model

LOST = "the Dask scheduler was lost; the same command resumes from here"
DIED = "the process that fitted this unit kept dying; is there too little memory for its records?"

PATIENCE = 15.0
"""[s] Time allowed for a scheduler to answer, and again for it to get a worker."""

IDLE = 30.0
"""[s] Time after which an idle process ends."""

WATCH = 1.0
"""[s] Interval at which a process checks that its parent is still alive."""


class SchedulerError(OSError):
    """A scheduler that cannot be used; `str()` says why and what to do."""


@dataclass(frozen=True)
class Task:
    """One unit: its C name, `records` and `holdout` as (path, bytes or None if unreadable), and the requested results.

    `options`: of `identify`; `emission`: of `emit`, or None to leave out the C; `settings`: of an older parameter file.
    """

    unit: str
    records: tuple[tuple[str, bytes | None], ...]
    holdout: tuple[tuple[str, bytes | None], ...]
    options: Mapping[str, Any]
    emission: Mapping[str, str | None] | None
    settings: Settings = field(default_factory=Settings)
    version: str = __version__


@dataclass(frozen=True)
class UnitResult:
    """The result of a task: text of the parameter file, C files by name, figures; `message` describes the failure."""

    unit: str
    message: str = ""
    parameters: str = ""
    files: Mapping[str, str] = field(default_factory=dict)
    figures: Mapping[str, object] = field(default_factory=dict)


Work = Callable[[Task], UnitResult]


def fit_unit(task: Task) -> UnitResult:
    """Fit and emit one unit. Never raises an Exception: a failure becomes the result's message."""
    if task.version != __version__:
        what = f"the worker has hystgen {__version__}, not {task.version}; install the same version"
        return UnitResult(task.unit, what)
    with writing.temporary() as folder:
        paths = {}
        for k, (path, data) in enumerate((*task.records, *task.holdout)):
            copy = folder / str(k) / Path(path).name
            copy.parent.mkdir()
            paths[str(copy)] = path
            if data is not None:
                copy.write_bytes(data)
        copies = list(paths)
        try:
            return _fitted(task, copies[: len(task.records)], copies[len(task.records) :])
        except Exception as failure:
            message = _line(failure)
        for copy_path, path in paths.items():
            message = message.replace(copy_path, path)
        return UnitResult(task.unit, message)


def _fitted(task: Task, records: list[str], holdout: list[str]) -> UnitResult:
    from hystgen import identification
    from hystgen.emission import calls
    from hystgen.model import Model
    from hystgen.records import in_units, read_records

    reading = {name: task.options[name] for name in ("columns", "sample_time", "delimiter") if name in task.options}
    sources = [*records, *holdout]
    read = in_units(
        read_records(sources, points=True, **reading),
        file=(task.settings.file, task.settings.units),
        named=("units", task.options.get("units")),
        sources=sources,
    )
    to_fit, to_hold = read[: len(records)], read[len(records) :]
    fit = task.settings.on(identification.identify(to_fit, holdout=to_hold, name=task.unit, **task.options))
    model = Model(fit.parameters)
    text, figures = fit.text(), _figures(fit, model)
    if task.emission is None:
        return UnitResult(task.unit, "", text, {}, figures)
    try:
        return UnitResult(task.unit, "", text, calls.emitted_files(model, **task.emission), figures)
    except Exception as failure:
        return UnitResult(task.unit, f"fitted, but not emitted: {_line(failure)}", text, {}, figures)


def _line(failure: Exception) -> str:
    """The reason for a failure, on one line."""
    from hystgen.basics.problems import NotInvertibleError

    if isinstance(failure, NotInvertibleError):
        return "no inverse: " + "; ".join(failure.reasons)
    first, *more = str(failure).splitlines() or [""]
    if not isinstance(failure, ValueError | OSError):
        first = f"unexpected {type(failure).__name__}: {first}"
    return first + (f" (and {len(more)} more)" if more else "")


def _figures(fit: Fit, model: Model) -> dict[str, object]:
    """The unit's columns of the summary."""
    cascade = model.cascade
    low, high = cascade.output_range
    stages = fit.parameters.model.memoryless
    kinds = {"dead_zone": "gpi-deadzone", "tanh": "gpi-tanh"}
    own = next(row for row in fit.rows if row.model == "written" and row.part in ("fit", "all"))
    held = next((row for row in fit.rows if row.part == "held out"), None)
    return {
        "kind": kinds[stages[0].kind] if stages else "pi",
        "plays": cascade.pi.n,
        "p_0": float(cascade.pi.weights[0]),
        "width": float(cascade.pi.width),
        "gain": float((high - low) / (cascade.input_range[1] - cascade.input_range[0])),
        "output_low": float(low),
        "output_high": float(high),
        "fit_rms": own.rms,
        "fit_rms_percent": own.rms_percent,
        "held_out_rms": held.rms if held else None,
        "held_out_rms_percent": held.rms_percent if held else None,
        "warnings": len(fit.warnings),
    }


def _begin(folder: str, parent: int) -> None:
    """Set up a worker process; the process that started it, `parent`, ends it and cleans up.

    Ctrl-C reaches every process attached to the terminal, so workers ignore it. Temporary files go into a folder that
    the parent removes. A worker ends when its parent is killed, instead of waiting forever to deliver its results.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    tempfile.tempdir = folder
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: int) -> None:
    """End this process when its parent is gone."""
    while os.getppid() == parent:
        time.sleep(WATCH)
    os._exit(1)


def on_this_machine(tasks: Iterable[Task], jobs: int, work: Work = fit_unit) -> Generator[UnitResult, None, None]:
    """Results in order of completion, from `jobs` processes (1: from this one); tasks are taken as needed.

    A process that dies takes the whole pool down with it. The units in progress are then repeated one by one: only a
    unit whose process dies again has failed, and the others continue.
    """
    with writing.temporary() as folder:
        yield from _pooled(tasks, jobs, work, str(folder))


def _pooled(tasks: Iterable[Task], jobs: int, work: Work, folder: str) -> Generator[UnitResult, None, None]:
    from joblib import Parallel, delayed, parallel_config

    waiting = iter(tasks)
    sent: dict[str, Task] = {}

    def calls() -> Iterator[Any]:
        for task in waiting:
            sent[task.unit] = task
            yield delayed(work)(task)

    def pool(**how: object) -> Any:
        apart: dict[str, object] = {"inner_max_num_threads": 1, "idle_worker_timeout": IDLE}
        apart |= {"initializer": _begin, "initargs": (folder, os.getpid())}
        with parallel_config("loky", **apart) if jobs > 1 else parallel_config("sequential"):
            return Parallel(n_jobs=jobs, batch_size=1, return_as="generator_unordered", **how)

    while True:
        results = pool(pre_dispatch="2*n_jobs")(calls())
        try:
            for result in results:
                del sent[result.unit]
                yield result
            return
        except BrokenProcessPool:
            for task in list(sent.values()):
                try:
                    yield from pool()([delayed(work)(task)])
                except BrokenProcessPool:
                    yield UnitResult(task.unit, DIED)
            sent.clear()
        finally:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # cancelling tasks that nobody waits for warns
                results.close()


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep the cluster libraries from logging tracebacks for errors that we report in one line."""
    names = [name for name in logging.root.manager.loggerDict if name.split(".")[0] in ("distributed", "tornado")]
    before = {logger: logger.level for logger in map(logging.getLogger, [*names, "asyncio"])}
    for logger in before:
        logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for logger, level in before.items():
            logger.setLevel(level)


@contextlib.contextmanager
def cluster(address: str) -> Iterator[Client]:
    """A client of the Dask scheduler at `address`, once the scheduler has a worker. Raises SchedulerError."""
    try:
        from distributed import Client
    except ModuleNotFoundError:
        raise SchedulerError(f"a scheduler needs Dask; install it with: {extras.install('fleet')}") from None
    with _quiet():
        try:
            asyncio.run(_answer(address))  # an unanswered client would wait once more when it is deleted
            client = Client(address, timeout=PATIENCE, set_as_default=False)
        except Exception as failure:  # each protocol has its own errors
            reason = (str(failure).splitlines() or [type(failure).__name__])[0]
            raise SchedulerError(f"no Dask scheduler answers at {address}: {reason}") from None
        with client:
            try:
                client.wait_for_workers(1, timeout=PATIENCE)
            except TimeoutError:
                raise SchedulerError(f"the Dask scheduler at {address} has no workers; start some") from None
            yield client


async def _answer(address: str) -> None:
    """Wait until a Dask scheduler answers; each protocol raises its own errors if it does not."""
    from distributed.comm import connect
    from distributed.security import Security

    comm = await connect(address, timeout=PATIENCE, **Security().get_connection_args("client"))
    comm.abort()


def on_cluster(tasks: Iterable[Task], client: Client, work: Work = fit_unit) -> Generator[UnitResult, None, None]:
    """Results in order of completion, from the workers of a Dask scheduler.

    Only as many tasks are in flight as the workers need next, which keeps the number of records in memory small. Dask
    repeats the tasks of a dying worker; a unit that keeps killing workers counts as failed. Raises SchedulerError.
    """
    from distributed import as_completed
    from distributed.scheduler import KilledWorker

    waiting = iter(tasks)
    under_way: dict[Future, str] = {}
    finished = as_completed(loop=client.loop)

    def refill() -> None:
        try:
            wanted = 2 * max(sum(client.nthreads().values()), 1)
        except OSError:
            raise SchedulerError(LOST) from None
        while len(under_way) < wanted and (task := next(waiting, None)) is not None:
            future = client.submit(work, task, pure=False)
            under_way[future] = task.unit
            finished.add(future)

    try:
        refill()
        for future in finished:
            unit = under_way.pop(future)
            if future.status not in ("finished", "error"):
                raise SchedulerError(LOST)
            try:
                result = future.result()
            except KilledWorker:
                result = UnitResult(unit, DIED)
            except Exception as failure:
                result = UnitResult(unit, _line(failure))
            yield result
            refill()
    finally:
        client.cancel(list(under_way))
