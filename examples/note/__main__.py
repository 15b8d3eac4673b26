"""Redraw the figures of the tutorial note and compare our results with every number that it prints.

    python examples/note [-o FOLDER]

runs `make` of every module in this folder. If a number differs from the printed one, or from the correct one where the
note has a misprint (docs/note.md lists them), the command names it, and the exit code is 1.
"""

from __future__ import annotations

import argparse
import importlib
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent


def main() -> int:
    """Exit code: 0 if all numbers hold."""
    parser = argparse.ArgumentParser(prog="python examples/note", description="Draw the figures of the tutorial note.")
    parser.add_argument("-o", "--output", type=Path, default=HERE / "out", help="folder of the figures")
    folder = parser.parse_args().output
    folder.mkdir(parents=True, exist_ok=True)
    sys.path.insert(0, str(HERE))
    failed = False
    for path in sorted(HERE.glob("*.py")):
        module = None if path.stem == "__main__" else importlib.import_module(path.stem)
        if module is None or not hasattr(module, "make"):
            continue
        before = {p: p.stat().st_mtime_ns for p in folder.iterdir()}
        try:
            module.make(folder)
        except AssertionError as error:
            print(f"{path.name}: {error}", file=sys.stderr)
            failed = True
        made = sorted(p.name for p in folder.iterdir() if before.get(p) != p.stat().st_mtime_ns)
        print(f"{path.name}: {', '.join(made)}")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
