"""The numbers of `hystgen.diagnosis.search.acceptance`, doubled and halved: which fast tests of the diagnosis notice?

    python -m tests.threshold_mutants [--only NAME]... [--tests FILE]... [--seconds 3] [--write]

All fast tests are run once to learn which numbers each of them reads and how long it takes; then, for each number and
factor, those that read it, the one that noticed before and the shortest first, until one fails. `--write` keeps their
names in `docs/thresholds.csv`, the runs that would change the numbers. Exits with 1 if a number is noticed by no test
and is not in `UNNOTICED`.
"""

from __future__ import annotations

import argparse
import ast
import contextlib
import csv
import itertools
import multiprocessing
import os
import signal
import sys
import time
import types
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from hystgen.diagnosis.search import acceptance

ROOT = Path(__file__).parent.parent
FILES = tuple(f"tests/test_{name}.py" for name in ("acceptance", "selection", "disturbances", "thinning", "diagnosis"))
FACTORS = (2.0, 0.5)

TABLE = ROOT / "docs" / "thresholds.csv"
HEAD = ("number", "value", "unit", "noticed when doubled by", "noticed when halved by")

UNNOTICED: dict[str, str] = {}
"""Numbers that no fast test notices, with the reason."""


def names() -> list[str]:
    """All numbers, in their order."""
    found = vars(acceptance).items()
    return [name for name, value in found if name.isupper() and isinstance(value, int | float | tuple)]


def changed(value: Any, factor: float) -> Any:
    """A number, or each of several, times a factor; whole numbers stay whole and at least one."""
    if isinstance(value, tuple):
        return tuple(changed(each, factor) for each in value)
    return max(1, round(value * factor)) if isinstance(value, int) else value * factor


def documented() -> dict[str, str]:
    """The text below each number."""
    found: dict[str, str] = {}
    body = ast.parse(Path(acceptance.__file__).read_text()).body
    for each, text in itertools.pairwise(body):
        if isinstance(each, ast.Assign) and isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant):
            targets = each.targets[0].elts if isinstance(each.targets[0], ast.Tuple) else each.targets
            words = " ".join(str(text.value.value).split())
            found |= {target.id: words for target in targets if isinstance(target, ast.Name)}
    return found


def read_inside() -> set[str]:
    """Numbers that the functions of the module itself read, which no test can be seen to do."""
    body = ast.parse(Path(acceptance.__file__).read_text()).body
    functions = [each for each in body if isinstance(each, ast.FunctionDef)]
    used = (node.id for function in functions for node in ast.walk(function) if isinstance(node, ast.Name))
    return {name for name in used if name.isupper()}


# Tests run here ----------------------------------------------------------------------------------------------


class TooLong(BaseException):
    """A test has used up its processor time; no `except Exception` of the test itself takes it for another failure."""


class Watch:
    """A pytest plugin: the numbers that each test reads, and its processor time; long tests fail and are listed."""

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        self.tests: dict[str, tuple[float, list[str]]] = {}
        self.too_long: list[str] = []
        self._read: set[str] = set()

    @contextlib.contextmanager
    def watching(self) -> Iterator[None]:
        """Reads of the module's attributes are seen meanwhile."""
        read = self._read

        class Seen(types.ModuleType):
            def __getattribute__(self, name: str) -> Any:
                if name.isupper():
                    read.add(name)
                return super().__getattribute__(name)

        acceptance.__class__ = Seen
        try:
            yield
        finally:
            acceptance.__class__ = types.ModuleType

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item: pytest.Item) -> Any:
        """The test itself, without its fixtures."""
        self._read.clear()

        def late(*_: object) -> None:
            raise TooLong

        signal.signal(signal.SIGPROF, late)
        signal.setitimer(signal.ITIMER_PROF, self.seconds)
        began = time.process_time()
        try:
            result = yield
            self.tests[item.nodeid] = time.process_time() - began, sorted(self._read)
            return result
        except TooLong:
            self.too_long.append(item.nodeid)
            pytest.fail(f"takes more than {self.seconds:g} s; no number counts as noticed by it", pytrace=False)
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0.0)


def apart(what: Callable[[], Any]) -> Any:
    """What a function returns in a process of its own, so that nothing of it stays here."""
    here, there = multiprocessing.Pipe(duplex=False)
    child = os.fork()
    if child == 0:
        try:
            with open(os.devnull, "w") as nowhere:
                os.dup2(nowhere.fileno(), 1)
                os.dup2(nowhere.fileno(), 2)
            there.send(what())
        finally:
            os._exit(0)
    there.close()
    try:
        return here.recv()
    except EOFError:
        return None
    finally:
        os.waitpid(child, 0)


