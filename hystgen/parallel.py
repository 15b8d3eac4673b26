"""The same work on several things, in processes that are copies of this one, or in threads of it.

A copy (fork) sees all that this process has, so that nothing but results is sent, and they are those of a plain loop
whatever the processes' order. Where processes cannot be copied safely it is a plain loop.
"""

from __future__ import annotations

import gc
import os
import signal
import sys
import threading
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

T = TypeVar("T")
R = TypeVar("R")

MOST = 16
"""Processes at most; each has its own results in memory."""

_NUMBER = 4
"""Bytes of a number in the queue."""


def cores() -> int:
    """How many processes may run here; 1 where they cannot be copied.

    A lock that another thread holds would stay locked in a copy, and libraries of other systems do not bear it.
    """
    import multiprocessing

    if sys.platform != "linux" or threading.active_count() > 1 or multiprocessing.current_process().daemon:
        return 1
    return _cores()


def _cores() -> int:
    available = len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1
    return min(available, MOST)


def each(
    work: Callable[[T], R], items: Sequence[T], jobs: int, tick: Callable[[], None] = lambda: None
) -> list[R]:
    """`[work(item) for item in items]` by so many processes; results are pickled, `tick` is called for each of them.

    What fails in a process, or takes it down, is repeated here: an exception is raised as in a plain loop.
    """
    done = _elsewhere(work, items, jobs, tick) if min(jobs, len(items)) > 1 else {}
    results = []
    for k, item in enumerate(items):
        if k in done:
            results.append(done[k])
        else:
            results.append(work(item))
            tick()
    return results


def in_threads(work: Callable[[T], None], items: Sequence[T]) -> None:
    """`work(item)` for all items, in threads that are gone when it is done; compiled work runs side by side there.

    Of use where a core has nothing else to do, as when the last of several processes is left with a long task.
    """
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(max(1, min(len(items), _cores()))) as pool:
        for _ in pool.map(work, items):
            pass


def _elsewhere(work: Callable[[T], R], items: Sequence[T], jobs: int, tick: Callable[[], None]) -> dict[int, R]:
    """Results by number; those behind a failure may be missing."""
    import multiprocessing
    from multiprocessing import connection

    fork = multiprocessing.get_context("fork")
    queue, filling = os.pipe()
    os.write(filling, b"".join(k.to_bytes(_NUMBER, "little") for k in range(len(items))))
    os.close(filling)
    processes, readers = [], []
    done: dict[int, R] = {}
    # An interrupt is for this process; a copy that got it before it can ignore it would say so
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        try:
            for _ in range(min(jobs, len(items))):
                reader, writer = fork.Pipe(duplex=False)
                readers.append(reader)
                process = fork.Process(target=_work, args=(work, items, queue, writer, os.getpid()), daemon=True)
                processes.append(process)
                process.start()
                writer.close()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        while readers:
            for reader in [each for each in connection.wait(readers) if isinstance(each, connection.Connection)]:
                try:
                    k, result, failed = reader.recv()
                except EOFError:
                    readers.remove(reader)
                    continue
                if failed:
                    while os.read(queue, _NUMBER):
                        pass
                else:
                    done[k] = result
                    tick()
    finally:
        os.close(queue)
        for process in processes:
            if process.pid is not None:
                process.kill()
                process.join()
    return done


def _work(work: Callable[[Any], Any], items: Sequence[Any], queue: int, results: Connection, parent: int) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    gc.freeze()  # looking through what is the parent's would take long, and copy all of it
    while os.getppid() == parent and (number := os.read(queue, _NUMBER)):
        k = int.from_bytes(number, "little")
        try:
            answer = (k, work(items[k]), False)
        except Exception:
            answer = (k, None, True)
        results.send(answer)
