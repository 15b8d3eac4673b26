"""Code shared by the commands: arguments, options, and errors as messages with an exit code."""

from __future__ import annotations

import errno
import functools
import glob
import itertools
import math
import os
import warnings
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import IO, TYPE_CHECKING, TypedDict, TypeVar, Unpack

import click
from click.core import ParameterSource

from hystgen.arithmetic import ARITHMETICS
from hystgen.basics import console

if TYPE_CHECKING:
    from hystgen.model import Model


T = TypeVar("T")
U = TypeVar("U")

ADVICE = {
    errno.ENOENT: "give a path that exists",
    errno.EACCES: "change its permissions, or give another path",
    errno.EPERM: "change its permissions, or give another path",
    errno.EROFS: "give a writable path",
    errno.ENOSPC: "free some space, or give another path",
    errno.EISDIR: "give the path of a file",
    errno.ENOTDIR: "give the path of a folder",
    errno.EEXIST: "give another path",
}
"""Advice for operating system errors."""


class Failed(click.ClickException):
    """A failed check (exit code 1) or unusable input (2); only the message is shown."""

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.exit_code = code  # type: ignore[misc]  # click declares it on the class and reads it on the instance

    def show(self, file: IO[str] | None = None) -> None:
        """Print the message without the prefix that click adds to it."""
        console.note(self.message, file)


def guarded(path: str, action: Callable[[], T]) -> T:
    """Run `action` and turn the errors it may raise into a message and an exit code."""
    from hystgen.basics.extras import MissingExtraError
    from hystgen.basics.problems import (
        FormatError,
        NotInvertibleError,
        ParameterError,
        PlanError,
        RecordError,
        UnsupportedEffectsError,
    )
    from hystgen.parameters.files import located

    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", UserWarning)
            result = action()
        for warning in caught:
            console.note(f"warning: {warning.message}")
        return result
    except (ParameterError, PlanError, RecordError) as error:
        raise Failed(str(error), 2) from None
    except NotInvertibleError as error:
        raise Failed("\n".join(f"{path}: error: no inverse: {reason}" for reason in error.reasons), 1) from None
    except UnsupportedEffectsError as error:
        raise Failed(f"{path}: error: {error}", 1) from None
    except FormatError as error:
        raise Failed(str(located(path, error.problems)), 2) from None
    except BrokenPipeError:  # the reader closed the pipe; click handles that quietly
        raise
    except (ValueError, OSError, MissingExtraError) as error:
        raise Failed(f"error: {_reason(error)}", 2) from None


def compiled(path: str, action: Callable[[], T]) -> T:
    """`guarded`, for an action that starts a compiler: one that is missing or fails is exit code 2 as well."""
    from hystgen.verification.compilers import CompileError

    try:
        return guarded(path, action)
    except CompileError as error:
        raise Failed(f"error: {error}", 2) from None


def _reason(error: Exception) -> str:
    """The text of an error; for operating system errors the file, the reason and advice."""
    if not isinstance(error, OSError) or not error.strerror:
        return str(error)
    said = f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    number = error.errno or 0
    if number in ADVICE and error.strerror == os.strerror(number):  # messages of this package bring their own advice
        return f"{said}; {ADVICE[number]}"
    return said


def load_model(path: str, effects: Sequence[str] = ()) -> Model:
    from hystgen.model import load

    return guarded(path, lambda: load(path, effects))


