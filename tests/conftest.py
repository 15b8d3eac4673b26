"""Settings shared by all tests, and the measured records that tests marked `data` need."""

from __future__ import annotations

import contextlib
import gc
import os
import shutil
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
"""Folder of the measured records, which the project does not ship: not all of them may be passed on."""

WHOLE = bool(os.environ.get("HYSTGEN_WHOLE"))
"""Whether tests marked `slow` are to run with all their cases."""

NO_DATA = f"marked data, and there is no folder {MEASURED} of measured records; HYSTGEN_DATA names another"
SHORTENED = "marked slow; HYSTGEN_WHOLE=1 runs all"
LEFT_OUT = pytest.StashKey[dict[str, int]]()

GARBAGE = 50_000, 20, 20
"""[objects, collections, collections] How rarely unreachable cycles are sought, instead of 700, 10, 10. That took 13 %
of the time of compiling a step and 8 % of a diagnosis, and now takes 4 % and 3 %, for 30 MB more a process. Set by:
`gc.callbacks` around the first inverse step of `bent` in float32, and around the blocks of docs/howto/diagnose.md."""


@pytest.fixture(scope="session")
def chromium() -> str:
    """The browser in which pages are looked at; CI has to have it."""
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
    """The command line: exit code, standard output, standard error."""

    from hystgen.cli import main

    def call(*arguments: object) -> tuple[int, str, str]:
        capfd.readouterr()
        with pytest.raises(SystemExit) as stopped:
            main([str(a) for a in arguments])
        out, err = capfd.readouterr()
        # Kernels may have to be compiled first, which is reported
        printed = [line for line in err.splitlines() if not line.startswith("compiling")]
        return int(stopped.value.code or 0), out, "\n".join(printed)

    return call


@pytest.fixture(autouse=True, scope="session")
def _short_records() -> None:
    """Compile for more samples than a user's process does: few tests run as many, and each function would be compiled
    in four types."""
    from hystgen.basics import jit

    jit.SHORT = 10 * jit.SHORT


@pytest.fixture
def brief(request: pytest.FixtureRequest) -> Iterator[bool]:
    """Whether `make test` runs; models with effects are then computed in Python, which for short records takes less
    than to compile their functions."""
    from hystgen.basics import jit

    briefly = request.config.option.markexpr == "not thorough"
    with jit.plain() if briefly else contextlib.nullcontext():
        yield briefly


def pytest_configure(config: pytest.Config) -> None:
    gc.set_threshold(*GARBAGE)
    config.stash[LEFT_OUT] = {NO_DATA: 0, SHORTENED: 0}
    if os.environ.get("HYSTGEN_REQUIRE_DATA") and not MEASURED.is_dir():
        raise pytest.UsageError(f"HYSTGEN_REQUIRE_DATA is set, but there is no folder {MEASURED}; set HYSTGEN_DATA")


@pytest.hookimpl(tryfirst=True)  # before -m looks at the marks
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Deselect what cannot run without the measured records, and part of what is slow: neither passed nor skipped.

    One case in n of a test marked `thorough(but_one_in=n)` loses that mark, so that `make test` runs it."""
    for item in items:
        thorough = item.get_closest_marker("thorough")
        cases = thorough.kwargs.get("but_one_in") if thorough is not None else None
        if cases is not None and place(item) % cases == 0:
            item.own_markers = [each for each in item.own_markers if each != thorough]
    for reason, runs in (
        (NO_DATA, lambda item: MEASURED.is_dir() or item.get_closest_marker("data") is None),
        (SHORTENED, lambda item: WHOLE or in_short_form(item)),
    ):
        left_out = [item for item in items if not runs(item)]
        items[:] = [item for item in items if runs(item)]
        config.hook.pytest_deselected(items=left_out)
        config.stash[LEFT_OUT][reason] = len(left_out)


def pytest_collection_finish() -> None:
    """Modules and tests stay until the end; no collection has to look at them."""
    gc.collect()
    gc.freeze()


def in_short_form(item: pytest.Item) -> bool:
    """Whether a test runs without HYSTGEN_WHOLE: of a slow one a case in `one_in`, and none without that number."""
    slow = item.get_closest_marker("slow")
    if slow is None:
        return True
    return "one_in" in slow.kwargs and place(item) % slow.kwargs["one_in"] == 0


def place(item: pytest.Item) -> int:
    """The sum of the places of a case's parameters in their lists.

    Taking every n-th sum pairs each value of one list with every n-th value of another.
    """
    assert isinstance(item, pytest.Function)
    places = 0
    for mark in item.iter_markers("parametrize"):
        names, values = mark.args
        case = item.callspec.params[names] if isinstance(names, str) else tuple(map(item.callspec.params.get, names))
        places += list(values).index(case)
    return places


def pytest_sessionfinish(session: pytest.Session) -> None:
    # A process of pytest-xdist hands its count to the one that prints
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
