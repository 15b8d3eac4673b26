"""How well a PI or GPI inverse, as compiled C, linearises other hysteretic plants, and where it stops being enough.

For every plant, a training and a held-out record are simulated, `hystgen.identify` chooses among its models, and the
compensator is emitted as C, compiled on this machine and run in front of the plant along a reference that is in neither
record. Writes plants.csv and plants.svg into the folder and prints the table.

Usage: python examples/compensate_plants.py [-o FOLDER] [--plant NAME]
"""

from __future__ import annotations

import argparse
import csv
import itertools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import hystgen
from hystgen.basics import drawing
from hystgen.closed_loop import CompiledC
from hystgen.plants import (
    BoucWen,
    Dahl,
    Duhem,
    EverettTable,
    JilesAtherton,
    KrasnoselskiiPokrovskii,
    MaxwellSlip,
    Preisach,
)
from hystgen.records import Record

Array = NDArray[np.float64]

SAMPLES = 1500  # length of one part of a record
STEP = 1e-3  # seconds from sample to sample
LEAST = 1e-4  # [%] smallest error shown: smaller ones differ between machines by the rounding of linear algebra

PLAYS = np.array([[0.0, 4.0, 9.0, 16.0, 26.0], [0.10, 0.03, 0.025, 0.02, 0.015]])  # thresholds and weights


@dataclass(frozen=True)
class Case:
    """A plant, its drive range, whether it leads, and the model that `hystgen.identify` fits.

    The output of a leading plant runs ahead of its input. A play sum for it would need negative weights, which
    `identify` never returns; but its inverse lags. So input and output of the records are exchanged, and the identified
    model itself is the compensator: its forward operator is emitted.
    """

    name: str
    plant: Callable[[Array], Array]
    drive: tuple[float, float]
    leads: bool = False
    model: str = "auto"
    thresholds: int | tuple[float, ...] | None = None
    remark: str = ""


@dataclass(frozen=True)
class Result:
    """Results of a case; errors in % of the training record's range of the predicted or controlled quantity."""

    case: Case
    model: str
    plays: int
    held_out: float
    scaled: tuple[float, float]
    compensated: tuple[float, float]
    fixed_point: tuple[float, float]
    place: float
    history: float
    open_loop: float
    reference: Array
    outputs: Mapping[str, Array]


def play_surface(alpha: Array, beta: Array) -> Array:
    """Everett surface of a play sum: it depends only on alpha - beta."""
    thresholds, weights = PLAYS
    return np.asarray(np.maximum((alpha - beta)[..., None] - 2.0 * thresholds, 0.0) @ weights)


def bell(alpha: Array, beta: Array) -> Array:
    """Density of relays: lower far from the middle and for wide loops."""
    centre, half = (alpha + beta) / 2.0, (alpha - beta) / 2.0
    return np.asarray(np.exp(-0.5 * ((centre - 50.0) / 30.0) ** 2 - half / 12.0))


def cases() -> list[Case]:
    """The plants, those that suit a play sum first; then some of them again, with other models."""
    slip = MaxwellSlip([1.0, 0.8, 0.6, 0.5], [0.4, 0.9, 1.5, 2.6], spring=1.0)
    hardening = BoucWen(alpha=1.6, k=0.1, D=8.0, beta=0.6, gamma=0.3, n=1.0)
    softening = BoucWen(alpha=0.4, k=0.1, D=8.0, beta=0.6, gamma=0.3, n=1.0)
    friction = Dahl(sigma=0.035, limit=0.4, exponent=1.0)
    lagging = Duhem.coleman_hodgdon(0.06, lambda v: 0.1 * v, lambda v: 0.06 + 0.0002 * v)
    relays = Preisach(EverettTable.of_density(np.linspace(0.0, 100.0, 201).tolist(), bell), 0.0, 100.0)
    ramps = KrasnoselskiiPokrovskii.on_grid(0.0, 100.0, 40, lambda p1, p2: bell(p2, p1))
    magnet = JilesAtherton(Ms=1.6e6, a=1100.0, k=400.0, alpha=1.6e-3, c=0.2)
    volts = (0.0, 100.0)
    plays = Case("Preisach, surface of a play sum", Preisach(play_surface, *volts).simulate, volts)
    blocks = Case("Maxwell-slip", slip.simulate, (-6.0, 6.0), leads=True)
    inside = tuple(slip.play_sum().inverse().thresholds[1:])
    apart = "minor loops stay open and depend on the history"
    place = "congruent, but loops depend on where they lie, which the front models"
    open_loops = [
        Case("Dahl friction in a positioner", lambda v: 0.1 * v - friction.simulate(v), volts, remark=apart),
        Case("Bouc-Wen, alpha = 1.6", hardening.simulate, volts, remark=apart),
        Case("Bouc-Wen, alpha = 0.4", softening.simulate, volts, remark=apart + "; the output leads"),
        Case("Duhem, Coleman-Hodgdon", lagging.simulate, volts, remark=apart),
    ]
    others = [
        Case("Preisach, bell-shaped density", relays.simulate, volts, remark=place),
        Case("Krasnosel'skii-Pokrovskii", ramps.simulate, volts, remark=place),
        Case("Jiles-Atherton", magnet.simulate, (-3000.0, 3000.0), remark="saturates, and minor loops stay open"),
    ]
    given = tuple(PLAYS[0][1:].tolist())
    return [
        replace(plays, remark="a PI model, except for the chosen thresholds"),
        replace(plays, model="pi", thresholds=given, remark="a PI model, thresholds given"),
        replace(blocks, remark="a PI model with the axes exchanged, except for the thresholds"),
        replace(blocks, model="pi", thresholds=inside, remark="a PI model with the axes exchanged, thresholds given"),
        *open_loops,
        *others,
        *(replace(case, model="pi", thresholds=32, remark="32 plays") for case in open_loops),
        *(replace(case, model="gpi-tanh", thresholds=32, remark="32 plays behind a front") for case in open_loops),
        *(replace(case, model="pi", remark="no front") for case in others),
        replace(others[-1], model="gpi-deadzone", remark="another front"),
    ]


