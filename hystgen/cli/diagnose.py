"""`hystgen diagnose`: find what a model is missing, and plan the drives that reveal it."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any, Unpack

import click

from hystgen.basics import console
from hystgen.cli import common


def _plan(params: str, output: str, effects: Sequence[str], **options: Any) -> None:
    """Write the drive records that a diagnosis needs; print the files and the command to run after measuring."""
    from hystgen.basics import drawing
    from hystgen.report.plan import plan

    def run() -> None:
        drawing.require()
        planned = plan(params, effects=effects, **options)
        common.keep_inputs([Path(output) / name for name in planned.names], [params, *effects])
        for sentence in planned.defaults:
            console.note(sentence)
        console.note(planned.sentence())
        if planned.dac is not None:
            unit, (top, bottom) = planned.parameters.units.input, planned.history
            console.note(planned.dac.sentence(f" {unit}" if unit else "", top - bottom))
        for path in planned.write(output):
            console.say(str(path))
        if left_over := planned.left_over(output):
            names = ", ".join(map(str, left_over))
            console.note(f"warning: from an earlier plan, with other drives: {names}; remove them, or give another -o")
        console.note(f"then run: {planned.command(output)}")

    common.guarded(params, run)


@click.command(cls=common.Judging, short_help="Name the effects that a model is missing.")
@common.params_argument
@common.data_argument(required=False)
@click.option("-o", "output", type=click.Path(file_okay=False), help="folder for the findings, or the plan")
@click.option(
    "--holdout", multiple=True, type=click.Path(), callback=common.matched,
    help="record to judge by, not used in the fits; or a pattern in quotes, 'held/*.csv'",
)
@click.option("--plan", is_flag=True, help="write the drive records to measure, and a page that explains them")
@click.option("--max-rate", type=float, help="with --plan: fastest change of the drive, input units per second")
@click.option("--rate", type=float, metavar="HZ", help="with --plan: all drives in sequence, at a converter's rate")
@click.option("--dac-bits", type=int, help="with --rate: codes for a DAC with this many bits")
@click.option(
    "--dac-range", metavar="LOW,HIGH", help="drive at the lowest code and one above the highest, after the amplifier"
)
@click.option(
    "--dac-coding", type=click.Choice(["straight", "twos-complement"]), help="format of the codes  [default: straight]"
)
@click.option(
    "--session", type=click.Path(), help="session.json of a plan: DATA is one recording of the whole session"
)
@click.option(
    "--with", "known", multiple=True, metavar="creep,lag", callback=common.words,
    help="effects known to be present: always fitted and written, and judged like any other",
)
@common.effects_option
@common.record_options
@common.skip_option
@common.skew_option
def diagnose(
    params: str, data: tuple[str, ...], output: str | None, holdout: tuple[str, ...], effects: tuple[str, ...],
    plan: bool, max_rate: float | None, rate: float | None, dac_bits: int | None, dac_range: str | None,
    dac_coding: str | None, session: str | None, known: tuple[str, ...], history: str | None, rest: float, skip: float,
    clock_skew: float | str | None,
    **reading: Unpack[common.ReadingArguments],
) -> None:
    """Find what a model is missing: where it disagrees with records, the missing effects, and the model with them.

    Example: hystgen diagnose stage_x.yaml slow.csv steps.csv --holdout other.csv -o diagnosis/

    Example: hystgen diagnose stage_x.yaml slow.csv steps.csv --with creep,lag -o diagnosis/

    Example: hystgen diagnose --plan stage_x.yaml --max-rate 5000 -o plan/

    Example: hystgen diagnose --plan stage_x.yaml --rate 1000 --dac-bits 16 --dac-range 0,150 -o plan/

    Example: hystgen diagnose stage_x.yaml plan/recording.csv --session plan/session.json -o diagnosis/
    """
    if output is None:
        what = "the drives, as in -o plan/" if plan else "the findings, as in -o diagnosis/"
        raise click.UsageError(f"Missing option '-o': give a folder for {what}")
    played: dict[str, Any] = {
        "max_rate": max_rate, "rate": rate, "dac_bits": dac_bits, "dac_range": dac_range, "dac_coding": dac_coding
    }
    if plan:
        unused = {
            "DATA": data, "--holdout": holdout, "--history": history, "--rest": rest, "--skip": skip,
            "--clock-skew": clock_skew, "--session": session, "--with": known, "--columns": reading["columns"],
            "--delimiter": reading["delimiter"],
        }
        given = [option for option, value in unused.items() if value]
        if given:
            raise click.UsageError(
                f"--plan comes before any measurement: leave out {', '.join(given)}, or leave out --plan to "
                "diagnose records"
            )
        if dac_coding is not None and dac_bits is None:
            raise click.UsageError("--dac-coding is for codes; give --dac-bits and --dac-range with it")
        played["sample_time"] = reading["sample_time"]
        asked = {name: value for name, value in played.items() if value is not None}
        if dac_range is not None:
            asked["dac_range"] = common.number_list("--dac-range", dac_range, "0,150")
        _plan(params, output, effects, **asked)
        return
    if not data:
        raise click.UsageError("Missing argument 'DATA...'; --plan writes drive records to measure")
    for option, value in played.items():
        if value is not None:
            raise click.UsageError(f"--{option.replace('_', '-')} is for drives; give --plan with it")
    if session is not None:
        said = [name for name, value in (("--holdout", holdout), ("--history", history), ("--rest", rest)) if value]
        if said or len(data) != 1:
            what = f"leave out {', '.join(said)}, which it contains" if said else f"give one, not {len(data)}"
            raise click.UsageError(f"--session is for one recording of the whole session; {what}")
    from hystgen import diagnosis, records
    from hystgen.basics import drawing, extras, writing
    from hystgen.effects import load_user_effects
    from hystgen.identification.verdict import typed
    from hystgen.planning.session import Session
    from hystgen.report import diagnosis as report

    model = common.load_model(params, effects)
    common.guarded(params, partial(extras.require_fit, "diagnose", plot=True))
    common.guarded(params, drawing.require)
    inputs = (params, *data, *holdout, *([session] if session else []))
    common.keep_inputs([Path(output) / name for name in diagnosis.Diagnosis.FILES], inputs)
    common.guarded(output, partial(writing.check_files, Path(output), diagnosis.Diagnosis.FILES))
    visited = common.history_values(history)
    how: dict[str, Any] = {"holdout": list(holdout), "history": visited, "rest": rest, "skip": skip, "known": known}
    how["clock_skew"] = clock_skew
    read_as = common.reading_options(**reading)

    def run() -> None:
        own = [kind for path in effects for kind in load_user_effects(path)]
        to_fit: Sequence[records.Source] = data
        if session is not None:
            played = Session.read(session)
            read = records.read_records(to_fit, **read_as)
            (recording,) = records.in_units(read, model.parameters.units, sources=to_fit)
            to_fit, held = played.cut(recording)
            how.update(holdout=held, history=played.history, rest=played.rest)
        found = report.diagnose(model, to_fit, effects=own, **how, **read_as)
        for note in (*found.notes, *found.warnings):
            console.note(f"warning: {note}")
        console.say(found.sentence())
        if found.not_emitted():
            console.note(found.not_emitted())
        again = typed(common.repeated())
        named = " ".join(map(shlex.quote, data)) + "".join(f" --holdout {shlex.quote(each)}" for each in holdout)
        judged = " ".join(map(shlex.quote, holdout or data))
        step, command = found.next_step(shlex.quote(str(Path(output) / "params.yaml")), named + again, judged + again)
        console.say(f"Your next step: {step}:\n    {command}\n")
        for path in found.write(output):
            console.say(str(path))

    common.guarded(params, run)
