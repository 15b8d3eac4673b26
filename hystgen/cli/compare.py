"""`hystgen compare`: models side by side on records."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Unpack

import click

from hystgen.basics import console
from hystgen.cli import common

if TYPE_CHECKING:
    from hystgen.model import Model


PARAMETER_FILES = (".yaml", ".yml")


class _Holding(click.Command):
    """A command whose `--holdout` also takes the further files to which a shell expands a pattern, as in `held/*.csv`.

    A file among them that ends in .yaml or .yml stays a parameter file.
    """

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the arguments."""
        words: list[str] = []
        value = holding = False
        for word in args:
            if value:  # the value of --holdout
                value = False
            elif word.startswith("-"):
                value = holding = word == "--holdout"
            elif holding and Path(word).suffix.lower() not in PARAMETER_FILES:
                words.append("--holdout")
            words.append(word)
        return super().parse_args(ctx, words)


@click.command(cls=_Holding, short_help="Show models side by side on records.")
@click.argument("params", nargs=-1, required=True, type=click.Path())
@click.option(
    "--holdout", multiple=True, type=click.Path(), callback=common.matched,
    help="record to compare on, preferably one that no model was fitted to; or a pattern in quotes, 'held/*.csv'; "
    "repeatable",
)
@click.option("-o", "output", type=click.Path(file_okay=False), help="folder for a page, its picture and the JSON")
@click.option("--plot", type=click.Path(dir_okay=False), help="PNG or SVG of the deviations, on one scale")
@click.option("--json", "json_file", type=click.Path(dir_okay=False), help="write the comparison as JSON")
@common.effects_option
@common.record_options
@common.skip_option
def compare(
    params: tuple[str, ...], holdout: tuple[str, ...], output: str | None, plot: str | None, json_file: str | None,
    effects: tuple[str, ...], history: str | None, rest: float, skip: float,
    join: tuple[tuple[str, str], ...], **reading: Unpack[common.ReadingArguments],
) -> None:
    """Show models side by side on records: how far each is from the measured motion, and which is the closest.

    A straight line comes first, as the baseline. Says which models the records cannot tell apart.

    Example: hystgen compare plain.yaml diagnosis/params.yaml --holdout other.csv -o comparison/
    """
    from hystgen.basics import drawing, extras, writing

    holdout = (*holdout, *common.joined(join))
    if not holdout:
        files = [path for path in params if Path(path).suffix.lower() not in PARAMETER_FILES]
        example = f", as in --holdout {files[0] if files else 'other.csv'}"
        raise click.UsageError(f"Missing option '--holdout': give the records to compare on{example}")
    common.guarded(params[0], partial(extras.require_fit, "compare", plot=bool(plot or output)))
    from hystgen.comparison import Comparison
    from hystgen.report import comparison as report

    inside = [Path(output) / name for name in Comparison.FILES] if output else []
    common.keep_inputs([plot, json_file, *inside], [*params, *holdout])
    if json_file:
        common.guarded(json_file, partial(writing.check_writable, json_file))
    if plot:
        common.guarded(plot, partial(drawing.check_path, plot))
    if output:
        common.guarded(output, drawing.require)
        common.guarded(output, partial(writing.check_files, Path(output), Comparison.FILES))
    files = list(dict.fromkeys(params))
    models: list[Model] = common.for_each(files, partial(common.load_model, effects=effects))
    visited = common.history_values(history)
    how = common.reading_options(**reading)
    compared = partial(report.compare, models, holdout, names=files, history=visited, rest=rest, skip=skip, **how)
    found = common.guarded(params[0], compared)
    for note in found.notes:
        console.note(f"warning: {note}")
    console.say(found.table())
    step, command = found.next_step()
    if step:
        console.say(f"Your next step: {step}:\n    {command}\n")
    if json_file:
        common.guarded(json_file, partial(writing.write_atomically, json_file, found.to_json()))
        console.say(json_file)
    if plot:
        common.guarded(plot, lambda: found.plot(plot))
        console.say(plot)
    if output:
        for path in common.guarded(output, lambda: found.write(output)):
            console.say(str(path))
