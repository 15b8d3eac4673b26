"""Packed files: gzip, xz, bzip2, and zip or tar archives, unpacked into a temporary file before they are read.

An archive holds one record, or the user names the file in it: `runs.zip/sweep.csv`.
"""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
import os
import shutil
import tarfile
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from pathlib import PurePosixPath
from typing import IO, cast

from hystgen.records.reading import CountingFile, Reading

DEEPEST = 4
"""[levels] Most layers of packing; `a.tar.gz` in a zip has three. A file can be made that unpacks to itself forever."""

PIECE = 1 << 20
"""[bytes] Amount unpacked at a time."""

ROOM = 0.5
"""Largest share of the free disk space that an unpacked file may take: a few kilobytes can unpack to terabytes."""

Opener = Callable[[IO[bytes]], IO[bytes]]

STREAMS: Mapping[bytes, tuple[str, Opener]] = {
    b"\x1f\x8b": ("gzip", cast(Opener, gzip.open)),
    b"\xfd7zXZ\0": ("xz", cast(Opener, lzma.open)),
    b"BZh": ("bzip2", cast(Opener, bz2.open)),
}
"""Packed streams by their first bytes: name, and a function that opens them."""

PACKED = (".gz", ".xz", ".bz2", ".zip", ".tar", ".tgz")
"""Suffixes of packed files, which a record's own name does not include."""

_DAMAGE = (
    OSError, EOFError, zlib.error, lzma.LZMAError, zipfile.BadZipFile, tarfile.TarError, NotImplementedError, ValueError
)

_DOCUMENTS = ("xl/workbook.xml", "xl/workbook.bin", "word/document.xml", "mimetype")
"""Files that mark a zip archive as an office document."""


def location(file: str) -> tuple[str, str]:
    """The path of a file that exists, and the part named after it, as `runs.zip` and `sweep.csv`."""
    path, part = file, ""
    while path and not os.path.lexists(path):
        path, _, name = path.rpartition("/")
        part = f"{name}/{part}" if part else name
    return (path, part) if part and os.path.isfile(path) else (file, "")


def stem(name: str) -> str:
    """The name of a record's file without its suffix, nor the suffixes of its packing."""
    path = PurePosixPath(name)
    while path.suffix.lower() in PACKED and path.stem:
        path = path.with_suffix("")
    return path.stem


def opened(reading: Reading, stack: ExitStack) -> tuple[IO[bytes], bytes, str]:
    """The bytes of a file, its first bytes, and its suffix, unpacked if it is packed.

    Raises RecordError for a file that cannot be read.
    """
    try:
        stream: IO[bytes] = stack.enter_context(io.BufferedReader(CountingFile(reading.path, reading.tick)))
    except OSError as failure:
        raise reading.refuse(
            f"cannot be read ({failure.strerror or failure}); give the path of a data file"
        ) from None
    name = os.path.basename(reading.path)
    for _ in range(DEEPEST):
        start = cast(io.BufferedReader, stream).peek(1)
        found = next((each for magic, each in STREAMS.items() if start.startswith(magic)), None)
        if found is not None:
            name = name[: -len(PurePosixPath(name).suffix)] if PurePosixPath(name).suffix.lower() in PACKED else name
            stream = _unpacked(reading, stack, found[0], lambda stream=stream, found=found: found[1](stream))  # type: ignore[misc]
        elif start.startswith(b"PK\x03\x04") and (listed := _zipped(stack, stream, name)) is not None:
            name, stream = _member(reading, stack, "zip", listed)
        elif start[257:262] == b"ustar":
            name, stream = _member(reading, stack, "tar", _tarred(reading, stack, stream))
        else:
            return stream, start, PurePosixPath(name).suffix.lower()
    raise reading.refuse(f"is packed more than {DEEPEST} times; unpack it")


Members = Mapping[str, Callable[[], IO[bytes]]]
"""Files in an archive, and how to open each."""


def _zipped(stack: ExitStack, stream: IO[bytes], name: str) -> Members | None:
    """The files in a zip archive; None for a format that only uses zip inside: an `.npz`, a workbook."""
    if name.lower().endswith(".npz"):
        return None
    try:
        archive = stack.enter_context(zipfile.ZipFile(stream))
        names = archive.namelist()
    except _DAMAGE:
        names = []
    stream.seek(0)
    if not names or any(name in names for name in _DOCUMENTS) or all(name.endswith(".npy") for name in names):
        return None  # also a damaged one: by its suffix it may be one of these, and is reported as such
    return {name: lambda name=name: archive.open(name) for name in names if _is_data(name)}  # type: ignore[misc]


def _tarred(reading: Reading, stack: ExitStack, stream: IO[bytes]) -> Members:
    try:
        archive = stack.enter_context(tarfile.TarFile(fileobj=stream))
        found = {each.name: each for each in archive if each.isfile() and _is_data(each.name)}
    except _DAMAGE as failure:
        raise reading.refuse(f"is a damaged tar file ({failure}); copy or pack it again") from None

    def one(member: tarfile.TarInfo) -> IO[bytes]:
        return cast(IO[bytes], archive.extractfile(member))

    return {name: lambda member=member: one(member) for name, member in found.items()}  # type: ignore[misc]


def _is_data(name: str) -> bool:
    """Whether a name in an archive is a file, and not one that an operating system has put there."""
    return not name.endswith("/") and not any(part[:1] in "._" for part in PurePosixPath(name).parts)


def _member(reading: Reading, stack: ExitStack, kind: str, members: Members) -> tuple[str, IO[bytes]]:
    """Name and bytes of the file in an archive that is the record."""
    if not members:
        raise reading.refuse(f"is a {kind} file without a data file in it; give another one")
    inside = [name for name in members if reading.part == name or reading.part.startswith(f"{name}/")]
    if inside:
        name = max(inside, key=len)
        reading.part = reading.part.removeprefix(name).removeprefix("/")
    elif len(members) == 1:
        (name,) = members
    else:
        name = reading.take_part("file", list(members))
    if len(members) > 1 or reading.file != reading.path:
        reading.understood(f"{name} of the {kind} file")
    return os.path.basename(name), _unpacked(reading, stack, kind, members[name])


def _unpacked(reading: Reading, stack: ExitStack, kind: str, unpack: Callable[[], IO[bytes]]) -> IO[bytes]:
    """The unpacked bytes in a temporary file, which `reading.path` then names."""
    folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="hystgen-"))
    path = os.path.join(folder, "unpacked")
    most = ROOM * shutil.disk_usage(folder).free
    try:
        with unpack() as source, open(path, "wb") as file:
            while piece := source.read(PIECE):
                most -= len(piece)
                if most < 0:
                    raise reading.refuse(
                        f"is a {kind} file that unpacks to more than {ROOM:.0%} of the free disk space; unpack it"
                    )
                file.write(piece)
    except RuntimeError:
        raise reading.refuse(f"is a {kind} file with a password; unpack it") from None
    except _DAMAGE as failure:
        if type(failure).__name__ == "RecordError":
            raise
        raise reading.refuse(f"is a damaged {kind} file ({failure}); copy or pack it again") from None
    reading.path = path
    return stack.enter_context(open(path, "rb"))
