"""Generated files on disk: written all together or not at all."""

from __future__ import annotations

import errno
import os
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path


def check(folder: Path, names: Iterable[str]) -> None:
    """Raise the OSError that writing these files into `folder` would end in, as far as can be told before."""
    around = folder
    while not around.exists() and around != around.parent:
        around = around.parent
    if not around.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(around))
    try:
        with tempfile.TemporaryFile(prefix=".hystgen-", dir=around):
            pass
    except OSError as failure:
        raise OSError(failure.errno, failure.strerror, str(around)) from None
    for name in names:  # the one thing that could stop a replacement half-way
        if (folder / name).is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(folder / name))


def write(folder: Path, files: Mapping[str, str | bytes]) -> list[Path]:
    """Write `files` (name to ASCII text or bytes) into `folder`; each appears complete, none before all are ready.

    A folder that is not there yet appears with all of them; of one that is, other files stay as they are, and so do
    those that have the same bytes already.
    """
    new = not folder.exists()
    around = folder.parent if new else folder
    around.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".hystgen-", dir=around) as staging:
        made = Path(staging) / "made"
        made.mkdir()
        for name, content in files.items():
            (made / name).write_bytes(content if isinstance(content, bytes) else content.encode("ascii"))
        if new:
            made.rename(folder)
            return [folder / name for name in files]
        check(folder, files)
        for name in files:
            if not _same(made / name, folder / name):
                os.replace(made / name, folder / name)
    return [folder / name for name in files]


def _same(made: Path, there: Path) -> bool:
    return there.is_file() and there.read_bytes() == made.read_bytes()
