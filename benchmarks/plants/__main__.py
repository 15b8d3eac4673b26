"""Command line: `python -m benchmarks.plants generate | run | score | track`; each has `--help`."""

from __future__ import annotations

import argparse
import os
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

# the matrices are small: linear algebra threads would only wait for each other
for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")


def _seeds(text: str) -> range:
    first, _, last = text.partition(":")
    return range(int(first), int(last or int(first) + 1))


def main(words: list[str] | None = None) -> int:
    from . import labels, score, session, track
    from .case import KINDS, LARGE, REPORT, SMALL
    from .run import run

    described = "Blind plants for `hystgen diagnose`."
    parser = argparse.ArgumentParser(prog="python -m benchmarks.plants", description=described)
    commands = parser.add_subparsers(dest="command", required=True)
    make = commands.add_parser("generate", help="write cases and, beside them, their labels")
    make.add_argument("--block", choices=("tune", "report"), required=True)
    make.add_argument("--kind", choices=KINDS, required=True)
    make.add_argument("--seeds", type=_seeds, required=True, metavar="A:B", help="A to B - 1, counted in the block")
    make.add_argument("-o", dest="folder", required=True, metavar="DIR", help="gets cases/ and labels/")
    make.add_argument("--large", action="store_true", help="about 50000 samples a case, not 13000")
    make.add_argument("--no-rivals", action="store_true", help="do not determine which names are alike (quick)")
    make.add_argument("--drives", type=Path, metavar="DIR", help="take the drives of its CSV files as they are")
    make.add_argument("--holdout", action="append", default=[], metavar="FILE", help="of these, one that is held out")
    make.add_argument("--jobs", type=int, default=1)
    ask = commands.add_parser("run", help="have every case diagnosed that has no result yet")
    ask.add_argument("cases", type=Path)
    ask.add_argument("-o", dest="results", type=Path, required=True, metavar="RESULTS")
    ask.add_argument("--jobs", type=int, default=1)
    ask.add_argument("--timeout", type=float, default=600.0, help="seconds a case")
    judge = commands.add_parser("score", help="count; exit 1 when a limit is missed")
    judge.add_argument("cases", type=Path)
    judge.add_argument("labels", type=Path)
    judge.add_argument("results", type=Path)
    judge.add_argument("--json", type=Path, metavar="F")
    follow = commands.add_parser("track", help="how well plants follow a reference behind compensators")
    follow.add_argument("effects", nargs="*", metavar="EFFECT", help="or `pairs`; default: each of EFFECTS alone")
    follow.add_argument("--seeds", type=_seeds, default=range(5), metavar="A:B")
    follow.add_argument("--jobs", type=int, default=1)
    given = parser.parse_args(words)
    if given.command == "track":
        return track.main(given.effects, given.seeds, given.jobs)
    if given.command == "run":
        run(given.cases, given.results, given.jobs, given.timeout)
        return 0
    if given.command == "score":
        return score.main(given.cases, given.labels, given.results, given.json)
    if given.seeds.stop > REPORT and given.block == "tune":
        parser.error(f"the tune block ends before {REPORT}")
    first = REPORT if given.block == "report" else 0
    samples = LARGE if given.large else SMALL
    drives = session.read_drives(given.drives, given.holdout) if given.drives else []
    tasks = [(given.kind, first + seed, samples, not given.no_rivals, given.folder, drives) for seed in given.seeds]
    with ProcessPoolExecutor(given.jobs) as pool:
        for number, name in enumerate(pool.map(labels.generate, tasks), 1):
            print(f"{number}/{len(tasks)} {name}", file=sys.stderr, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