class Seconds(click.ParamType[float]):
    """A number of seconds."""

    name = "seconds"

    def convert(self, value: str | float, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """The number; a failure if it is none, as with a unit behind it."""
        try:
            return float(value)
        except ValueError:
            self.fail(f"'{value}' is not a number; give seconds, without a unit, as in 0.005", param, ctx)


def seconds(_context: click.Context, _option: click.Parameter, value: float) -> float:
    if not 0 <= value < math.inf:
        raise click.BadParameter("give seconds, 0 or more")
    return value


def matched(_context: click.Context, _option: click.Parameter, value: tuple[str, ...]) -> tuple[str, ...]:
    """The files that match patterns such as 'held/*.csv', sorted by name; all other paths unchanged."""
    found: list[str] = []
    for path in value:
        there = os.path.lexists(path)
        matching = [path] if there or not glob.has_magic(path) else sorted(glob.glob(path))
        if not matching:
            raise Failed(f"error: no file matches {path}; correct the pattern, or the folder it is used in", 2)
        found += matching
    return tuple(found)


def words(_context: click.Context, _option: click.Parameter, value: tuple[str, ...]) -> tuple[str, ...]:
    """The words of an option that takes several, separated by commas, given repeatedly, or both."""
    return tuple(word.strip() for each in value for word in each.split(","))


params_argument = click.argument("params", type=click.Path())
several_params_argument = click.argument("params", nargs=-1, required=True, type=click.Path(), callback=matched)
quiet_option = click.option("-q", "--quiet", is_flag=True, help="print nothing but warnings and errors")
operator_option = click.option(
    "--operator", type=click.Choice(["inverse", "forward", "both"]), help="default: the file's"
)
arithmetic_option = click.option("--arithmetic", type=click.Choice(list(ARITHMETICS)), help="default: the file's")
engine_option = click.option("--engine", type=click.Choice(["auto", "corners", "loop"]), help="default: the file's")
optimize_option = click.option(
    "--optimize", type=click.Choice(["auto", "speed", "size"]), help="goal of engine auto; default: the file's"
)
effects_option = click.option(
    "--effects", multiple=True, type=click.Path(), metavar="FOLDER",
    help="effects of your own (user:..): a folder with model.py, or a Python file; repeatable",
)
partial_option = click.option(
    "--allow-partial", is_flag=True, help="leave out effects that the C cannot include; its banner names them"
)
health_option = click.option(
    "--health", is_flag=True, help="add a watch over the model's error: mean, mean square and a status bit"
)
layout_option = click.option(
    "--layout", type=click.Choice(["self-contained", "shared-runtime", "single-header"]), default="self-contained",
    show_default=True,
)
tables_option = click.option(
    "--tables", type=click.Choice(["constant", "runtime"]), default="constant", show_default=True,
    help="runtime: the C loads a unit's numbers from a block (hystgen blob)",
)
skip_option = click.option(
    "--skip", type=Seconds(), callback=seconds, default=0.0,
    help="seconds at the start of every record to leave out of the comparison; their drive still counts",
)
def _skew(_context: click.Context, _option: click.Parameter, value: str | None) -> float | str | None:
    if value is None or value == "auto":
        return value
    try:
        return float(value)
    except ValueError:
        raise click.BadParameter(f"'{value}' is neither a number of ppm nor auto") from None


skew_option = click.option(
    "--clock-skew", metavar="PPM|auto", callback=_skew,
    help="remove a delay of y after v that grows by this many us per s, as when drive and sensor run on separate "
    "clocks; auto: as estimated",
)


def for_each(items: Sequence[T], action: Callable[[T], U]) -> list[U]:
    """The results of `action` for all items. Raises Failed with all messages and the highest of the exit codes."""
    made, failures = [], []
    for item in items:
        try:
            made.append(action(item))
        except Failed as failure:
            failures.append(failure)
    if failures:
        messages = dict.fromkeys(failure.message for failure in failures)
        raise Failed("\n".join(messages), max(failure.exit_code for failure in failures))
    return made


def keep_inputs(outputs: Iterable[str | Path | None], inputs: Iterable[str]) -> None:
    """Refuse to overwrite inputs."""
    from hystgen import records

    read = {os.path.realpath(file) for path in inputs for file in records.files(path)}
    for path in outputs:
        if path and os.path.realpath(path) in read:
            raise Failed(f"error: {path} is an input and would be overwritten; choose another name", 2)


def history_values(text: str | None) -> list[float] | None:
    return None if text is None else number_list("--history", text, "100,-100")


def number_list(option: str, text: str, example: str) -> list[float]:
    """The numbers in the value of an option."""
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = [math.nan]
    if not all(map(math.isfinite, numbers)):
        raise Failed(f"error: {option} {text!r} is not a list of numbers; write {option} {example}", 2)
    return numbers


class Judging(click.Command):
    """A command with records and held-out records; warns about files after `--holdout FILE` that would be fitted.

    A shell expands `--holdout *.csv` to `--holdout a.csv b.csv`, but the option takes only the first file.
    """

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the arguments."""
        words = list(args)
        rest = super().parse_args(ctx, args)
        data = ctx.params.get("data") or ()
        for k, word in enumerate(words):
            behind = list(itertools.takewhile(lambda each: not each.startswith("-"), words[k + 1 :]))
            fitted = [path for path in behind[1:] if path in data]
            if word == "--holdout" and fitted and len(fitted) < len(data):
                more = f" and {len(fitted) - 1} more" if len(fitted) > 1 else ""
                console.note(
                    f"warning: {fitted[0]}{more} will be fitted, not held out: --holdout takes one file; put a pattern "
                    f"in quotes, --holdout '{Path(behind[0]).parent / '*'}{Path(behind[0]).suffix}'"
                )
        return rest


def data_argument(required: bool) -> Callable[[Callable[..., object]], Callable[..., object]]:
    """The records given to a command, with those joined from two files each after the others."""

    def with_joined(command: Callable[..., object]) -> Callable[..., object]:
        @functools.wraps(command)
        def run(*, data: tuple[str, ...], join: tuple[tuple[str, str], ...], **others: object) -> object:
            everything = (*data, *joined(join))
            if required and not everything:
                raise click.UsageError("Missing argument 'DATA...'.")
            return command(data=everything, **others)

        return click.argument("data", nargs=-1, type=click.Path(), callback=matched)(run)

    return with_joined


def joined(pairs: tuple[tuple[str, str], ...]) -> list[str]:
    """The records of `--join`, each of two files."""
    from hystgen import records

    for path in itertools.chain(*pairs):
        if not os.path.exists(records.files(path)[0]):
            raise Failed(f"error: --join {path}: there is no such file; give the files of two channels", 2)
    return [records.MARK.join(pair) for pair in pairs]


AGAIN = ("columns", "sample_time", "delimiter", "history", "rest", "skip", "clock_skew")
"""Options about records that the next command with the same records has to repeat."""


def repeated() -> dict[str, str]:
    """The options of the running command that say how its records are read and compared, as the user gave them."""
    context = click.get_current_context()
    given = {
        option.opts[0]: context.params[option.name]
        for option in context.command.params
        if option.name in AGAIN and context.get_parameter_source(option.name) is ParameterSource.COMMANDLINE
    }
    return {option: str(value) for option, value in given.items()}


class ReadingArguments(TypedDict):
    """Command-line arguments for reading records."""

    columns: str | None
    sample_time: float | None
    delimiter: str | None


class ReadingOptions(TypedDict):
    """The options of `read_records` that the command line sets."""

    columns: dict[str, str] | None
    sample_time: float | None
    delimiter: str | None
    progress: bool


def reading_options(**given: Unpack[ReadingArguments]) -> ReadingOptions:
    from hystgen import records

    columns = given["columns"]
    mapping = guarded("--columns", lambda: records.parse_columns(columns)) if columns else None
    return {**given, "columns": mapping, "progress": True}


_RECORD_OPTIONS = [
    click.option(
        "--columns",
        metavar="t=Time,v=U,y=Pos",
        help="names t, v, y for the file's columns; in HDF5 v=run1/drive, in a MATLAB struct v=data.v; in text also by "
        "number, 1,2,3 for t, v, y",
    ),
    click.option("--sample-time", type=Seconds(), help="sample time in seconds, for files without time"),
    click.option("--delimiter", help="default: detected from the file"),
    click.option(
        "--join", nargs=2, multiple=True, type=click.Path(), metavar="DRIVE MEASURED",
        help="two files with one channel each, as one record; with the same samples",
    ),
    click.option("--history", metavar="V,V,..", help="drive values visited before each record, in the model's units"),
    click.option(
        "--rest", type=Seconds(), callback=seconds, default=0.0, help="pause in seconds, which matters only to effects"
    ),
]


def record_options(command: Callable[..., object]) -> Callable[..., object]:
    """The options shared by all commands that take records."""
    for option in reversed(_RECORD_OPTIONS):
        command = option(command)
    return command
