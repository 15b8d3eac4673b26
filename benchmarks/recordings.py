"""Held-out errors on measured recordings, compared with those of plain baselines fitted to the same samples.

    python benchmarks/recordings.py FOLDER [--only NAME ...] [-o docs/recordings.csv]

`FOLDER` holds the recordings named in `SETS` (columns t, v, y), which belong to others and are not part of this
project. Errors are rms with a free offset, in % of the range of the held-out output, over the samples that both
`identify` and `diagnose` compare. The baselines are fitted by least squares: a straight line; 16 plays with weights of
either sign; Preisach relays on 16 x 16 levels; plays with a cubic; plays with `LAGS` past samples of the drive.
`diagnosed`: error after `diagnose`, which starts from the model of `auto`; `s`: its time. `best`: error of the best
baseline divided by `diagnosed`.
"""

from __future__ import annotations

import argparse
import csv
import sys
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import hystgen
from hystgen.identification import IdentificationError
from hystgen.plays import operators
from hystgen.records import Record, read_record

Array = NDArray[np.float64]

PLAYS, LEVELS, LAGS = 16, 16, 32
"""Sizes of the baselines, not tuned to any error: as many plays as relay levels, and enough past samples of the drive
to cover 0.16 s of the P-885 records."""

REPORTED = {
    "loops run clockwise": "clockwise",
    "is a guess there": "beyond the fitted range",
    "explains only": "explains little",
    "Something is missing": "more is missing",
    "is not explained": "most is unexplained",
    "too few samples to judge": "start unknown",
    "can be compared": "too short",
}
"""Parts of the program's messages about recordings, and abbreviations for them."""

KINDS = ("pi", "gpi-deadzone", "gpi-tanh", "auto")


@dataclass(frozen=True)
class Part:
    """A part of a recording, from `first` to `last` as fractions of its samples."""

    file: str
    first: float = 0.0
    last: float = 1.0


@dataclass(frozen=True)
class Set:
    """Recordings to fit and to hold out; `skip`: seconds left out at each start; `exchanged`: v and y are swapped."""

    fit: tuple[Part, ...]
    held: tuple[Part, ...]
    skip: float = 0.0
    exchanged: bool = False
    falling: bool = False


def one(file: str, skip: float = 0.0) -> Set:
    """A single recording, the last 30 % held out."""
    return Set((Part(file, 0.0, 0.7),), (Part(file, 0.7),), skip)


def inside(file: str, exchanged: bool = False) -> Set:
    """A single recording of growing amplitude: a part from its middle is held out, inside the range of the rest."""
    return Set((Part(file, 0.0, 0.5), Part(file, 0.7)), (Part(file, 0.5, 0.7),), exchanged=exchanged)


SINE, FADES = "p885_sine_1hz.csv", "p885_fades_and_hold.csv"
FRICTION = (Part("more/friction_damper_0p5hz.csv"),), (Part("more/friction_damper_1hz.csv"),)
SETS = {
    "piezo P-885, sine": Set((Part(SINE),), (Part(FADES),), 1.5),
    "piezo P-885, sine and fades": Set((Part(SINE), Part(FADES, 0.0, 0.5)), (Part(FADES, 0.5),), 1.5),
    "piezo 150 V": one("piezo_150v_step_then_1hz.csv"),
    "fast steering mirror": Set((Part("more/fsm_fit.csv"),), (Part("more/fsm_test.csv"),)),
    "battery": Set((Part("more/pocv_fit.csv"),), (Part("more/pocv_held.csv"),)),
    "damper, growing": Set((Part("more/damper_chan_fit.csv"),), (Part("more/damper_chan_held.csv"),)),
    "damper, exchanged": Set((Part("more/damper_chan_fit.csv"),), (Part("more/damper_chan_held.csv"),), exchanged=True),
    "friction damper": Set(*FRICTION),
    "friction damper, exchanged": Set(*FRICTION, exchanged=True),
    "magnetic fluid damper": one("more/mr_damper.csv"),
    "wall, growing": inside("more/wall_growing.csv"),
    "wall, exchanged": inside("more/wall_growing.csv", True),
    "column, degrading": inside("more/column_degrading.csv"),
    "soil, y negated": replace(one("more/soil.csv"), falling=True),
}


def records(folder: Path, parts: Sequence[Part], of: Set) -> list[Record]:
    """The recordings of a set."""
    found = []
    for part in parts:
        whole = read_record(folder / part.file)
        n = len(whole)
        record = whole.section(round(part.first * n), round(part.last * n))
        assert record.y is not None
        if of.exchanged:
            record = replace(record, v=record.y, y=record.v)
        if of.falling:
            record = replace(record, y=-np.asarray(record.y))
        found.append(record)
    return found


# Baselines: columns of a linear least-squares fit -----------------------------------------------------------


def line(v: Array, _: Array) -> Array:
    """The drive."""
    return v[:, None]


def plays(v: Array, drives: Array) -> Array:
    """Plays up to half the range of all drives."""
    r = np.linspace(0.0, 0.5 * np.ptp(drives), PLAYS, endpoint=False)
    return np.asarray(operators.plays(v, r, np.full(PLAYS, v[0])).T)


def relays(v: Array, drives: Array) -> Array:
    """Preisach relays that switch at two of `LEVELS` levels, and the drive."""
    levels = np.linspace(np.min(drives), np.max(drives), LEVELS)
    up, down = (levels[k] for k in np.triu_indices(LEVELS)[::-1])
    state = np.where(v[0] >= up, 1.0, -1.0)
    out = np.empty((len(v), len(up)))
    for k, x in enumerate(v):
        state = np.where(x >= up, 1.0, np.where(x <= down, -1.0, state))
        out[k] = state
    return np.column_stack([out, v])


