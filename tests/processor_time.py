"""Processor time of a test run: by file and kind at the end of the run, and by test in the file of `--cpu`.

    python -m pytest --cpu build/cpu.csv ..

Kinds are `python`, `numba` (compiling), and the command of each process that a test waited for; processes of a pool
count as `python`. A fixture of several tests is charged to the first of them. Without `--cpu`, compiling in the test
that imports numba counts as `python`, because importing it early would slow down a run of few tests.
"""

from __future__ import annotations

import contextlib
import csv
import importlib
import importlib.util
import os
import resource
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

FILES_SHOWN = 8
TICK = os.sysconf("SC_CLK_TCK")

TIMES = pytest.StashKey["Times"]()


class Times:
    """Seconds of processor time by test and kind."""

    def __init__(self) -> None:
        self.tests: dict[str, dict[str, float]] = {}
        self._kinds: Counter[str] = Counter()
        self._compiling = 0.0

    @contextlib.contextmanager
    def of(self, test: str) -> Iterator[None]:
        """Charge the processor time used in this context to a test."""
        self._kinds.clear()
        self._listen()
        before = used()
        yield
        self._kinds["python"] = used() - before - sum(self._kinds.values())
        self.tests[test] = dict(self._kinds)

    def waited(self, command: str, seconds: float) -> None:
        """Charge a process that has ended to the test that waited for it."""
        self._kinds[command] += seconds

    def _listen(self) -> None:
        """Measure how long numba compiles, once it has been imported."""
        if "numba" not in sys.modules or self._compiling:
            return
        from numba.core import event

        times, self._compiling = self, 1.0

        class Compilation(event.Listener):  # type: ignore[misc]
            depth, began = 0, 0.0

            def on_start(self, _: Any) -> None:
                self.began = self.began if self.depth else time.process_time()
                self.depth += 1

            def on_end(self, _: Any) -> None:
                self.depth -= 1
                if not self.depth:
                    times.waited("numba", time.process_time() - self.began)

        event.register("numba:compile", Compilation())


def used() -> float:
    """Processor seconds of this process, of children it waited for and of those still running."""
    spent = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in spent) + sum(map(running, children(os.getpid())))


def children(process: int) -> list[int]:
    """Child processes that a process has not waited for; none without /proc."""
    with contextlib.suppress(OSError):
        return [int(child) for each in Path(f"/proc/{process}/task").iterdir()
                for child in (each / "children").read_text().split()]  # fmt: skip
    return []


def running(process: int) -> float:
    """Processor seconds of a process and all its descendants."""
    with contextlib.suppress(OSError):
        fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
        return sum(map(int, fields[11:15])) / TICK + sum(map(running, children(process)))
    return 0.0


def command(arguments: Any) -> str:
    """Kind that a process is counted as: the name of its program, or for Python that of its script or module."""
    words = [arguments] if isinstance(arguments, str | bytes | os.PathLike) else list(arguments)
    names = [os.fsdecode(word).rpartition("/")[2] for word in words]
    if names[0].startswith("python") and len(names) > 1:
        return "python -c" if names[1] == "-c" else f"python {names[2 if names[1] == '-m' else 1]}"
    return names[0]


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--cpu", type=Path, metavar="FILE", help="write the processor time of each test by kind as CSV")


def pytest_configure(config: pytest.Config) -> None:
    times = config.stash[TIMES] = Times()
    if config.option.cpu and importlib.util.find_spec("numba"):
        importlib.import_module("numba")

    def try_wait(self: subprocess.Popen[Any], flags: int) -> tuple[int, int]:
        try:
            process, status, spent = os.wait4(self.pid, flags)
        except ChildProcessError:
            return self.pid, 0
        if process:
            times.waited(command(self.args), spent.ru_utime + spent.ru_stime)
        return process, status

    original = subprocess.Popen._try_wait  # type: ignore[attr-defined]
    subprocess.Popen._try_wait = try_wait  # type: ignore[attr-defined]
    config.add_cleanup(lambda: setattr(subprocess.Popen, "_try_wait", original))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Any:
    with item.config.stash[TIMES].of(item.nodeid):
        return (yield)


def pytest_sessionfinish(session: pytest.Session) -> None:
    # A worker of pytest-xdist passes its times to the process that prints
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["cpu"] = session.config.stash[TIMES].tests


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    node.config.stash[TIMES].tests.update(getattr(node, "workeroutput", {}).get("cpu", {}))


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    files: Counter[str] = Counter()
    kinds: Counter[str] = Counter()
    tests = config.stash[TIMES].tests
    for test, seconds in tests.items():
        files[test.partition("::")[0]] += sum(seconds.values())
        kinds.update(seconds)
    for words, counted in (("by kind", kinds), ("by file", files)):
        most = ", ".join(f"{name} {seconds:.0f}" for name, seconds in counted.most_common(FILES_SHOWN))
        terminalreporter.write_line(f"{sum(counted.values()):.0f} s of processor time, {words}: {most}")
    if config.option.cpu:
        config.option.cpu.parent.mkdir(parents=True, exist_ok=True)
        with config.option.cpu.open("w", newline="", encoding="utf-8") as file:
            table = csv.writer(file, lineterminator="\n")
            names = [kind for kind, _ in kinds.most_common()]
            table.writerow(["test", "all", *names])
            for test, seconds in sorted(tests.items(), key=lambda each: -sum(each[1].values())):
                row = sum(seconds.values()), *(seconds.get(kind, 0.0) for kind in names)
                table.writerow([test, *(f"{x:.2f}" for x in row)])
