"""Generated files on disk: written all together or not at all."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterable, Mapping
from pathlib import Path

from hystgen import writing


def check(folder: Path, names: Iterable[str]) -> None:
    """Raise the OSError that writing these files into `folder` would end in, as far as can be told before."""
    around = writing.destination(folder) if folder.is_symlink() else folder
    while not around.exists() and around != around.parent:
        around = around.parent
    if not around.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(around))
    writing.try_folder(around, around)
    for name in names:  # the one thing that could stop a replacement half-way
        if (folder / name).is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(folder / name))


def write(folder: Path, files: Mapping[str, str | bytes]) -> list[Path]:
    """Write `files` (name to ASCII text or bytes) into `folder`; each appears complete, none before all are ready.

    A folder that is not there yet appears with all of them; of one that is, other files stay as they are, and so do
    those that have the same bytes already.
    """
    target = writing.destination(folder)  # a link stays a link
    new = not target.exists()
    around = target.parent if new else target
    around.mkdir(parents=True, exist_ok=True)
    writing.sweep(target.parent)  # of a call that was killed before the folder appeared
    try:
        with writing.staging(around) as staged:
            made = staged / "made"
            made.mkdir()
            for name, content in files.items():
                (made / name).write_bytes(content if isinstance(content, bytes) else content.encode("ascii"))
            if new:
                made.rename(target)
            else:
                check(target, files)
                for name in files:
                    if not _same(made / name, target / name):
                        os.replace(made / name, target / name)
    except OSError as failure:
        own = not failure.filename or writing.PREFIX in str(failure.filename)
        if own and failure.errno is not None:  # name what was asked for
            raise OSError(failure.errno, failure.strerror, str(folder)) from None
        raise
    return [folder / name for name in files]


def _same(made: Path, there: Path) -> bool:
    return there.is_file() and there.read_bytes() == made.read_bytes()
