"""`hystgen show`: what a model can do."""

from __future__ import annotations

from functools import partial

import click

from hystgen.basics import console
from hystgen.cli.common import effects_option, guarded, keep_inputs, load_model, params_argument


@click.command()
@params_argument
@click.option("--plot", type=click.Path(dir_okay=False), help="PNG or SVG of loop, loading curve and inverse")
@effects_option
def show(params: str, plot: str | None, effects: tuple[str, ...]) -> None:
    """Print what a model can do: ranges, slopes, loop width, invertible or why not.

    Example: hystgen show stage_x.yaml --plot stage_x.svg
    """
    from hystgen.basics import drawing
    from hystgen.report import properties

    model = load_model(params, effects)
    if plot:
        keep_inputs([plot], [params])
        guarded(params, partial(drawing.check_path, plot))
    console.say(guarded(params, lambda: properties.properties(model)))
    for warning in properties.warnings(model):
        console.note(f"warning: {warning}")
    if plot:
        guarded(params, lambda: model.plot(plot))
        console.say(plot)
