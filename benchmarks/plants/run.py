"""Diagnose every case through the package's command line; only this module and `track` call the package.

Each case is first copied to a separate folder, so that the command cannot see any label.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

COMMAND = (sys.executable, "-c", "import sys; from hystgen.cli import main; sys.exit(main(sys.argv[1:]))")


def arguments(case: Path) -> list[str]:
    """Arguments of `diagnose` for a case, with paths relative to it."""
    spec = json.loads((case / "session.json").read_text())
    words = ["diagnose", "params.yaml", *spec["fit"], "-o", "out"]
    for name in spec["holdout"]:
        words += ["--holdout", name]
    if spec["history"]:
        words.append("--history=" + ",".join(f"{x:g}" for x in spec["history"]))
    if spec["rest"]:
        words.append(f"--rest={spec['rest']:g}")
    return words


def diagnose(case: Path, results: Path, limit: float, command: Sequence[str] = COMMAND) -> int:
    """Run one case and keep its diagnosis.json and a run.json; returns the exit code, -1 when out of time."""
    home = results / case.name
    shutil.rmtree(home, ignore_errors=True)
    home.mkdir(parents=True)
    with tempfile.TemporaryDirectory() as place:
        copy = Path(shutil.copytree(case, Path(place) / "session"))
        began = time.monotonic()
        try:
            done = subprocess.run(
                [*command, *arguments(case)],
                cwd=copy,
                capture_output=True,
                text=True,
                timeout=limit,
                check=False,
                env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
            )
            code, said = done.returncode, done.stderr[-2000:]
        except subprocess.TimeoutExpired:
            code, said = -1, f"stopped after {limit:g} s"
        seconds = time.monotonic() - began
        found = copy / "out" / "diagnosis.json"
        if found.is_file():
            shutil.copy(found, home)
    (home / "run.json").write_text(json.dumps({"exit": code, "seconds": round(seconds, 2), "stderr": said}) + "\n")
    return code


def run(cases: Path, results: Path, jobs: int, limit: float) -> int:
    """Run every case that has no result yet; returns the number of cases that ended with an error."""
    todo = [case for case in sorted(cases.iterdir()) if not (results / case.name / "run.json").is_file()]
    failed = 0
    with ThreadPoolExecutor(jobs) as pool:
        futures = [pool.submit(diagnose, case, results, limit) for case in todo]
        for number, future in enumerate(as_completed(futures), 1):
            failed += future.result() != 0
            print(f"\r{number}/{len(todo)} cases, {failed} not exit 0", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    return failed