def table(files: Sequence[str], seconds: float) -> tuple[dict[str, tuple[float, list[str]]], list[str]]:
    """The fast tests: their seconds, and the numbers that each reads; and the tests that take too long."""

    def run() -> tuple[dict[str, tuple[float, list[str]]], list[str]]:
        watch = Watch(seconds)
        with watch.watching():
            pytest.main(["-q", "-p", "no:cacheprovider", *files], plugins=[watch])
        return watch.tests, watch.too_long

    return apart(run) or ({}, [])


class Failed:
    """A pytest plugin: the first test that fails."""

    def __init__(self) -> None:
        self.test = ""

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Keep the name of a test whose call fails, not of one that cannot be prepared."""
        if report.failed and report.when == "call":
            self.test = self.test or report.nodeid


def noticed(name: str, factor: float, tests: Sequence[str]) -> str:
    """The test that fails with the number changed, empty for none; one file after the other, in the tests' order."""
    files: dict[str, list[str]] = {}
    for test in tests:
        files.setdefault(test.partition("::")[0], []).append(test)

    def run(chosen: Sequence[str]) -> str:
        setattr(acceptance, name, changed(getattr(acceptance, name), factor))
        failed = Failed()
        pytest.main(["-q", "-x", "-p", "no:cacheprovider", *chosen], plugins=[failed])
        return failed.test

    return next((test for chosen in files.values() if (test := apart(partial(run, chosen)))), "")


# The table ---------------------------------------------------------------------------------------------------


def unit(name: str) -> str:
    """The unit that stands before the text below a number; of several numbers with a text in common its own."""
    text = documented()[name]
    units = [part.partition("]")[0].removeprefix("[") for part in text.split(", [")] if text.startswith("[") else []
    body = ast.parse(Path(acceptance.__file__).read_text()).body
    for each in body:
        if isinstance(each, ast.Assign) and isinstance(each.targets[0], ast.Tuple):
            together = [target.id for target in each.targets[0].elts if isinstance(target, ast.Name)]
            if name in together and len(units) == len(together):
                return units[together.index(name)]
    return units[0]


def recorded() -> dict[str, dict[float, str]]:
    """Of each number in the table, the test that noticed it times each factor."""
    if not TABLE.exists():
        return {}
    with TABLE.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return {row[HEAD[0]]: {f: row[k] for f, k in zip(FACTORS, HEAD[3:], strict=True)} for row in rows}


def write(found: dict[str, dict[float, str]]) -> None:
    """Write the table of all numbers, in their order."""
    with TABLE.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(HEAD)
        for name in names():
            tests = found.get(name, {})
            table.writerow([name, getattr(acceptance, name), unit(name), *(tests.get(f, "") for f in FACTORS)])


def main(arguments: Sequence[str]) -> int:
    """The table and the count, one line per number."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else None)
    parser.add_argument("--only", action="append", default=[], metavar="NAME")
    parser.add_argument("--tests", action="append", default=[], metavar="FILE")
    parser.add_argument("--seconds", type=float, default=3.0, help="processor time of a fast test")
    parser.add_argument("--write", action="store_true", help=f"keep the names of the tests in {TABLE.name}")
    given = parser.parse_args(arguments)
    wrong = set(given.only) - set(names())
    if wrong:
        parser.error(f"no such number: {', '.join(sorted(wrong))}")
    os.chdir(ROOT)
    with open(os.devnull, "w") as nowhere, contextlib.redirect_stdout(nowhere):  # imported once for all processes
        pytest.main(["--collect-only", "-q", "-p", "no:cacheprovider", *(given.tests or FILES)])
    fast, too_long = table(given.tests or FILES, given.seconds)
    print(f"{len(fast)} fast tests, {sum(seconds for seconds, _ in fast.values()):.0f} s; {len(too_long)} left out, "
          f"which take more than {given.seconds:g} s")
    inside, before = read_inside(), recorded()
    quickest = sorted(fast, key=lambda test: fast[test][0])
    if not given.tests:
        quickest.sort(key=lambda test: FILES.index(test.partition("::")[0]))
    results: dict[str, dict[float, str]] = {}
    for name in given.only or names():
        readers = [test for test in quickest if name in fast[test][1] or name in inside]
        results[name] = {}
        for factor in FACTORS:
            if changed(getattr(acceptance, name), factor) == getattr(acceptance, name):
                continue
            known = before.get(name, {}).get(factor, "")
            results[name][factor] = noticed(name, factor, sorted(readers, key=lambda test: test != known))
        said = ", ".join(f"x {factor:g} {test or 'NOT noticed'}" for factor, test in results[name].items())
        print(f"{name}: read by {len(readers)} tests; {said}", flush=True)
        if given.write:
            write(before | results)
    silent = [name for name, tests in results.items() if not any(tests.values())]
    half = [name for name, tests in results.items() if name not in silent and not all(tests.values())]
    print(f"{len(results) - len(silent) - len(half)} noticed both ways, {len(half)} one way, {len(silent)} not at all")
    print("not at all: " + (", ".join(silent) or "none"))
    return int(bool(set(silent) - set(UNNOTICED)))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
