"""`hystgen diagnose`: what a model is missing, and the drives that show it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import click

from hystgen.basics import console
from hystgen.cli.common import (
    Judging,
    data_argument,
    effects_option,
    guarded,
    history_values,
    keep_inputs,
    load_model,
    matched,
    params_argument,
    reading_options,
    record_options,
    skip_option,
)


def _plan(params: str, output: str, effects: Sequence[str], max_rate: float | None, sample_time: float | None) -> None:
    """Write the drive records that a diagnosis needs; prints the files and the command to run on the measured ones."""
    from hystgen.basics import drawing
    from hystgen.report.plan import plan

    def run() -> None:
        drawing.require()
        planned = plan(params, effects=effects, max_rate=max_rate, sample_time=sample_time)
        keep_inputs([Path(output) / name for name in planned.names], [params, *effects])
        for sentence in planned.defaults:
            console.note(sentence)
        console.note(planned.sentence())
        for path in planned.write(output):
            console.say(str(path))
        console.note(f"then run: {planned.command(output)}")

    guarded(params, run)


@click.command(cls=Judging)
@params_argument
@data_argument(required=False)
@click.option("-o", "output", type=click.Path(file_okay=False), help="folder for what is found, or planned")
@click.option(
    "--holdout", multiple=True, type=click.Path(), callback=matched,
    help="record that judges and takes no part in the fits; or a pattern in quotes, 'held/*.csv'",
)  # fmt: skip
@click.option("--plan", is_flag=True, help="write the drive records to measure, and a page that explains them")
@click.option("--max-rate", type=float, help="with --plan: fastest change of the drive, input units per second")
@effects_option
@record_options
@skip_option
def diagnose(
    params: str, data: tuple[str, ...], output: str | None, holdout: tuple[str, ...], effects: tuple[str, ...],
    plan: bool, max_rate: float | None, history: str | None, rest: float, skip: float, **reading: Any,
) -> None:
    """Find what a model is missing: where it disagrees with records, the missing effect, the model with it added.

    Example: hystgen diagnose stage_x.yaml slow.csv steps.csv --holdout other.csv -o diagnosis/

    Example: hystgen diagnose --plan stage_x.yaml --max-rate 5000 -o plan/
    """
    if output is None:
        what = "the drives, as in -o plan/" if plan else "what is found, as in -o diagnosis/"
        raise click.UsageError(f"Missing option '-o': give a folder for {what}")
    if plan:
        unused = {"DATA": data, "--holdout": holdout, "--history": history, "--rest": rest, "--skip": skip}
        unused |= {f"--{option}": reading[option] for option in ("columns", "delimiter")}
        given = [option for option, value in unused.items() if value]
        if given:
            raise click.UsageError(
                f"--plan comes before anything is measured: leave out {', '.join(given)}, or leave out --plan to "
                "diagnose records"
            )
        _plan(params, output, effects, max_rate, reading["sample_time"])
        return
    if not data:
        raise click.UsageError("Missing argument 'DATA...'; --plan writes drive records to measure")
    if max_rate is not None:
        raise click.UsageError("--max-rate is for drives; give --plan with it")
    from hystgen import diagnosis
    from hystgen.basics import drawing, extras, writing
    from hystgen.effects import load_user_effects
    from hystgen.report import diagnosis as report

    model = load_model(params, effects)
    guarded(params, partial(extras.require_fit, "diagnose", plot=True))
    guarded(params, drawing.require)
    keep_inputs([Path(output) / name for name in diagnosis.Diagnosis.FILES], (params, *data, *holdout))
    guarded(output, partial(writing.check_files, Path(output), diagnosis.Diagnosis.FILES))
    visited = history_values(history)
    how = reading_options(**reading)

    def run() -> None:
        own = [kind for path in effects for kind in load_user_effects(path)]
        found = report.diagnose(
            model, list(data), holdout=list(holdout), history=visited, rest=rest, skip=skip, effects=own, **how
        )
        for note in (*found.notes, *found.warnings):
            console.note(f"warning: {note}")
        console.say(found.sentence())
        if found.not_emitted():
            console.note(found.not_emitted())
        for path in found.write(output):
            console.say(str(path))

    guarded(params, run)
