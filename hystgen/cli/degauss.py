"""`hystgen degauss`: the drives that erase an actuator's memory."""

from __future__ import annotations

from functools import partial

import click
import numpy as np

from hystgen.basics import console
from hystgen.cli import common


@click.command(short_help="Write the drives that erase an actuator's memory.")
@common.params_argument
@click.option(
    "-o", "output", type=click.Path(dir_okay=False), required=True, metavar="FILE.csv", help="table of t and v"
)
@click.option("--start", type=float, help="drive at the start, input units  [default: that at the end]")
@click.option("--end", type=float, help="drive at the end  [default: that of the start memory]")
@click.option(
    "--within", type=float, metavar="PERCENT", help="of the output's range, which effects may keep  [default: 1]"
)
@click.option("--max-rate", type=float, help="fastest change of the drive, input units per second")
@click.option("--sample-time", type=float, help="s between samples, for a file without sample_time")
@common.effects_option
def degauss(
    params: str, output: str, start: float | None, end: float | None, within: float | None, max_rate: float | None,
    sample_time: float | None, effects: tuple[str, ...],
) -> None:
    """Write the drives that erase an actuator's memory: turns that decay about a drive, down to its smallest play.

    Example: hystgen degauss stage_x.yaml --end 50 -o degauss.csv

    Prints the memory that they leave, as initial_state of a parameter file. With `emit: {degauss: {end: 50}}` in the
    parameter file, emitted C has the same sequence, NAME_degauss_step.
    """
    from hystgen import degaussing, records
    from hystgen.basics import writing

    model = common.load_model(params, effects)
    common.keep_inputs([output], [params])
    common.guarded(output, partial(writing.check_writable, output))
    if sample_time is not None:
        if not 0.0 < sample_time < float("inf"):
            raise click.BadParameter("give seconds, above 0", param_hint="'--sample-time'")
        model = type(model)(model.parameters.model_copy(update={"sample_time": sample_time}))
    seconds = model.parameters.sample_time
    if seconds is None:
        raise common.Failed(f"{params}: error: the table needs times; add sample_time, or give --sample-time", 2)

    def run() -> None:
        share = None if within is None else within / 100.0
        found = degaussing.degauss(model, end=end, within=share, max_rate=max_rate)
        v = found.drives(found.end if start is None else start)
        names = records.headers(("t", "v"), {"t": "s", "v": model.parameters.units.input})
        writing.write_atomically(output, records.columns_text(names, (np.arange(len(v)) * seconds, v)))
        for sentence in found.sentences():
            console.note(sentence)
        console.say(output)

    common.guarded(params, run)