def cubic(v: Array, drives: Array) -> Array:
    """A cubic polynomial, and plays."""
    x = v / np.max(np.abs(drives))
    return np.column_stack([x**2, x**3, plays(v, drives)])


def lagged(v: Array, drives: Array) -> Array:
    """Past samples of the drive, and plays."""
    past = np.column_stack([np.concatenate([np.full(k, v[0]), v[: len(v) - k]]) for k in range(1, LAGS + 1)])
    return np.column_stack([past, plays(v, drives)])


BASELINES: dict[str, Callable[[Array, Array], Array]] = {
    "line": line, "plays": plays, "relays": relays, "cubic": cubic, "lagged": lagged,
}  # fmt: skip


def baseline(columns: Callable[[Array, Array], Array], fit: Sequence[Compared], held: Sequence[Compared]) -> float:
    """Held-out error of the least-squares fit with these columns and an offset per record."""
    drives = np.concatenate([each.record.v for each in fit])
    rows, targets = [], []
    for each in fit:
        found = columns(each.record.v, drives)[each.compared]
        rows.append(found - np.mean(found, axis=0))
        y = each.y[each.compared]
        targets.append(y - np.mean(y))
    weights = np.linalg.lstsq(np.concatenate(rows), np.concatenate(targets), rcond=1e-6)[0]
    return error(held, [columns(each.record.v, drives) @ weights for each in held])


@dataclass(frozen=True)
class Compared:
    """A recording, and which of its samples are compared."""

    record: Record
    compared: NDArray[np.bool_]

    @property
    def y(self) -> Array:
        """The measured output."""
        assert self.record.y is not None
        return self.record.y


def error(held: Sequence[Compared], outputs: Sequence[Array]) -> float:
    """The rms error, % of the largest range of the recordings."""
    squares, number, largest = 0.0, 0, 0.0
    for each, output in zip(held, outputs, strict=True):
        y = each.y[each.compared]
        left = y - output[each.compared]
        squares += float(np.sum((left - np.mean(left)) ** 2))
        number += len(left)
        largest = max(largest, float(np.ptp(y)))
    return 100.0 * (squares / number) ** 0.5 / largest


# The table --------------------------------------------------------------------------------------------------


def row(name: str, folder: Path) -> dict[str, str]:
    """One line of the table."""
    of = SETS[name]
    to_fit, to_hold = (records(folder, parts, of) for parts in (of.fit, of.held))
    found = {"recordings": name}
    fits = {}
    for kind in KINDS:
        try:
            fits[kind] = hystgen.identify(to_fit, model=kind, holdout=to_hold, skip=of.skip)
        except IdentificationError as failure:
            found["says"] = str(failure)
    if "auto" not in fits:
        return found
    used = fits["auto"].used
    fitted = [Compared(r, u.compared) for r, u in zip(to_fit, used[: len(to_fit)], strict=True)]
    began, diagnosis, signals = time.perf_counter(), None, []
    try:
        diagnosis = hystgen.diagnose(fits["auto"].model, to_fit, holdout=to_hold, skip=of.skip)
        found["s"] = f"{time.perf_counter() - began:.1f}"
        signals = [each for each in diagnosis.signals if each.held_out][: len(to_hold)]  # ends of fitted records follow
    except IdentificationError as failure:
        found["says"] = str(failure)
    held_out = []
    for k, (record, each) in enumerate(zip(to_hold, used[len(to_fit) :], strict=True)):
        both = each.compared & np.isfinite(signals[k].after) if signals else each.compared
        held_out.append(Compared(record, both))
    for kind, fit in fits.items():
        outputs = [fit.along(r, u) for r, u in zip(to_hold, fit.used[len(to_fit) :], strict=True)]
        found[kind] = f"{error(held_out, outputs):.3g}"
    others = {key: baseline(columns, fitted, held_out) for key, columns in BASELINES.items()}
    found |= {key: f"{value:.3g}" for key, value in others.items()}
    if diagnosis is None:
        return found
    after = error(held_out, [each.y - signal.after for each, signal in zip(held_out, signals, strict=True)])
    found["diagnosed"], found["best"] = f"{after:.3g}", f"{min(others.values()) / after:.2f}"
    found["names"] = " ".join(each["name"] for each in diagnosis.content["effects"])
    found["says"] = "; ".join([*fits["auto"].warnings, diagnosis.sentence()])
    return found


def reported(says: str) -> str:
    """The messages about a recording, abbreviated."""
    return ", ".join(short for text, short in REPORTED.items() if text in says)


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", nargs="+", choices=list(SETS), default=list(SETS))
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args()
    head = ["recordings", *BASELINES, *KINDS, "diagnosed", "best", "s", "names", "reported"]
    lines = []
    for name in options.only:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = row(name, options.folder)
        lines.append(found | {"reported": reported(found.get("says", ""))})
        print("  ".join(f"{key} {lines[-1].get(key, '-')}" for key in (*head, "says")), flush=True)
    if options.output is not None:
        with options.output.open("w", encoding="ascii", newline="") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerow(head)
            table.writerows([[each.get(key, "") for key in head] for each in lines])
    return 0


if __name__ == "__main__":
    sys.exit(main())
