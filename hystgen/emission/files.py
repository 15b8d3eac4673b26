"""Generated files on disk: written all together or not at all, and compared with what is there."""

from __future__ import annotations

import errno
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path


def write(folder: Path, files: Mapping[str, str]) -> list[Path]:
    """Write `files` (name to text) into `folder`; each appears complete, none before all are ready."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".hystgen-", dir=folder) as staging:
        for name, text in files.items():
            (Path(staging) / name).write_bytes(text.encode("ascii"))
        for name in files:  # the one thing that could stop a replacement half-way
            if (folder / name).is_dir():
                raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(folder / name))
        for name in files:
            os.replace(Path(staging) / name, folder / name)
    return [folder / name for name in files]


def differences(folder: Path, files: Mapping[str, str]) -> list[str]:
    """What is missing from `folder` or differs from `files`, one sentence a file."""
    problems = []
    for name, text in files.items():
        path = folder / name
        if not path.is_file():
            problems.append(f"{path} is missing")
        elif path.read_bytes() != text.encode("ascii"):
            problems.append(f"{path} differs from what the parameters give")
    return problems
