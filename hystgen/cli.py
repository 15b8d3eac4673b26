"""The command line: parse the words, call one function, print what it returns."""

from __future__ import annotations

import math
import os
import sys
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from hystgen import __version__, console
from hystgen.verification.targets import NAMES as TARGETS

if TYPE_CHECKING:
    from hystgen.api import Model

ARITHMETICS = ("float32", "float64", "q31", "q15")


class _Failed(click.ClickException):
    """A check that failed (exit code 1) or input that cannot be used (2); the message says everything."""

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.exit_code = code  # type: ignore[misc]  # click declares it on the class and reads it on the instance

    def show(self, file: Any = None) -> None:
        """Print the message alone: it already says that it is an error."""
        console.note(self.message, file)


def _shown(path: str, action: Callable[[], Any]) -> Any:
    """Run `action` and turn what it may raise into a message and an exit code."""
    from hystgen.models import NotInvertibleError
    from hystgen.params import ParameterError, located
    from hystgen.problems import PlanError, RecordError, UnsupportedEffectsError
    from hystgen.tables import FormatError

    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", UserWarning)
            result = action()
        for warning in caught:
            console.note(f"warning: {warning.message}")
        return result
    except (ParameterError, PlanError, RecordError) as error:
        raise _Failed(str(error), 2) from None
    except NotInvertibleError as error:
        raise _Failed("\n".join(f"{path}: error: no inverse: {reason}" for reason in error.reasons), 1) from None
    except UnsupportedEffectsError as error:
        raise _Failed(f"{path}: error: {error}", 1) from None
    except FormatError as error:
        raise _Failed(str(located(path, error.problems)), 2) from None
    except BrokenPipeError:  # whoever reads has had enough, which click ends quietly
        raise
    except (ValueError, OSError) as error:
        raise _Failed(f"error: {_reason(error)}", 2) from None


def _reason(error: ValueError | OSError) -> str:
    """What an error says; of the system's own the file and what is wrong with it."""
    if not isinstance(error, OSError) or not error.strerror:
        return str(error)
    return f"{error.filename}: {error.strerror}" if error.filename else error.strerror


def _load(path: str, effects: Sequence[str] = ()) -> Model:
    from hystgen.api import load

    model: Model = _shown(path, lambda: load(path, effects))
    return model


params_argument = click.argument("params", type=click.Path())
operator_option = click.option(
    "--operator", type=click.Choice(["inverse", "forward", "both"]), help="default: the file's"
)
arithmetic_option = click.option("--arithmetic", type=click.Choice(ARITHMETICS), help="default: the file's")
engine_option = click.option("--engine", type=click.Choice(["auto", "corners", "loop"]), help="default: the file's")
optimize_option = click.option(
    "--optimize", type=click.Choice(["auto", "speed", "size"]), help="what engine auto chooses for; default: the file's"
)
effects_option = click.option(
    "--effects", multiple=True, type=click.Path(), metavar="FILE.py", help="effects of your own (user:..); repeatable"
)
layout_option = click.option(
    "--layout", type=click.Choice(["self-contained", "shared-runtime", "single-header"]), default="self-contained",
    show_default=True,
)  # fmt: skip


@click.group(cls=console.Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="hystgen")
def main() -> None:
    """From a measured hysteresis loop to a verified compensator in C."""
    from hystgen import compiled

    compiled.announce = console.note


@main.command()
@click.argument("params", nargs=-1, required=True, type=click.Path())
@click.option("-o", "output", type=click.Path(file_okay=False), default=".", help="folder to write to")
@operator_option
@arithmetic_option
@engine_option
@optimize_option
@layout_option
@click.option("--check", is_flag=True, help="write nothing; exit 1 if what is in the folder differs, and say in what")
@click.option("--list-outputs", is_flag=True, help="write nothing; print the paths")
def emit(params: tuple[str, ...], output: str, check: bool, list_outputs: bool, **options: str | None) -> None:
    """Write the C files of models.

    Example: hystgen emit stage_x.yaml stage_y.yaml -o firmware/ --operator inverse --arithmetic float32
    """
    from hystgen import api
    from hystgen.emission import files

    params = tuple(dict.fromkeys(params))
    models = _each(params, _load)
    _shown(output, lambda: api.check_names(models))
    named = list(zip(params, models, strict=True))
    texts = _each(named, lambda one: _shown(one[0], lambda: api.emitted_files(one[1], **options)))
    made = {name: text for each in texts for name, text in each.items()}
    if check:
        _check(named, output, options)
    elif list_outputs:
        for name in made:
            console.say(str(Path(output) / name))
    else:
        for path in _shown(output, lambda: files.write(Path(output), made)):
            console.say(str(path))


