"""Settings shared by all tests, and the measured records that tests marked `data` need."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

# The first call of a compiled function takes longer than any deadline.
settings.register_profile("hystgen", deadline=None)
settings.load_profile("hystgen")

MEASURED = Path(os.environ.get("HYSTGEN_DATA") or Path(__file__).resolve().parents[2] / "shared" / "data")
"""Folder of the measured records, which the project does not ship: not all of them may be passed on."""

LEFT_OUT = pytest.StashKey[int]()


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
        # Kernels may have to be compiled first, which is told
        told = [line for line in err.splitlines() if not line.startswith("compiling")]
        return int(stopped.value.code or 0), out, "\n".join(told)

    return call


def pytest_configure(config: pytest.Config) -> None:
    config.stash[LEFT_OUT] = 0
    if os.environ.get("HYSTGEN_REQUIRE_DATA") and not MEASURED.is_dir():
        raise pytest.UsageError(f"HYSTGEN_REQUIRE_DATA is set, but there is no folder {MEASURED}; set HYSTGEN_DATA")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Deselect what cannot run without the measured records: neither passed nor skipped, but counted."""
    if MEASURED.is_dir():
        return
    left_out = [item for item in items if item.get_closest_marker("data")]
    items[:] = [item for item in items if item not in left_out]
    config.hook.pytest_deselected(items=left_out)
    config.stash[LEFT_OUT] = len(left_out)


def pytest_sessionfinish(session: pytest.Session) -> None:
    # A process of pytest-xdist hands its count to the one that prints
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["left_out"] = session.config.stash[LEFT_OUT]


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    counted = getattr(node, "workeroutput", {}).get("left_out", 0)
    node.config.stash[LEFT_OUT] = max(node.config.stash[LEFT_OUT], counted)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    number = config.stash[LEFT_OUT]
    if number:
        terminalreporter.write_line(
            f"{number} test{'' if number == 1 else 's'} deselected: marked data, and there is no folder {MEASURED} "
            "of measured records; HYSTGEN_DATA names another",
            yellow=True,
        )
