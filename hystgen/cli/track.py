"""`hystgen track`: the tracking error of a compensator on the recorded actuator."""

from __future__ import annotations

from functools import partial
from typing import Unpack

import click

from hystgen.basics import console
from hystgen.cli import common


@click.command(short_help="Print the tracking error on a recorded actuator.")
@common.params_argument
@common.data_argument(required=True)
@click.option("-o", "output", type=click.Path(file_okay=False), help="folder for a page, its picture and the JSON")
@click.option("--plot", type=click.Path(dir_okay=False), help="PNG or SVG of the tracking errors over time")
@click.option("--json", "json_file", type=click.Path(dir_okay=False), help="write the errors as JSON")
@common.effects_option
@common.record_options
@common.skip_option
@common.skew_option
def track(
    params: str, data: tuple[str, ...], output: str | None, plot: str | None, json_file: str | None,
    effects: tuple[str, ...], history: str | None, rest: float, skip: float, clock_skew: float | str | None,
    **reading: Unpack[common.ReadingArguments],
) -> None:
    """Print the tracking error on the recorded actuator: with a straight line, with plays alone, with the whole model.

    The straight line is fitted to the records. Plays alone are the model without its effects, otherwise unchanged.

    Example: hystgen track diagnosed/params.yaml held_out.csv -o tracking/
    """
    from pathlib import Path

    from hystgen import records, tracking
    from hystgen.basics import drawing, extras, writing
    from hystgen.report.tracking import track as tracked

    model = common.load_model(params, effects)
    common.guarded(params, partial(extras.require_fit, "track", plot=bool(plot or output)))
    visited = common.history_values(history)
    inside = [str(Path(output) / name) for name in tracking.Tracking.FILES] if output else []
    common.keep_inputs([plot, json_file, *inside], [params, *data])
    if json_file:
        common.guarded(json_file, partial(writing.check_writable, json_file))
    if plot:
        common.guarded(params, partial(drawing.check_path, plot))
    if output:
        common.guarded(output, drawing.require)
        common.guarded(output, partial(writing.check_files, Path(output), tracking.Tracking.FILES))
    how = common.reading_options(**reading)
    read = common.guarded(params, partial(records.read_records, data, need=("v", "y"), **how))
    read = common.guarded(params, partial(records.in_units, read, model.parameters.units, sources=data))
    for record in read:
        for note in record.notes:
            console.note(f"warning: {record.name}: {note}")
    found = common.guarded(params, lambda: tracked(model, read, visited or (), rest, skip, clock_skew))
    for note in found.notes:
        console.note(f"warning: {note}")
    if note := tracking.late(model, read):
        console.note(f"warning: {note}")
    for each in found.records:
        for sentence in each.limited:
            console.note(f"warning: {sentence}")
    console.say(found.table())
    if json_file:
        common.guarded(json_file, partial(writing.write_atomically, json_file, found.to_json()))
        console.say(json_file)
    if plot:
        common.guarded(params, lambda: found.plot(plot))
        console.say(plot)
    if output:
        for path in common.guarded(output, lambda: found.write(output)):
            console.say(str(path))