T = TypeVar("T")
U = TypeVar("U")


def _each(items: Sequence[T], action: Callable[[T], U]) -> list[U]:
    """What `action` gives for every item. Raises _Failed with all messages and the higher one of the exit codes."""
    made, failures = [], []
    for item in items:
        try:
            made.append(action(item))
        except _Failed as failure:
            failures.append(failure)
    if failures:
        messages = dict.fromkeys(failure.message for failure in failures)
        raise _Failed("\n".join(messages), max(failure.exit_code for failure in failures))
    return made


def _check(models: Sequence[tuple[str, Model]], output: str, options: Mapping[str, str | None]) -> None:
    """Exit code 1 with the differences of files on disk, and the commands that fit."""
    from dataclasses import asdict

    from hystgen import api
    from hystgen.emission import stale

    problems, advice = [], []
    for path, model in models:
        found = _shown(path, partial(api.stale_files, model, output, **options))
        if not found:
            continue
        given = {key: value for key, value in options.items() if value and (key, value) != ("layout", "self-contained")}
        wanted = asdict(api.emit_options(model, **options))  # type: ignore[arg-type]
        problems += [f"error: {each.sentence()}" for each in found]

        def again(other: Mapping[str, str], model: Model = model, found: Any = found) -> list[stale.Difference]:
            try:
                return api.stale_files(model, output, **other)
            except ValueError:  # no such model any more
                return list(found)

        advice += stale.advice(found, path, output, given, wanted, again)
    if problems:
        raise _Failed("\n".join(dict.fromkeys([*problems, *advice])), 1)


@main.command()
@params_argument
@operator_option
@arithmetic_option
@engine_option
@optimize_option
@layout_option
@click.option("--compiler", multiple=True, help="gcc, clang, zig or another command; default: all found")
@click.option("--targets", default="host", show_default=True, help="comma separated: " + ", ".join(TARGETS))
@click.option("--target-length", type=click.IntRange(min=1), help="calls of a record on emulated cores")
@click.option("--json", "json_file", type=click.Path(dir_okay=False), help="write the report for programs")
@click.option("--junit", "junit_file", type=click.Path(dir_okay=False), help="write the report as JUnit XML")
def verify(
    params: str, compiler: tuple[str, ...], targets: str, json_file: str | None, junit_file: str | None, **options: Any
) -> None:
    """Compile the emitted C, run it and compare it with the Python reference, bit for bit.

    Example: hystgen verify stage_x.yaml --targets host,cortex-m4f
    """
    from hystgen import verification, writing

    chosen = tuple(targets.split(","))
    for word in chosen:
        if word not in TARGETS:
            raise _Failed(f"error: unknown target {word!r}; use {', '.join(TARGETS)}", 2)
    _keep((json_file, junit_file), [params])
    for file in (json_file, junit_file):
        if file:
            _shown(file, partial(writing.check_writable, file))
    model = _load(params)

    def say(what: str) -> None:
        console.note(f"verifying: {what}")

    report = _shown(
        params,
        lambda: verification.verify_model(model, compiler=compiler, targets=chosen, progress=say, **options),
    )
    console.say(report.table())
    for file, text in ((json_file, report.to_json), (junit_file, report.to_junit)):
        if file:
            _shown(file, partial(writing.write_atomically, file, text()))
    if not report.ok:
        raise _Failed("verification failed", 1)


def _plan(params: str, output: str, effects: Sequence[str], max_rate: float | None, sample_time: float | None) -> None:
    """Write the drive records that a diagnosis needs; prints the files and the command to run on the measured ones."""
    from hystgen.diagnosis.plan import plan
    from hystgen.report import drawing

    def run() -> None:
        drawing.require()
        planned = plan(params, effects=effects, max_rate=max_rate, sample_time=sample_time)
        _keep([Path(output) / name for name in planned.names], [params, *effects])
        for sentence in planned.defaults:
            console.note(sentence)
        console.note(planned.sentence())
        for path in planned.write(output):
            console.say(str(path))
        console.note(f"then run: {planned.command(output)}")

    _shown(params, run)


