"""The same work on several items, in forked copies of this process or in its threads.

A copy (fork) starts with everything that this process had in memory, so little has to be sent. The results are the same
as from a plain loop, in whatever order the processes finish. Where forking is not safe, a plain loop does the work.
"""

from __future__ import annotations

import contextlib
import gc
import mmap
import os
import signal
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Generic, TypeVar

from hystgen.basics import extras

if TYPE_CHECKING:
    from multiprocessing.connection import Connection
    from multiprocessing.context import ForkProcess


T = TypeVar("T")
R = TypeVar("R")

MOST_PROCESSES = 16
"""[processes] Maximum number; each keeps its own results in memory."""

_at_work: Sequence[int] | memoryview[int] = (0,)
"""Number of busy workers in this process's pool."""

def cores() -> int:
    """Maximum number of processes here; 1 if forking is not safe.

    A lock held by another thread would stay locked in a copy, and some system libraries do not survive a fork.
    """
    import multiprocessing

    if sys.platform != "linux" or threading.active_count() > 1 or multiprocessing.current_process().daemon:
        return 1
    return _cores()


def _cores() -> int:
    available = len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1
    return min(available, MOST_PROCESSES)


def each(
    work: Callable[[T], R], items: Sequence[T], jobs: int, tick: Callable[[], None] = lambda: None
) -> list[R]:
    """`[work(item) for item in items]` with `jobs` processes; results are pickled, and each item calls `tick`.

    An item that fails or kills its worker is rerun in this process, so an exception is raised as in a plain loop.
    """
    pool: Pool[int, R] = Pool(lambda k: work(items[k]), jobs)
    with pool:
        return [result for _, result in pool.each(range(len(items)), tick)]


@dataclass(eq=False)
class _Pending(Generic[T, R]):
    item: T
    done: list[R] = field(default_factory=list)
    """the task's result, empty until then"""
    after: list[_Pending[T, R]] = field(default_factory=list)


class Pool(Generic[T, R]):
    """Up to `jobs` processes for the same work on items that arrive one after the other; leaving `with` ends them.

    The processes start as copies of this one when the first items arrive; items and results are pickled.
    """

    def __init__(self, work: Callable[[T], R], jobs: int) -> None:
        self._work, self._jobs = work, jobs
        self._workers: dict[Connection, ForkProcess] = {}
        self._at_work = memoryview(mmap.mmap(-1, mmap.PAGESIZE)).cast("i")  # shared with the copies

    def __enter__(self) -> Pool[T, R]:
        return self

    def __exit__(self, *_: object) -> None:
        for process in self._workers.values():
            process.kill()
        for reach, process in self._workers.items():
            process.join()
            reach.close()

    def each(
        self,
        items: Iterable[T],
        tick: Callable[[], None] = lambda: None,
        then: Callable[[T, R], Iterable[T]] = lambda *_: (),
    ) -> list[tuple[T, R]]:
        """Every item with its result, in the order of a plain loop; `tick` is called once for each.

        `then`: further items that follow from a result; they are next in line. An item that fails or kills its worker
        is rerun in this process, so an exception is raised as in a plain loop.
        """
        tasks = [_Pending[T, R](item) for item in items]

        def finish(task: _Pending[T, R], result: R) -> list[_Pending[T, R]]:
            task.done.append(result)
            task.after.extend(_Pending(item) for item in then(task.item, result))
            tick()
            return task.after

        if self._workers or min(self._jobs, len(tasks)) > 1:
            self._elsewhere(deque(tasks), finish)
        found = []
        for task in tasks:  # grows in the loop
            if not task.done:
                finish(task, self._work(task.item))
            tasks.extend(task.after)
            found.append((task.item, task.done[0]))
        return found

    def _elsewhere(
        self, waiting: deque[_Pending[T, R]], finish: Callable[[_Pending[T, R], R], list[_Pending[T, R]]]
    ) -> None:
        """Run the tasks in the processes; after a failure, some may remain undone."""
        from multiprocessing import connection

        self._gather(len(waiting))
        free = list(self._workers)
        busy: dict[Connection, _Pending[T, R]] = {}
        failed = False
        while True:
            while free and waiting and not failed:
                reach, task = free.pop(), waiting.popleft()
                busy[reach] = task
                with contextlib.suppress(BrokenPipeError):  # noticed below
                    reach.send(task.item)
            self._at_work[0] = len(busy)
            if not busy:
                return
            ready = connection.wait(list(busy))
            for reach in [each for each in busy if each in ready]:
                task = busy.pop(reach)
                try:
                    result, failing = reach.recv()
                except (EOFError, ConnectionResetError):
                    self._workers.pop(reach).join()
                    reach.close()
                    continue
                free.append(reach)
                failed |= failing
                if not failing:
                    waiting.extendleft(finish(task, result))

    def _gather(self, most: int) -> None:
        """Start one process for each of `most` tasks, but no more than `jobs` processes."""
        import multiprocessing

        fork = multiprocessing.get_context("fork")
        # Only this process handles interrupts; a copy that received one before ignoring them would print a traceback
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            while len(self._workers) < min(self._jobs, most):
                here, there = fork.Pipe()
                others = [here, *self._workers]
                process = fork.Process(target=_serve, args=(self._work, there, others, self._at_work), daemon=True)
                try:
                    process.start()
                except OSError:  # no room for another, so continue with those already running, or without any
                    here.close()
                    return
                finally:
                    there.close()
                self._workers[here] = process
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _serve(
    work: Callable[[T], R], reach: Connection, others: Sequence[Connection], at_work: memoryview[int]
) -> None:
    global _at_work
    _at_work = at_work
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for ending in (signal.SIGTERM, signal.SIGHUP):  # the original process handles these signals
        signal.signal(ending, signal.SIG_DFL)
    gc.freeze()  # a garbage collection would copy all of the parent's memory
    for each in others:  # inherited pipe ends, which would keep copies waiting for each other once the parent is gone
        each.close()
    while True:
        try:
            item = reach.recv()
            try:
                answer: tuple[R | None, bool] = work(item), False
            except Exception:
                answer = None, True
            reach.send(answer)
        except (EOFError, OSError):
            return


def in_threads(work: Callable[[T], None], items: Sequence[T]) -> None:
    """Call `work(item)` for all items, in threads that end with the call; only compiled work runs in parallel.

    Threads are used only while cores are idle, as when the last busy worker of a pool has a long task.
    """
    room = min(len(items), _cores() // max(1, _at_work[0]))
    if room < 2:
        for item in items:
            work(item)
        return
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(room) as pool:
        for _ in pool.map(work, items):
            pass


# Linear algebra threads --------------------------------------------------------------------------------------


def one_thread() -> contextlib.AbstractContextManager[object]:
    """Context in which linear algebra uses a single thread: on small matrices, several would wait for each other."""
    try:
        import scipy.linalg  # noqa: F401  # has its own BLAS, which would not be limited if loaded later
        from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]
    except ImportError:
        extras.require_fit("a fit")
        raise

    found: contextlib.AbstractContextManager[object] = threadpool_limits(1)
    return found
