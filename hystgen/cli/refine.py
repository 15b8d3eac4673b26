"""`hystgen refine`: learning from the recorded tracking of a repeated reference."""

from __future__ import annotations

from functools import partial
from typing import Unpack

import click

from hystgen.basics import console
from hystgen.cli import common


@click.command(short_help="Learn from the tracking of a repeated reference.")
@common.params_argument
@common.data_argument(required=True)
@click.option("-o", "output", type=click.Path(dir_okay=False), metavar="NEW.yaml", help="write the improved model")
@click.option(
    "--reference", type=click.Path(), metavar="REF.csv",
    help="the wanted motion, column u, if the records were made with corrections of it",
)
@click.option(
    "--correction", type=click.Path(dir_okay=False), metavar="OUT.csv",
    help="write the corrected reference of the next pass",
)
@click.option("--json", "json_file", type=click.Path(dir_okay=False), help="write the judgement as JSON")
@common.effects_option
@common.record_options
@common.quiet_option
def refine(
    params: str, data: tuple[str, ...], output: str | None, reference: str | None, correction: str | None,
    json_file: str | None, effects: tuple[str, ...], history: str | None, rest: float, quiet: bool,
    **reading: Unpack[common.ReadingArguments],
) -> None:
    """Improve the model, or correct the reference, from what a repeated scan left.

    DATA are records of one repetition each, in order: the reference u that the compensator was given, the drive v and
    the measured displacement y. The last reference has to be recorded at least twice.

    Example: hystgen refine stage_x.yaml pass_1a.csv pass_1b.csv -o stage_x_new.yaml --correction pass_2.csv

    Example: hystgen refine stage_x.yaml pass_1?.csv pass_2?.csv --reference scan.csv --correction pass_3.csv
    """
    from hystgen.basics import extras, writing
    from hystgen.service import learning

    model = common.load_model(params, effects)
    common.guarded(params, partial(extras.require_fit, "refine"))
    outputs = [output, correction, json_file]
    common.keep_inputs(outputs, [params, *data, *filter(None, [reference])])
    for path in filter(None, outputs):
        common.guarded(path, partial(writing.check_writable, path))
    how, visited = common.reading_options(**reading), common.history_values(history)
    refit = bool(output) or not correction
    found = common.guarded(
        data[0],
        lambda: learning.refine(
            model, data, reference=reference, history=visited, rest=rest, refit=refit, **how
        ),
    )
    if not quiet:
        console.say(found.table())
    texts: dict[str | None, str] = {json_file: found.to_json()}
    if output and found.refined is not None:
        texts[output] = found.refined.text()
    elif output:
        console.note(f"{output}: not written, the model is {found.report.model.why}")
    if correction and found.reference is not None:
        texts[correction] = found.correction_text()
    elif correction:
        why = "the improved model comes first" if found.refined else "a further pass would be of no use"
        console.note(f"{correction}: not written, {why}")
    for file, text in texts.items():
        if file:
            common.guarded(file, partial(writing.write_atomically, file, text))
            if not quiet:
                console.say(file)