def _keep(outputs: Iterable[str | Path | None], inputs: Iterable[str]) -> None:
    """Refuse to write over what is read."""
    read = {os.path.realpath(path) for path in inputs}
    for path in outputs:
        if path and os.path.realpath(path) in read:
            raise _Failed(f"error: {path} is an input and would be overwritten; choose another name", 2)


def _numbers(text: str | None) -> list[float] | None:
    if text is None:
        return None
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = [math.nan]
    if not all(map(math.isfinite, numbers)):
        raise _Failed(f"error: --history {text!r} is not a list of numbers; write --history 100,-100", 2)
    return numbers


def _seconds(_context: click.Context, _option: click.Parameter, value: float) -> float:
    if not 0 <= value < math.inf:
        raise click.BadParameter("give seconds, 0 or more")
    return value


def _reading(columns: str | None, sample_time: float | None, delimiter: str | None) -> dict[str, Any]:
    from hystgen import records

    mapping = _shown("--columns", lambda: records.parse_columns(columns)) if columns else None
    return {"columns": mapping, "sample_time": sample_time, "delimiter": delimiter, "progress": True}


def _write_record(target: Path, header: list[str], columns: dict[str, Any]) -> None:
    from hystgen import records

    target.parent.mkdir(parents=True, exist_ok=True)
    records.write_columns(target, header, list(columns.values()))


_RECORD_OPTIONS = [
    click.option(
        "--columns",
        metavar="t=Time,v=U,y=Pos",
        help="our names for the file's columns; in HDF5 v=run1/drive, of a MATLAB struct v=data.v; in text also by "
        "their numbers, 1,2,3 for t, v, y",
    ),
    click.option("--sample-time", type=float, help="seconds, for files without time"),
    click.option("--delimiter", help="default: what the file shows"),
    click.option("--history", metavar="V,V,..", help="drive values visited before"),
    click.option(
        "--rest", type=float, callback=_seconds, default=0.0, help="seconds of pause, seen by effects alone"
    ),
]


def record_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """The options of every command that takes records."""
    for option in reversed(_RECORD_OPTIONS):
        command = option(command)
    return command


@main.command()
@params_argument
@click.argument("data", nargs=-1, required=True, type=click.Path())
@click.option("-o", "output", type=click.Path(), help="CSV file, or a folder for several; default: standard output")
@click.option("--operator", type=click.Choice(["forward", "inverse"]), default="forward", show_default=True)
@click.option("--arithmetic", type=click.Choice(ARITHMETICS), help="compute as the emitted C does; default: double")
@click.option("--engine", type=click.Choice(["auto", "corners", "loop"]), help="with --arithmetic")
@effects_option
@record_options
def simulate(
    params: str, data: tuple[str, ...], output: str | None, operator: str, arithmetic: str | None, engine: str | None,
    effects: tuple[str, ...], history: str | None, rest: float, **reading: Any,
) -> None:
    """Run the model (column v) or its inverse (column u) over records; several files are one session.

    Example: hystgen simulate stage_x.yaml drive.csv -o predicted.csv --history 100,-100
    """
    from hystgen import records, simulation

    if len(data) > 1 and output is None:
        raise _Failed("error: several records need -o with a folder", 2)
    if len({Path(path).stem for path in data}) < len(data):
        raise _Failed("error: two records have the same name; their results would overwrite each other", 2)
    model = _load(params, effects)
    visited = _numbers(history)
    how = _reading(**reading)
    column, answer = ("v", "y") if operator == "forward" else ("u", "v")
    read = _shown(params, partial(records.read_records, data, need=(column,), **how))
    for record in read:
        if {answer, f"{answer}_measured"} <= record.columns().keys():
            raise _Failed(f"error: {record.name} has both {answer} and {answer}_measured; rename one with --columns", 2)
        for note in record.notes:
            console.note(f"warning: {record.name}: {note}")
    targets: list[Path | None] = [Path(output) if output else None] * len(data)
    if output and (len(data) > 1 or Path(output).is_dir() or output.endswith(("/", os.sep))):
        targets = [Path(output) / f"{Path(path).stem}.csv" for path in data]
    _keep(targets, [params, *data])
    simulated = _shown(
        params,
        lambda: simulation.simulate_records(model, read, operator, arithmetic, engine, visited or (), rest),
    )
    for record, target, (answers, remarks) in zip(read, targets, simulated, strict=True):
        columns = record.columns()
        for sentence in remarks:
            console.note(f"warning: {sentence}")
        units = dict(record.units)
        if answer in columns:
            columns[f"{answer}_measured"] = columns.pop(answer)
            units[f"{answer}_measured"] = units.pop(answer, "")
        columns[answer] = answers
        header = records.headers(columns, units)
        if target is None:
            console.say(records.columns_text(header, list(columns.values())).encode())  # data: always UTF-8
            continue
        _shown(str(target), partial(_write_record, target, header, columns))
        console.say(str(target))