def moves(corners: list[float]) -> Array:
    """Half cosines from corner to corner, as shares of the drive range; longer moves take longer."""
    parts = []
    for start, stop in itertools.pairwise(corners):
        count = max(round(0.25 * SAMPLES * abs(stop - start)), 12)
        parts.append(start + (stop - start) * (0.5 - 0.5 * np.cos(np.pi * np.arange(count) / count)))
    return np.concatenate(parts)


def training() -> Array:
    """Two full sweeps, loops of three sizes at three heights, and a sine that fades out, as shares of the range."""
    loops = [0.5, 0.0, 1.0, 0.0, 1.0, 0.2, 0.8, 0.35, 0.65, 0.45, 0.55, 0.1, 0.4, 0.15, 0.35, 0.05, 0.95, 0.6, 0.9,
             0.65, 0.85, 0.0, 1.0, 0.5]
    k = np.arange(3 * SAMPLES) / SAMPLES
    return np.concatenate([moves(loops), 0.5 + 0.5 * np.sin(2.0 * np.pi * 6.0 * k) * (1.0 - k / 3.0)])


def held_out() -> Array:
    """One full sweep, then two sines with no common period, as shares of the range."""
    k = np.arange(2 * SAMPLES) / SAMPLES
    two = 0.5 + 0.3 * np.sin(2.0 * np.pi * 2.3 * k) + 0.17 * np.sin(2.0 * np.pi * 7.9 * k)
    return np.concatenate([moves([0.5, 1.0, 0.0, float(two[0])]), two])


def trajectory() -> tuple[Array, int]:
    """A reference as shares of the output range, and the sample from which errors count, after a sweep of the whole
    range.

    The sweep wipes out the start of plant and compensator. What counts is three swelling sines and a staircase.
    """
    k = np.arange(3 * SAMPLES) / SAMPLES
    turns = 2.0 * np.pi * k
    sines = np.sin(1.7 * turns) + 0.6 * np.sin(4.3 * turns + 1.0) + 0.35 * np.sin(9.7 * turns)
    swelling = 0.5 + 0.45 * sines / np.max(np.abs(sines)) * (0.2 + 0.8 * k / 3.0)
    stairs = [float(swelling[-1]), 0.3, 0.4, 0.25, 0.7, 0.6, 0.85, 0.8, 0.9, 0.1, 0.2, 0.15, 0.5]
    before = moves([0.5, 1.0, 0.0, float(swelling[0])])
    return np.concatenate([before, swelling, moves(stairs)]), len(before)


def in_range(shares: Array, ends: tuple[float, float]) -> Array:
    """From shares to units."""
    return ends[0] + (ends[1] - ends[0]) * shares


def in_c(model: hystgen.Model, operator: str, arithmetic: str, x: Array) -> Array:
    """Output (N,) of the emitted operator, compiled on this machine, for the samples `x` (N,) in physical units."""
    compensator = CompiledC(model, operator, arithmetic)
    compensator.reset()
    return np.array([compensator.step(sample) for sample in x.tolist()])


def memory(case: Case) -> tuple[float, float, float]:
    """Three figures of loops over a tenth of the drive range, in % of such a loop's height; all are 0 for a play sum.

    How much the height differs between three places; how much it differs in one place depending on the history; how far
    apart a loop's start and end are. The plants do not depend on time, so a drive is fully described by its corners.
    """

    def heights(corners: list[float]) -> tuple[float, float]:
        y = case.plant(in_range(np.array([0.5, 0.0, *corners]), case.drive))
        return abs(float(y[-1] - y[-2])), abs(float(y[-1] - y[-3]))

    places = [heights([1.0, centre - 0.05, centre + 0.05, centre - 0.05]) for centre in (0.2, 0.5, 0.8)]
    others = [heights([*before, 0.45, 0.55, 0.45]) for before in ([1.0, 0.0, 0.6], [1.0, 0.3, 0.8])]
    middle = places[1][0]
    return (
        100.0 * (max(h for h, _ in places) - min(h for h, _ in places)) / middle,
        100.0 * max(abs(h - middle) for h, _ in others) / middle,
        100.0 * max(gap for _, gap in (*places, *others)) / middle,
    )


