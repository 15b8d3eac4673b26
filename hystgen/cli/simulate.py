"""`hystgen simulate`: run a model or its inverse over records."""

from __future__ import annotations

import os
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Unpack

import click

from hystgen.arithmetic import ARITHMETICS, FIXED
from hystgen.basics import arguments, console
from hystgen.cli import common

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


def _write_record(target: Path, header: list[str], columns: dict[str, NDArray[np.float64]]) -> None:
    from hystgen import records

    target.parent.mkdir(parents=True, exist_ok=True)
    records.write_columns(target, header, list(columns.values()))


@click.command(short_help="Run a model, or its inverse, over records.")
@common.params_argument
@common.data_argument(required=True)
@click.option("-o", "output", type=click.Path(), help="CSV file, or a folder for several; default: standard output")
@click.option("--operator", type=click.Choice(["forward", "inverse"]), default="forward", show_default=True)
@click.option(
    "--arithmetic", type=click.Choice(list(ARITHMETICS)), help="compute as the emitted C does; default: double"
)
@click.option("--engine", type=click.Choice(["auto", "corners", "loop"]), help="with --arithmetic")
@click.option("--plot", type=click.Path(dir_okay=False), help="PNG or SVG of the signals, the drive's rate, the loop")
@common.effects_option
@common.record_options
def simulate(
    params: str, data: tuple[str, ...], output: str | None, operator: str, arithmetic: str | None, engine: str | None,
    plot: str | None, effects: tuple[str, ...], history: str | None, rest: float,
    **reading: Unpack[common.ReadingArguments],
) -> None:
    """Run the model (column v) or its inverse (column u) over records; several files form one session.

    Example: hystgen simulate stage_x.yaml drive.csv -o predicted.csv --history 100,-100

    For a trajectory: hystgen simulate stage_x.yaml raster.csv --operator inverse -o drive.csv --plot drive.png

    The inverse also takes a position, such as a column "Position [um]", of a file without a drive. It says how fast the
    reference and the drive move, in units per second, and warns of a drive at the model's limits.
    """
    from hystgen import records, simulation
    from hystgen.basics import drawing

    if len(data) > 1 and output is None:
        raise common.Failed("error: several records need -o with a folder", 2)
    names = [records.stem(path) for path in data]
    if len(set(names)) < len(data):
        raise common.Failed("error: two records have the same name; their results would overwrite each other", 2)
    model = common.load_model(params, effects)
    if plot:
        common.guarded(params, partial(drawing.check_path, plot))
    visited = common.history_values(history)
    how = common.reading_options(**reading)
    column, answer = simulation.SIGNALS[operator]
    read = common.guarded(params, partial(records.read_records, data, need=(column,), **how))
    units_of_model = model.parameters.units
    in_numbers = partial(simulation.in_numbers_of, model, read, operator, arithmetic, sources=data)
    converted = common.guarded(params, in_numbers)
    for record in converted:
        if {answer, f"{answer}_measured"} <= record.columns().keys():
            both = f"{record.name} has both {answer} and {answer}_measured"
            raise common.Failed(f"error: {both}; rename one with --columns", 2)
        for note in record.notes:
            console.note(f"warning: {record.name}: {note}")
    ends = model.cascade.input_range
    for note in arguments.outside("history", visited or (), ends, "the model's input_range"):
        console.note(f"warning: {note}")
    targets: list[Path | None] = [Path(output) if output else None] * len(data)
    if output and len(data) > 1 and Path(output).is_file():
        raise common.Failed(f"error: {output} is a file, and several records need -o with a folder", 2)
    if output and (len(data) > 1 or Path(output).is_dir() or output.endswith(("/", os.sep))):
        targets = [Path(output) / f"{name}.csv" for name in names]
    common.keep_inputs([*targets, plot], [params, *data])
    simulated = common.guarded(
        params,
        lambda: simulation.simulate_records(model, converted, operator, arithmetic, engine, visited or (), rest),
    )
    for record, own, target, (answers, remarks) in zip(read, converted, targets, simulated, strict=True):
        columns = record.columns()
        if operator == "inverse":
            moves, exceeded = simulation.motion(model, own, answers, arithmetic)
            console.note(moves)
            remarks = [*remarks, *exceeded]
        for sentence in remarks:
            console.note(f"warning: {sentence}")
        units = dict(record.units)
        if answer in columns:
            columns[f"{answer}_measured"] = columns.pop(answer)
            units[f"{answer}_measured"] = units.pop(answer, "")
        columns[answer] = answers
        if record.units.keys() - {"t"} and arithmetic not in FIXED:  # with units in the header, except for codes
            units[answer] = getattr(units_of_model, "output" if answer == "y" else "input")
        header = records.headers(columns, units)
        if target is None:
            console.say(records.columns_text(header, list(columns.values())).encode())  # data: always UTF-8
            continue
        common.guarded(str(target), partial(_write_record, target, header, columns))
        console.say(str(target))
    if plot:
        from hystgen.report import plots

        found = [answers for answers, _ in simulated]
        draw = partial(plots.simulation_figure, model, converted, found, operator, arithmetic)
        common.guarded(params, lambda: drawing.picture(draw, plot))
        console.note(plot) if output is None else console.say(plot)  # data: standard output holds nothing else