@main.command()
@click.argument("data", nargs=-1, type=click.Path())
@click.option("-o", "output", required=True, type=click.Path(), help="parameter file to write; with --batch a folder")
@click.option("--batch", multiple=True, metavar="PATTERN", help="'units/*.csv', a file or a folder: one unit a file")
@click.option("--emit/--no-emit", default=None, help="with --batch: write the C of every unit too  [default: emit]")
@click.option("--jobs", type=click.IntRange(min=1), help="with --batch: processes; default: all cores")
@click.option("--scheduler", metavar="ADDRESS", help="with --batch: Dask scheduler, as in tcp://host:8786")
@click.option("--model", type=click.Choice(["pi", "gpi-deadzone", "gpi-tanh", "auto"]), default="pi", show_default=True)
@click.option("--thresholds", type=int, help="number of plays without r_0; default: chosen on held-out error")
@click.option("--breaks", type=int, help="number of breaks of a dead-zone sum; default: chosen on held-out error")
@click.option(
    "--holdout", multiple=True, type=click.Path(),
    help="record that takes no part in the fit; with --batch for example 'holdout/{unit}.csv'",
)  # fmt: skip
@click.option("--skip", type=int, default=0, help="samples at the start of every record that are not compared")
@click.option("--loading-curve", is_flag=True, help="the records are initial loading curves, from 0 up")
@click.option("--name", help="C identifier of the model; default: from the output file")
@click.option("--units", metavar="V,um", help="units of drive and output; default: the records'")
@click.option("--plot", type=click.Path(dir_okay=False), help="PNG or SVG of the fit")
@click.option("--report", type=click.Path(file_okay=False), help="folder for report.html and its pictures")
@record_options
def identify(
    data: tuple[str, ...], output: str, model: str, thresholds: int | None, breaks: int | None,
    holdout: tuple[str, ...], skip: int, loading_curve: bool, name: str | None, units: str | None, plot: str | None,
    report: str | None, history: str | None, rest: float, batch: tuple[str, ...], emit: bool | None, jobs: int | None,
    scheduler: str | None, **reading: Any,
) -> None:
    """Fit a model to measured records and write its parameter file; with --batch, many units and their C.

    Example: hystgen identify sweep.csv --holdout other.csv -o stage_x.yaml --units V,um

    Example: hystgen identify --batch 'units/*.csv' -o params/
    """
    from hystgen import identification, writing
    from hystgen.report import identification as pages

    drive, _, displacement = (units or "").partition(",")
    how = _reading(**reading)
    options: dict[str, Any] = {
        "model": model,
        "thresholds": thresholds,
        "breaks": breaks,
        "history": _numbers(history),
        "rest": rest,
        "units": {"input": drive.strip(), "output": displacement.strip()} if units else None,
        "skip": skip,
        "loading_curve": loading_curve,
    }
    only_batch: dict[str, Any] = {"--emit": emit, "--jobs": jobs, "--scheduler": scheduler}
    if batch:
        for option, value in (("--name", name), ("--plot", plot), ("--report", report)):
            if value is not None:
                raise click.UsageError(f"{option} is for one model; leave it out with --batch")
        # An unquoted pattern comes expanded by the shell: its first file with the option, the rest as arguments
        _identify_batch(
            (*batch, *data), output, holdout=holdout, emit=emit is not False, jobs=jobs, scheduler=scheduler,
            **options, **how,
        )  # fmt: skip
        return
    for option, given in only_batch.items():
        if given is not None:
            raise click.UsageError(f"{option} is for many units; give --batch with it")
    if not data:
        raise click.UsageError("Missing argument 'DATA...'.")
    if Path(output).is_dir():
        raise click.BadParameter(f"File '{output}' is a directory.", param_hint="'-o'")
    made = [str(Path(report) / name) for name in pages.names()] if report else []
    _keep((output, plot, *made), (*data, *holdout))

    def run() -> None:
        from hystgen import records
        from hystgen.emission import files
        from hystgen.identification import settings
        from hystgen.report import plots

        for file in (output, plot):
            if file:
                writing.check_writable(file)
        if plot:
            plots.check_path(plot)
        if report:
            pages.check_folder(report)
            files.check(Path(report), pages.names())
        older = settings.of(output)
        read = records.read_records([*data, *holdout], **how)
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
        console.say(output)
        if plot:
            plots.show_fit(fit, read, plot)
            console.say(plot)
        if report:
            console.say(str(pages.write(fit, read, report, Path(output).name)))

    _shown(data[0], run)


