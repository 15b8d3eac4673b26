"""`hystgen show`: the properties of a model."""

from __future__ import annotations

import json
from functools import partial

import click

from hystgen.basics import console
from hystgen.cli import common


@click.command(short_help="Print the properties of a model and the cost of its C.")
@common.params_argument
@click.option("--plot", type=click.Path(dir_okay=False), help="PNG or SVG of loop, loading curve and inverse")
@click.option(
    "--settle-within", type=float, metavar="PERCENT",
    help="error within which the output counts as settled, percent of a step  [default: 1]",
)
@click.option("--json", "json_file", type=click.Path(dir_okay=False), help="write the properties as JSON")
@common.effects_option
def show(
    params: str, plot: str | None, settle_within: float | None, json_file: str | None, effects: tuple[str, ...]
) -> None:
    """Print the properties of a model: ranges, slopes, loop width, settling after a step, and whether it is invertible.

    Example: hystgen show stage_x.yaml --plot stage_x.svg
    """
    from hystgen.basics import drawing, writing
    from hystgen.model import SETTLED
    from hystgen.report import properties

    within = SETTLED if settle_within is None else settle_within / 100.0
    if not 0.0 < within < 1.0:
        raise click.BadParameter("give percent of a step, above 0 and below 100", param_hint="'--settle-within'")
    model = common.load_model(params, effects)
    common.keep_inputs([plot, json_file], [params])
    if plot:
        common.guarded(params, partial(drawing.check_path, plot))
    if json_file:
        common.guarded(json_file, partial(writing.check_writable, json_file))
    console.say(common.guarded(params, lambda: properties.properties(model, within)))
    for warning in properties.warnings(model):
        console.note(f"warning: {warning}")
    if json_file:
        facts = common.guarded(params, lambda: properties.facts(model, within))
        text = json.dumps(facts, indent=2, allow_nan=False) + "\n"
        common.guarded(json_file, partial(writing.write_atomically, json_file, text))
        console.say(json_file)
    if plot:
        common.guarded(params, lambda: model.plot(plot))
        console.say(plot)
