"""Loads a freshly built shared library, even if temporary files cannot be executed."""

from __future__ import annotations

import contextlib
import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeVar

from hystgen.basics import writing

Loaded = TypeVar("Loaded")


class LoadError(RuntimeError):
    """The library was built but cannot be loaded; the message says why and what to do."""


def load(library: Path, loader: Callable[[str], Loaded]) -> Loaded:
    """The result of `loader` for the library, which stays loaded after its file is gone. Raises LoadError.

    If its folder is mounted noexec, like the temporary folders of hardened machines, a copy elsewhere is loaded.
    """
    try:
        return loader(str(library))
    except OSError as failure:
        reason = str(failure).partition(".  Additionally")[0]  # cffi adds that it also searched by name
    for around in _elsewhere():
        with contextlib.suppress(OSError), writing.staging(around) as folder:
            return loader(str(shutil.copy(library, folder)))
    raise LoadError(
        f"the compiled library cannot be loaded: {reason}; if {library.parent} is on a file system mounted noexec, set "
        "TMPDIR to a folder where programs may run"
    )


def _elsewhere() -> Iterator[Path]:
    """Other folders for temporary files."""
    named = [os.environ.get("XDG_RUNTIME_DIR"), os.environ.get("XDG_CACHE_HOME"), os.path.expanduser("~/.cache")]
    for place in dict.fromkeys([*filter(None, named), "/var/tmp", "/dev/shm"]):
        if os.path.isdir(place) and os.access(place, os.W_OK | os.X_OK):
            yield Path(place)
