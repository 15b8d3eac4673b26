"""Settings shared by all tests, and the measured records that tests marked `data` need."""

from __future__ import annotations

import contextlib
import gc
import os
import shutil
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

# The first call of a compiled function takes longer than any deadline.
settings.register_profile("hystgen", deadline=None)
settings.load_profile("hystgen")

pytest_plugins = ["processor_time"]

MEASURED = Path(os.environ.get("HYSTGEN_DATA") or Path(__file__).resolve().parents[2] / "shared" / "data")
"""Folder of the measured records. The project does not ship them because some may not be redistributed."""

WHOLE = bool(os.environ.get("HYSTGEN_WHOLE"))
"""Whether tests marked `slow` run all their cases."""

NO_DATA = f"marked data, and there is no folder {MEASURED} of measured records; HYSTGEN_DATA names another"
SHORTENED = "marked slow; HYSTGEN_WHOLE=1 runs all"
SHARED = "marked thorough, and beyond the share of --share; HYSTGEN_WHOLE=1 runs all"
LEFT_OUT = pytest.StashKey[dict[str, int]]()

GARBAGE = 50_000, 20, 20
"""[objects, collections, collections] Thresholds of the garbage collector, instead of 700, 10, 10. Collecting took 13 %
of the time of compiling a step and 8 % of a diagnosis; it now takes 4 % and 3 %, for 30 MB more per process. Set by:
`gc.callbacks` around the first inverse step of `bent` in float32, and around the blocks of docs/howto/diagnose.md."""


@pytest.fixture(scope="session")
def chromium() -> str:
    """Path of the browser that renders the pages. Without one the test is skipped, or fails in CI."""
    found = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if found is None:
        if os.environ.get("CI"):
            pytest.fail("CI installs chromium, but it is not there")
        pytest.skip("there is no chromium")
    return found


@pytest.fixture(scope="session")
def measured() -> Path:
    """Folder of the measured records; for tests marked `data`."""
    return MEASURED


@pytest.fixture
def run(capfd: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, str, str]]:
    """Run the command line and return its exit code, standard output and standard error."""

    from hystgen.cli import main

    def call(*arguments: object) -> tuple[int, str, str]:
        capfd.readouterr()
        with pytest.raises(SystemExit) as stopped:
            main([str(a) for a in arguments])
        out, err = capfd.readouterr()
        # Compiling kernels is reported on standard error
        printed = [line for line in err.splitlines() if not line.startswith("compiling")]
        return int(stopped.value.code or 0), out, "\n".join(printed)

    return call


@pytest.fixture(autouse=True, scope="session")
def _short_records() -> None:
    """Raise the number of samples from which functions are compiled: few tests have enough samples to repay compiling
    each function for four types."""
    from hystgen.basics import jit

    jit.SHORT = 10 * jit.SHORT


@pytest.fixture
def brief(request: pytest.FixtureRequest) -> Iterator[bool]:
    """Whether this is `make test`. Models with effects then run in plain Python, which on short records is faster than
    compiling their functions."""
    from hystgen.basics import jit

    briefly = request.config.option.markexpr == "not thorough"
    with jit.plain() if briefly else contextlib.nullcontext():
        yield briefly


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--share", type=int, default=1, metavar="N", help="run one in N of the tests marked thorough")


def pytest_configure(config: pytest.Config) -> None:
    gc.set_threshold(*GARBAGE)
    config.stash[LEFT_OUT] = {NO_DATA: 0, SHORTENED: 0, SHARED: 0}
    if os.environ.get("HYSTGEN_REQUIRE_DATA") and not MEASURED.is_dir():
        raise pytest.UsageError(f"HYSTGEN_REQUIRE_DATA is set, but there is no folder {MEASURED}; set HYSTGEN_DATA")


@pytest.hookimpl(tryfirst=True)  # before -m looks at the marks
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Deselect tests that need missing measured records, and some slow ones; they count as neither passed nor skipped.

    One case in n of a test marked `thorough(but_one_in=n)` loses that mark, so that `make test` runs it."""
    for item in items:
        thorough = item.get_closest_marker("thorough")
        cases = thorough.kwargs.get("but_one_in") if thorough is not None else None
        if cases is not None and place(item) % cases == 0:
            item.own_markers = [each for each in item.own_markers if each != thorough]
    share = 1 if WHOLE else config.option.share
    for reason, runs in (
        (NO_DATA, lambda item: MEASURED.is_dir() or item.get_closest_marker("data") is None),
        (SHORTENED, lambda item: WHOLE or in_short_form(item)),
        (SHARED, in_share(share)),
    ):
        found = [(item, runs(item)) for item in items]
        items[:] = [item for item, kept in found if kept]
        left_out = [item for item, kept in found if not kept]
        config.hook.pytest_deselected(items=left_out)
        config.stash[LEFT_OUT][reason] = len(left_out)


def pytest_collection_finish() -> None:
    """Keep the garbage collector from scanning modules and tests, which live until the end."""
    gc.collect()
    gc.freeze()


def in_short_form(item: pytest.Item) -> bool:
    """Whether a test runs without HYSTGEN_WHOLE. Of a slow test one case in `one_in` runs, or none without that."""
    slow = item.get_closest_marker("slow")
    if slow is None:
        return True
    return "one_in" in slow.kwargs and place(item) % slow.kwargs["one_in"] == 0


def in_share(share: int) -> Callable[[pytest.Item], bool]:
    """Whether a thorough test belongs to one in `share` of them, asked of all tests in order: of the cases of a test
    every n-th, beginning where the checksum of its name says. One marked `thorough(each_time=True)` always does.
    """
    cases = Counter[str]()

    def runs(item: pytest.Item) -> bool:
        thorough = item.get_closest_marker("thorough")
        if thorough is None or thorough.kwargs.get("each_time"):
            return True
        name = item.nodeid.partition("[")[0].rpartition("/")[2]
        cases[name] += 1
        return (cases[name] + zlib.crc32(name.encode())) % share == 0

    return runs


def place(item: pytest.Item) -> int:
    """Sum of the indices of a case's parameters in their lists.

    Running every n-th sum pairs each value of one list with every n-th value of another.
    """
    assert isinstance(item, pytest.Function)
    places = 0
    for mark in item.iter_markers("parametrize"):
        names, values = mark.args
        case = item.callspec.params[names] if isinstance(names, str) else tuple(map(item.callspec.params.get, names))
        places += list(values).index(case)
    return places


def pytest_sessionfinish(session: pytest.Session) -> None:
    # A worker of pytest-xdist passes its count to the process that prints
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["left_out"] = session.config.stash[LEFT_OUT]


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    counted = getattr(node, "workeroutput", {}).get("left_out", {})
    for reason, number in counted.items():
        node.config.stash[LEFT_OUT][reason] = max(node.config.stash[LEFT_OUT][reason], number)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    for reason, number in config.stash[LEFT_OUT].items():
        if number:
            counted = f"{number} test{'' if number == 1 else 's'} deselected"
            terminalreporter.write_line(f"{counted}: {reason}", yellow=True)