def _identify_batch(sources: tuple[str, ...], output: str, **options: Any) -> None:
    """Print what became of a fleet; exit code 1 if a unit failed, 130 if the user stopped it."""
    from hystgen.identification import fleet

    try:
        done = _shown(output, partial(fleet.identify_batch, sources, output, **options))
    except KeyboardInterrupt:
        raise _Failed("interrupted; what is done is kept, and the same command goes on from there", 130) from None
    console.note(done.table().rstrip("\n"))
    console.say(str(Path(output) / "summary.csv"))
    if done.failed:
        raise _Failed(f"error: {len(done.failed)} of {len(done.units)} units failed", 1)


@main.command()
@params_argument
@click.argument("data", nargs=-1, type=click.Path())
@click.option("-o", "output", type=click.Path(file_okay=False), help="folder for what is found, or planned")
@click.option("--holdout", multiple=True, type=click.Path(), help="record that judges and takes no part in the fits")
@click.option("--plan", is_flag=True, help="write the drive records to measure, and a page that explains them")
@click.option("--max-rate", type=float, help="with --plan: fastest change of the drive, input units per second")
@effects_option
@record_options
def diagnose(
    params: str, data: tuple[str, ...], output: str | None, holdout: tuple[str, ...], effects: tuple[str, ...],
    plan: bool, max_rate: float | None, history: str | None, rest: float, **reading: Any,
) -> None:
    """Find what a model is missing: where it disagrees with records, the missing effect, the model with it added.

    Example: hystgen diagnose stage_x.yaml slow.csv steps.csv --holdout other.csv -o diagnosis/

    Example: hystgen diagnose --plan stage_x.yaml --max-rate 5000 -o plan/
    """
    if output is None:
        what = "the drives, as in -o plan/" if plan else "what is found, as in -o diagnosis/"
        raise click.UsageError(f"Missing option '-o': give a folder for {what}")
    if plan:
        unused = {"DATA": data, "--holdout": holdout, "--history": history, "--rest": rest}
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
    from hystgen import api, diagnosis
    from hystgen.effects import load_user_effects
    from hystgen.emission import files
    from hystgen.report import drawing

    model = _load(params, effects)
    _shown(params, drawing.require)
    _keep([Path(output) / name for name in diagnosis.Diagnosis.FILES], (params, *data, *holdout))
    _shown(output, partial(files.check, Path(output), diagnosis.Diagnosis.FILES))
    visited = _numbers(history)
    how = _reading(**reading)

    def run() -> None:
        own = [kind for path in effects for kind in load_user_effects(path)]
        found = api.diagnose(
            model, list(data), holdout=list(holdout), history=visited, rest=rest, effects=own, **how
        )
        for note in (*found.notes, *found.warnings):
            console.note(f"warning: {note}")
        console.say(found.sentence())
        if found.not_emitted():
            console.note(found.not_emitted())
        for path in found.write(output):
            console.say(str(path))

    _shown(params, run)


@main.command()
@params_argument
@click.option("--plot", type=click.Path(dir_okay=False), help="PNG or SVG of loop, loading curve and inverse")
@effects_option
def show(params: str, plot: str | None, effects: tuple[str, ...]) -> None:
    """Print what a model can do: ranges, slopes, loop width, invertible or why not.

    Example: hystgen show stage_x.yaml --plot stage_x.svg
    """
    from hystgen.report import plots, properties

    model = _load(params, effects)
    if plot:
        _keep([plot], [params])
        _shown(params, partial(plots.check_path, plot))
    console.say(_shown(params, lambda: properties.properties(model)))
    for warning in properties.warnings(model):
        console.note(f"warning: {warning}")
    if plot:
        _shown(params, lambda: plots.show_model(model, plot))
        console.say(plot)


@main.command()
def schema() -> None:
    """Print the JSON Schema of the parameter file.

    Example: hystgen schema > hystgen.schema.json
    """
    import json

    from hystgen import params

    console.say(json.dumps(params.schema(), indent=2))


if __name__ == "__main__":
    sys.exit(main())
