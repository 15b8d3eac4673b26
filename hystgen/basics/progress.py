"""A progress bar for work that takes longer than a second."""

from __future__ import annotations

import sys
import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich import progress

PATIENCE = 1.0
"""[s] Time before the bar appears."""

OFTEN = 0.1
"""[s] Interval between updates of the bar; `tick` draws it, since a thread would rule out forking (`parallel`)."""


class Progress:
    """Context manager; `tick` counts work, in the unit of `total`, under a `title`.

    A `total` of 0 means unknown. Silent unless `shown` is set, stderr is a terminal, rich is installed, and
    `PATIENCE` has passed.
    """

    def __init__(self, total: float, shown: bool, title: str) -> None:
        self._total = total
        self._shown = shown and sys.stderr.isatty()
        self._title = title
        self._done = 0.0
        self._next = time.monotonic() + PATIENCE
        self._bar: progress.Progress | None = None
        self._task: progress.TaskID | None = None

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.stop()

    def tick(self, work: float) -> None:
        """Count finished work, in the unit of `total`."""
        self._done += work
        now = time.monotonic()
        if not self._shown or now < self._next:
            return
        self._next = now + OFTEN
        if self._bar is None or self._task is None:
            try:
                from rich.console import Console
                from rich.progress import Progress as Bar
            except ImportError:  # of the extra `fit`
                self._shown = False
                return
            self._bar = Bar(console=Console(stderr=True), transient=True, auto_refresh=False)
            self._bar.start()
            self._task = self._bar.add_task(self._title, total=self._total or None)
        self._bar.update(self._task, completed=self._done, refresh=True)
