"""`hystgen identify`: models from measured records."""

from __future__ import annotations

import os
from functools import partial
from pathlib import Path
from typing import Any, Unpack

import click

from hystgen.basics import console
from hystgen.basics.problems import capital, counted
from hystgen.cli import common


def _units(_context: click.Context, _option: click.Parameter, value: str | None) -> dict[str, str] | None:
    if value is None:
        return None
    units = [unit.strip() for unit in value.split(",")]
    if len(units) != 2 or not any(units):
        raise click.BadParameter(f"'{value}' is not two units; give those of the drive and the output, V,um")
    return dict(zip(("input", "output"), units, strict=True))


@click.command(cls=common.Judging, short_help="Fit a model to measured records.")
@common.data_argument(required=False)
@click.option("-o", "output", required=True, type=click.Path(), help="parameter file to write; with --batch a folder")
@click.option("--batch", multiple=True, metavar="PATTERN", help="'units/*.csv', a file or a folder: one unit per file")
@click.option("--emit/--no-emit", default=None, help="with --batch: write the C of every unit too  [default: emit]")
@click.option("--jobs", type=click.IntRange(min=1), help="with --batch: processes; default: all cores")
@click.option("--scheduler", metavar="ADDRESS", help="with --batch: Dask scheduler, as in tcp://host:8786")
@click.option("--model", type=click.Choice(["pi", "gpi-deadzone", "gpi-tanh", "auto"]), default="pi", show_default=True)
@click.option("--thresholds", type=int, help="number of plays without r_0; default: chosen on held-out error")
@click.option("--breaks", type=int, help="number of breaks of a dead-zone sum; default: chosen on held-out error")
@click.option(
    "--holdout", multiple=True, type=click.Path(), callback=common.matched,
    help="record not used in the fit; or a pattern in quotes, 'held/*.csv'; with --batch for example "
    "'holdout/{unit}.csv'",
)
@common.skip_option
@common.skew_option
@click.option("--loading-curve", is_flag=True, help="the records are initial loading curves, rising from 0")
@click.option("--name", help="C identifier of the model; default: from the output file")
@click.option(
    "--units", metavar="V,um", callback=_units,
    help="units of drive and output, to which records are converted; default: the records'",
)
@click.option("--strict", is_flag=True, help="exit with 1 if the figures show that the model is of no use")
@click.option("--plot", type=click.Path(dir_okay=False), help="PNG or SVG of the fit")
@click.option("--report", type=click.Path(file_okay=False), help="folder for report.html and its pictures")
@common.record_options
def identify(
    data: tuple[str, ...], output: str, model: str, thresholds: int | None, breaks: int | None,
    holdout: tuple[str, ...], skip: float, clock_skew: float | str | None, loading_curve: bool, name: str | None,
    units: dict[str, str] | None, strict: bool, plot: str | None, report: str | None, history: str | None, rest: float,
    batch: tuple[str, ...], emit: bool | None, jobs: int | None, scheduler: str | None,
    **reading: Unpack[common.ReadingArguments],
) -> None:
    """Fit a model to measured records and write its parameter file; with --batch, many units and their C.

    Example: hystgen identify sweep.csv --holdout other.csv -o stage_x.yaml --units V,um

    Example: hystgen identify --batch 'units/*.csv' -o params/ --report report/
    """
    from hystgen import identification
    from hystgen.basics import extras, writing
    from hystgen.report import identification as pages

    how = common.reading_options(**reading)
    options: dict[str, Any] = {
        "model": model,
        "thresholds": thresholds,
        "breaks": breaks,
        "history": common.history_values(history),
        "rest": rest,
        "units": units,
        "skip": skip,
        "clock_skew": clock_skew,
        "loading_curve": loading_curve,
    }
    only_batch: dict[str, object] = {"--emit": emit, "--jobs": jobs, "--scheduler": scheduler}
    if batch:
        for option, value in (("--name", name), ("--plot", plot)):
            if value is not None:
                raise click.UsageError(f"{option} is for one model; leave it out with --batch")
        # The shell expands an unquoted pattern: its first file goes to the option, the rest become arguments
        _identify_batch(
            (*batch, *data), output, report, holdout=holdout, emit=emit is not False, jobs=jobs, scheduler=scheduler,
            strict=strict, **options, **how,
        )
        return
    for option, given in only_batch.items():
        if given is not None:
            raise click.UsageError(f"{option} is for many units; give --batch with it")
    if not data:
        raise click.UsageError("Missing argument 'DATA...'.")
    if Path(output).is_dir() or output.endswith(("/", os.sep)):
        inside = Path(output) / "stage_x.yaml"
        raise click.BadParameter(f"'{output}' is a folder; give the file to write, as in {inside}", param_hint="'-o'")
    made = [str(Path(report) / name) for name in pages.names()] if report else []
    common.keep_inputs((output, plot, *made), (*data, *holdout))

    def run() -> None:
        from hystgen import records
        from hystgen.basics import drawing
        from hystgen.identification import settings
        from hystgen.report import plots

        extras.require_fit("identify", plot=bool(plot or report))  # before anything is read
        for file in (output, plot):
            if file:
                writing.check_writable(file)
        if plot:
            drawing.check_path(plot)
        if report:
            pages.check_folder(report)
            writing.check_files(Path(report), pages.names())
        older = settings.of(output)
        read = records.read_records([*data, *holdout], points=True, **how)
        before = (older.file, older.units)
        read = records.in_units(read, file=before, named=("--units", units), sources=[*data, *holdout])
        fit = identification.identify(
            read[: len(data)],
            holdout=read[len(data) :],
            name=name or older.name or identification.identifier_from(Path(output).stem),
            progress=True,
            **options,
        )
        for warning in fit.warnings:
            console.note(f"warning: {warning}")
        for sentence in older.sentences(fit):
            console.note(sentence)
        fit = older.on(fit)
        fit.write(output)
        console.say(fit.table())
        step, command = fit.verdict.next_step(output, data, holdout, options=common.repeated())
        console.say(f"{capital(fit.verdict.why)}. Your next step: {step}:\n    {command}\n")
        console.say(output)
        if plot:
            drawing.picture(lambda: plots.fit_figure(fit, fit.records), plot)
            console.say(plot)
        if report:
            console.say(str(pages.write(fit, fit.records, report, Path(output).name)))
        if strict and fit.verdict.useless:
            raise common.Failed(f"error: {data[0]}: the model is of no use: {fit.verdict.why}", 1)

    common.guarded(data[0], run)


def _identify_batch(sources: tuple[str, ...], output: str, report: str | None, **options: Any) -> None:
    """Print the result of a fleet; exit code 1 if a unit failed, 130 if the user stopped it."""
    from hystgen.basics import writing
    from hystgen.fleet import batch as fleet
    from hystgen.report import fleet as pages
    from hystgen.report.identification import check_folder

    if report:
        common.guarded(report, partial(check_folder, report))
        common.guarded(report, partial(writing.check_files, Path(report), pages.FILES))
    try:
        done = common.guarded(output, partial(fleet.identify_batch, sources, output, **options))
    except KeyboardInterrupt:
        said = "interrupted; finished units are kept, and the same command resumes from there"
        raise common.Failed(said, 130) from None
    console.note(done.table().rstrip("\n"))
    console.say(str(Path(output) / "summary.csv"))
    if report:
        console.say(str(common.guarded(report, lambda: pages.report_fleet(done, report))))
    if done.failed:
        raise common.Failed(f"error: {len(done.failed)} of {counted(len(done.units), 'unit')} failed", 1)
