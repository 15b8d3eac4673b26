"""Files that appear complete or not at all, and folders for work in progress.

Everything is written to a staging folder next to its destination and then renamed. The staging folder is removed when
the work ends, even with an error; if a process was killed, the next one that writes to the same folder removes the
leftovers. A lock in the staging folder, which the system releases when the process ends, tells leftovers from a folder
in use.
"""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
import sys
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

PREFIX = ".hystgen-"
"""Prefix of the names of staging folders."""

_LOCK, _FILES = "lock", "files"

_swept: set[str] = set()
"""Folders that this process has already searched for leftovers."""


@contextlib.contextmanager
def staging(around: Path) -> Iterator[Path]:
    """A new, empty folder in the folder `around`, for the duration of the block. Raises OSError."""
    sweep(around)
    place, lock = _new(around)
    try:
        files = place / _FILES
        files.mkdir()
        yield files
    finally:
        shutil.rmtree(place, ignore_errors=True)
        if lock is not None:
            os.close(lock)


@contextlib.contextmanager
def temporary() -> Iterator[Path]:
    """A new, empty folder for temporary files, for the duration of the block. Raises OSError."""
    try:
        around = tempfile.gettempdir()
    except FileNotFoundError:
        raise FileNotFoundError(
            errno.ENOENT, "no folder for temporary files is writable; set TMPDIR to one that is"
        ) from None
    with staging(Path(around)) as folder:
        yield folder


def sweep(around: Path) -> None:
    """Remove the staging folders that killed processes left in a folder, once per process."""
    where = os.path.realpath(around)
    if where in _swept:
        return
    _swept.add(where)
    with contextlib.suppress(OSError), os.scandir(where) as entries:
        for entry in [each for each in entries if each.name.startswith(PREFIX)]:
            with contextlib.suppress(OSError):
                _remove_stale(Path(entry.path))


def _remove_stale(place: Path) -> None:
    """Remove a staging folder of this user unless a process holds it. Raises OSError if that cannot be determined."""
    if sys.platform == "win32" or place.is_symlink() or place.stat().st_uid != os.geteuid():
        return
    if not set(os.listdir(place)) <= {_LOCK, _FILES}:
        return  # another user's
    lock = _hold(place)
    if lock is not None:
        shutil.rmtree(place, ignore_errors=True)
        os.close(lock)


def _new(around: Path) -> tuple[Path, int | None]:
    """A new folder and its lock, None if the file system has no locks."""
    while True:
        place = Path(tempfile.mkdtemp(prefix=PREFIX, dir=around))
        try:
            lock = _hold(place)
        except OSError:
            return place, None
        if lock is not None:
            return place, lock
        # Another process took the folder for a leftover before it was locked


def _hold(place: Path) -> int | None:
    """Lock a staging folder; None if another process holds or removes it. Raises OSError if there are no locks."""
    if sys.platform == "win32":
        raise OSError(errno.ENOTSUP, os.strerror(errno.ENOTSUP))
    import fcntl

    path = place / _LOCK
    try:
        handle = os.open(path, os.O_CREAT | os.O_RDWR | os.O_NOFOLLOW, 0o600)
    except FileNotFoundError:
        return None
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if os.path.samestat(os.fstat(handle), os.stat(path)):
            return handle
    except (BlockingIOError, FileNotFoundError):
        pass
    except OSError:
        os.close(handle)
        raise
    os.close(handle)
    return None


def destination(path: str | os.PathLike[str]) -> Path:
    """The path to which a file at `path` is written: for a link, its target, which need not exist. Raises OSError."""
    target = Path(os.path.realpath(path))
    if target.is_symlink():
        raise OSError(errno.ELOOP, "leads back to itself; choose another output", os.fspath(path))
    return target


def place_for(path: str | os.PathLike[str]) -> Path:
    """`destination` of a file in an existing folder. Raises OSError."""
    target = destination(path)
    if not target.parent.is_dir():
        what = f"the folder {target.parent} does not exist; create it, or choose another output"
        raise FileNotFoundError(errno.ENOENT, what, os.fspath(path))
    return target


def check_writable(path: str | os.PathLike[str]) -> None:
    """Raise the OSError that `write_atomically` would raise; found by writing a trial file to the folder."""
    target = place_for(path)
    if target.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), os.fspath(path))
    if not target.exists() or target.is_file():
        try_folder(target.parent, path)


def try_folder(folder: Path, path: str | os.PathLike[str]) -> None:
    """Raise the OSError that writing into an existing folder would raise, but naming `path`."""
    try:
        with tempfile.TemporaryFile(prefix=PREFIX, dir=folder):
            pass
    except OSError as failure:
        raise OSError(failure.errno, failure.strerror, os.fspath(path)) from None


def write_atomically(path: str | os.PathLike[str], content: str | bytes) -> None:
    """Write a file, text as UTF-8; at any time the path holds either the old file or the complete new one.

    A link stays a link, and anything but a regular file (a pipe, a terminal) is written in place. Raises OSError.
    """
    target = place_for(path)
    data = content.encode() if isinstance(content, str) else content
    if target.exists() and not target.is_file():
        target.write_bytes(data)
        return
    try:
        with staging(target.parent) as folder:
            (folder / target.name).write_bytes(data)
            os.replace(folder / target.name, target)
    except OSError as failure:
        # The message should name the requested file, not the temporary one
        raise OSError(failure.errno, failure.strerror, os.fspath(path)) from None


def check_files(folder: Path, names: Iterable[str]) -> None:
    """Raise the OSError that writing these files into `folder` would raise, insofar as it can be foreseen."""
    around = destination(folder) if folder.is_symlink() else folder
    while not around.exists() and around != around.parent:
        around = around.parent
    if not around.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(around))
    try_folder(around, around)
    for name in names:  # nothing else can stop a replacement half-way
        if (folder / name).is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(folder / name))
        for inner in (folder / parent for parent in Path(name).parents[:-1]):
            if inner.is_dir():
                try_folder(inner, inner)
            elif inner.exists() or inner.is_symlink():
                raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(inner))


def write_files(folder: Path, files: Mapping[str, str | bytes]) -> list[Path]:
    """Write `files` (name to ASCII text or bytes) into `folder`; each appears complete, none before all are ready.

    A new folder appears with all its files at once; in an existing folder, other files are left alone, and so are files
    that already have the right bytes.
    """
    target = destination(folder)  # a link stays a link
    new = not target.exists()
    around = target.parent if new else target
    around.mkdir(parents=True, exist_ok=True)
    sweep(target.parent)  # leftovers of a call that was killed before the folder appeared
    try:
        with staging(around) as staged:
            made = staged / "made"
            made.mkdir()
            for name, content in files.items():
                (made / name).parent.mkdir(parents=True, exist_ok=True)
                (made / name).write_bytes(content if isinstance(content, bytes) else content.encode("ascii"))
            if new:
                made.rename(target)
            else:
                check_files(target, files)
                for name in files:
                    if not _same(made / name, target / name):
                        (target / name).parent.mkdir(parents=True, exist_ok=True)
                        os.replace(made / name, target / name)
    except OSError as failure:
        own = not failure.filename or PREFIX in str(failure.filename)
        if own and failure.errno is not None:  # the message should name the requested path
            raise OSError(failure.errno, failure.strerror, str(folder)) from None
        raise
    return [folder / name for name in files]


def _same(made: Path, there: Path) -> bool:
    return there.is_file() and there.read_bytes() == made.read_bytes()