def measure(case: Case) -> Result:
    """Identify, emit, compile and compensate one plant."""

    def record(name: str, shares: Array) -> Record:
        v = in_range(shares, case.drive)
        y = case.plant(v)
        return Record(name, np.arange(len(v)) * STEP, *((y, v) if case.leads else (v, y)), sample_time=STEP)

    train, other = record("training", training()), record("held out", held_out())
    fit = hystgen.identify(train, holdout=other, model=case.model, thresholds=case.thresholds, name="plant")
    identified = hystgen.Model(fit.parameters.model_copy(update={"sample_time": STEP}))
    assert train.y is not None
    v, y = (train.y, train.v) if case.leads else (train.v, train.y)
    ends = float(np.min(y)), float(np.max(y))
    shares, first = trajectory()
    reference = in_range(shares, ends)
    operator = "forward" if case.leads else "inverse"
    gain, offset = np.polyfit(v, y, 1)
    drives = {"scaled": np.clip((reference - offset) / gain, *case.drive)}
    drives["compensated"] = in_c(identified, operator, "float32", reference)
    drives["fixed point"] = in_c(identified, operator, "q31", reference)
    outputs = {name: case.plant(np.clip(drive, *case.drive))[first:] for name, drive in drives.items()}
    wanted = reference[first:]

    def percent(name: str) -> tuple[float, float]:
        error = 100.0 * (outputs[name] - wanted) / (ends[1] - ends[0])
        return float(np.sqrt(np.mean(error**2))), float(np.max(np.abs(error)))

    seen = next(row for row in fit.rows if row.part == "held out")
    stages = fit.parameters.model.memoryless
    kind = {"dead_zone": "dead-zone front", "tanh": "tanh front"}[stages[0].kind] if stages else "PI"
    if fit.parameters.model.effects:
        kind = f"{kind} and an element"
    return Result(
        case, kind, len(fit.parameters.model.pi.thresholds) - 1, 100.0 * seen.rms / float(np.ptp(train.y)),
        percent("scaled"), percent("compensated"), percent("fixed point"), *memory(case), wanted, outputs,
    )  # fmt: skip


HEADER = (
    "plant", "model", "plays", "held-out rms %", "scaled rms %", "scaled max %", "C rms %", "C max %", "q31 rms %",
    "place %", "history %", "open %", "remark",
)  # fmt: skip


def row(result: Result) -> list[str]:
    """A result as text."""
    numbers = [result.held_out, *result.scaled, *result.compensated, result.fixed_point[0]]
    traits = [result.place, result.history, result.open_loop]
    return [
        result.case.name, result.model, str(result.plays), *(f"{max(x, LEAST):.2g}" for x in numbers),
        *(f"{x:.2g}" if x >= 0.05 else "0" for x in traits), result.case.remark,
    ]  # fmt: skip


def table(results: list[Result]) -> str:
    """All results, in columns."""
    rows = [list(HEADER), *map(row, results)]
    widths = [max(len(line[k]) for line in rows) for k in range(len(HEADER))]
    return "\n".join("  ".join(text.ljust(width) for text, width in zip(line, widths, strict=True)) for line in rows)


def draw(results: list[Result]) -> Any:
    """Output over reference of every plant, without and with the compensator chosen for it."""
    columns = 3
    results = [result for result in results if result.case.model == "auto"]
    lines = -(-len(results) // columns)
    figure = drawing.figure(10.4, 3.2 * lines)
    for k, result in enumerate(results, 1):
        axis = figure.add_subplot(lines, columns, k)
        span = result.reference.min(), result.reference.max()
        for name, colour, label in (("scaled", drawing.IGNORED, "straight line"), ("compensated", drawing.MODEL, "C")):
            shown = (np.array([result.reference, result.outputs[name]]) - span[0]) / (span[1] - span[0])
            rms = result.scaled[0] if name == "scaled" else result.compensated[0]
            axis.plot(*shown[:, ::14], color=colour, linewidth=0.8, label=f"{label}: {rms:.2g} % rms")
        axis.set_title(result.case.name)
        axis.legend(loc="upper left")
    figure.supxlabel("reference, as a share of its range")
    figure.supylabel("output")
    return figure


def make(folder: Path, only: str = "") -> list[Result]:
    """Write plants.csv and plants.svg into the folder, for all plants or just one."""
    folder.mkdir(parents=True, exist_ok=True)
    results = [measure(case) for case in cases() if only in ("", case.name)]
    with open(folder / "plants.csv", "w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([HEADER, *map(row, results)])
    with drawing.styled():
        (folder / "plants.svg").write_bytes(drawing.content(draw(results), "svg"))
    return results


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    out = Path(__file__).resolve().parent / "out"
    parser.add_argument("-o", "--output", type=Path, default=out, help="folder of the table and the figure")
    names = dict.fromkeys(case.name for case in cases())
    parser.add_argument("--plant", default="", choices=names, metavar="NAME", help="only this plant")
    given = parser.parse_args()
    print(table(make(given.output, given.plant)))


if __name__ == "__main__":
    main()
