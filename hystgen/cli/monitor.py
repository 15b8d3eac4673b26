"""`hystgen monitor`: whether a unit in service has moved away from its model."""

from __future__ import annotations

import shlex
from functools import partial
from pathlib import Path
from typing import Unpack

import click

from hystgen.basics import console
from hystgen.cli import common


def _probability(_context: click.Context, _option: click.Parameter, value: float) -> float:
    if not 0.0 < value < 1.0:
        raise click.BadParameter("give a probability between 0 and 1, such as 0.01")
    return value


@click.command(short_help="Watch a unit in service: has it moved away from its model?")
@common.params_argument
@common.data_argument(required=True)
@click.option(
    "--false-alarms", type=float, callback=_probability, default=0.01, show_default=True,
    help="probability of an alarm for a healthy set of sessions",
)
@click.option("-o", "output", type=click.Path(file_okay=False), help="folder for monitor.json and a page")
@click.option("--json", "json_file", type=click.Path(dir_okay=False), help="write the judgement as JSON")
@click.option(
    "--refine", type=click.Path(dir_okay=False), metavar="NEW.yaml",
    help="write the parameters that the sessions show, as a new parameter file",
)
@click.option("--no-causes", is_flag=True, help="leave out the diagnosis of a change, which takes most of the time")
@common.effects_option
@common.record_options
@common.skip_option
@common.quiet_option
def monitor(
    params: str, data: tuple[str, ...], false_alarms: float, output: str | None, json_file: str | None,
    refine: str | None, no_causes: bool, effects: tuple[str, ...], history: str | None, rest: float, skip: float,
    quiet: bool,
    **reading: Unpack[common.ReadingArguments],
) -> None:
    """Has the unit moved away from its model, since when, by what, and does it matter?

    DATA are records of compensated operation, one a session: drive v, measured displacement y, and the reference as
    column u for the tracking error. Exit code 1 for an alarm, 0 for none, 2 if the records cannot tell.

    Example: hystgen monitor stage_x.yaml sessions/2026-*.csv -o monitor/

    Example: hystgen monitor stage_x.yaml sessions/2026-*.csv --refine stage_x_new.yaml
    """
    from hystgen.basics import drawing, extras, writing
    from hystgen.effects import load_user_effects
    from hystgen.report import monitoring as report
    from hystgen.service.monitoring import Monitoring

    model = common.load_model(params, effects)
    common.guarded(params, partial(extras.require_fit, "monitor", plot=bool(output)))
    inside = [Path(output) / name for name in Monitoring.FILES] if output else []
    common.keep_inputs([json_file, refine, *inside], [params, *data])
    for path in filter(None, (json_file, refine)):
        common.guarded(path, partial(writing.check_writable, path))
    if output:
        common.guarded(output, drawing.require)
        common.guarded(output, partial(writing.check_files, Path(output), Monitoring.FILES))
    own = [kind for path in effects for kind in common.guarded(path, partial(load_user_effects, path))]
    visited = common.history_values(history)
    how = common.reading_options(**reading)
    found = common.guarded(
        params,
        lambda: report.monitor(
            model, data, false_alarms=false_alarms, causes=not no_causes, history=visited, rest=rest, skip=skip,
            effects=own, **how,
        ),
    )
    for note in found.notes:
        console.note(f"warning: {note}")
    if not quiet or found.verdict != "healthy":
        console.say(found.sentence())
    for text in found.advice():
        console.note(f"to tell more: {text}")
    refined = common.guarded(params, found.refine) if refine else None
    if json_file:
        common.guarded(json_file, partial(writing.write_atomically, json_file, found.to_json()))
    if output:
        common.guarded(output, lambda: found.write(output))
    written = [*filter(None, [json_file]), *map(str, inside)]
    if refine and refined is not None:
        console.say(refined.table())
        common.guarded(refine, partial(writing.write_atomically, refine, refined.text()))
        written.append(refine)
    for path in () if quiet else written:
        console.say(path)
    if found.alarm and not refine and not quiet:
        new = shlex.quote(f"{Path(params).stem}_new.yaml")
        words = " ".join(map(shlex.quote, data)) if len(data) < 4 else "RECORDS"
        console.say(f"Your next step: bring the model up to date:\n    hystgen monitor {params} {words} --refine {new}")
    if found.verdict != "healthy":
        raise SystemExit(1 if found.alarm else 2)
