"""`python -m tests.oracle`: check stated bounds of random models, or of parameter files, against the exact model."""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
import warnings
from pathlib import Path

from tests.oracle import check, effects


def main() -> int:
    """Run the checks. Returns the exit code: 0 without faults, 1 otherwise."""
    parser = argparse.ArgumentParser(prog="python -m tests.oracle", description=__doc__)
    parser.add_argument("files", nargs="*", type=Path, help="parameter files; without any, random models")
    parser.add_argument("--models", type=int, default=300, help="number of random models")
    parser.add_argument("--first", type=int, default=0, help="seed of the first of them")
    parser.add_argument("--calls", type=int, default=check.CALLS, help="calls of each operator of a model")
    parser.add_argument("--seeds", type=int, default=8, help="runs of each parameter file")
    parser.add_argument("--arithmetic", choices=sorted(check.KINDS))
    parser.add_argument("--engine", choices=("corners", "loop"))
    parser.add_argument("--effects", type=int, default=8, help="number of random models with effects, an arithmetic")
    parser.add_argument("--samples", type=int, default=1_000_000, help="samples of each operator of such a model")
    parser.add_argument("--keep", type=Path, default=Path("build/oracle"), help="folder for models with faults")
    asked = parser.parse_args()
    combinations = tuple(
        (a, e)
        for a, e in check.COMBINATIONS
        if a == (asked.arithmetic or a) and e == (asked.engine or e)
    )
    warnings.simplefilter("ignore", UserWarning)  # about projected start memories
    begun = time.perf_counter()
    if asked.files:
        tallies, faults = files(asked.files, combinations, asked.seeds, asked.calls)
    else:
        tallies, faults = check.run(asked.models, asked.first, combinations, asked.calls)
    print(check.table(tallies))
    sentences = check.keep(faults, asked.keep) if faults else []
    if asked.effects and not asked.files:
        arithmetics = tuple(dict.fromkeys(arithmetic for arithmetic, _ in combinations))
        long = effects.run(asked.effects, asked.first, arithmetics, asked.samples)
        print(effects.table(long))
        sentences += [sentence for tally in long.values() for sentence in tally.sentences]
    print(f"{time.perf_counter() - begun:.0f} s")
    for sentence in sentences:
        print(sentence)
    return 1 if sentences else 0


def files(
    paths: list[Path], combinations: tuple[tuple[str, str], ...], seeds: int, calls: int
) -> tuple[dict[tuple[str, str], check.Tally], list[check.Finding]]:
    """Check every parameter file in every combination. Returns counts and faults."""
    tallies = {combination: check.Tally() for combination in combinations}
    faults = []
    for path in paths:
        for combination in combinations:
            with tempfile.TemporaryDirectory(prefix="hystgen-oracle-", ignore_cleanup_errors=True) as name:
                found, refused = check.follow_file(path, *combination, Path(name), seeds, calls)
            tally = tallies[combination]
            tally.models += not refused
            tally.refused += refused
            for finding in found:
                tally.add(finding)
            wrong = [finding for finding in found if finding.result.faults]
            tally.faulty += bool(wrong)
            faults += wrong
    return tallies, faults


if __name__ == "__main__":
    sys.exit(main())
