"""The command line: parse the words, call one function, print what it returns."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hystgen import __version__

if TYPE_CHECKING:
    from hystgen.api import Model

ARITHMETICS = ("float32", "float64", "q31", "q15")
TARGETS = ("host", "cortex-m0plus", "cortex-m4f", "cortex-m7", "cortex-m33", "rv32imac", "rv32imafc")


class _Failed(click.ClickException):
    """A check that failed (exit code 1) or input that cannot be used (2); the message says everything."""

    exit_code: int

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.__dict__["exit_code"] = code

    def show(self, file: Any = None) -> None:
        click.echo(self.message, err=True)


def _shown(path: str, action: Callable[[], Any]) -> Any:
    """Run `action` and turn what it may raise into a message and an exit code."""
    from hystgen.models import NotInvertibleError
    from hystgen.params import ParameterError
    from hystgen.tables import FormatError

    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", UserWarning)
            result = action()
        for warning in caught:
            click.echo(f"warning: {warning.message}", err=True)
        return result
    except ParameterError as error:
        raise _Failed(str(error), 2) from None
    except NotInvertibleError as error:
        raise _Failed("\n".join(f"{path}: error: no inverse: {reason}" for reason in error.reasons), 1) from None
    except FormatError as error:
        raise _Failed(f"{path}: error: {error}", 2) from None
    except (ValueError, OSError) as error:
        raise _Failed(f"error: {error}", 2) from None


def _load(path: str) -> Model:
    from hystgen.api import load

    model: Model = _shown(path, lambda: load(path))
    return model


params_argument = click.argument("params", type=click.Path())
operator_option = click.option("--operator", type=click.Choice(["inverse", "forward", "both"]), help="default: the file's")
arithmetic_option = click.option("--arithmetic", type=click.Choice(ARITHMETICS), help="default: the file's")
engine_option = click.option("--engine", type=click.Choice(["auto", "corners", "loop"]), help="default: the file's")
layout_option = click.option(
    "--layout", type=click.Choice(["self-contained", "shared-runtime", "single-header"]), default="self-contained",
    show_default=True,
)  # fmt: skip


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="hystgen")
def main() -> None:
    """From a measured hysteresis loop to a verified compensator in C."""


@main.command()
@params_argument
@click.option("-o", "output", type=click.Path(file_okay=False), default=".", help="folder to write to")
@operator_option
@arithmetic_option
@engine_option
@layout_option
@click.option("--check", is_flag=True, help="write nothing; exit 1 if what is in the folder differs")
@click.option("--list-outputs", is_flag=True, help="write nothing; print the paths")
def emit(params: str, output: str, check: bool, list_outputs: bool, **options: str | None) -> None:
    """Write the C files of a model.

    Example: hystgen emit stage_x.yaml -o firmware/ --operator inverse --arithmetic float32
    """
    from hystgen import api

    model = _load(params)
    if check:
        problems = _shown(params, lambda: api.differences(model, output, **options))
        if problems:
            raise _Failed("\n".join(f"error: {problem}; run hystgen emit again" for problem in problems), 1)
        return
    if list_outputs:
        names = _shown(params, lambda: api.emitted_files(model, **options))
        for name in names:
            click.echo(str(Path(output) / name))
        return
    for path in _shown(params, lambda: api.emit(model, output, **options)):
        click.echo(str(path))


@main.command()
@params_argument
@operator_option
@arithmetic_option
@engine_option
@layout_option
@click.option("--compiler", multiple=True, help="gcc, clang or zig; default: every one installed")
@click.option("--targets", default="host", show_default=True, help="comma separated: " + ", ".join(TARGETS))
@click.option("--json", "json_file", type=click.Path(dir_okay=False), help="write the report for programs")
@click.option("--junit", "junit_file", type=click.Path(dir_okay=False), help="write the report as JUnit XML")
def verify(
    params: str, compiler: tuple[str, ...], targets: str, json_file: str | None, junit_file: str | None, **options: Any
) -> None:
    """Compile the emitted C, run it and compare it with the Python reference, bit for bit.

    Example: hystgen verify stage_x.yaml --compiler gcc --compiler clang
    """
    from hystgen import verification
    from hystgen.verification import compilers

    chosen = tuple(targets.split(","))
    for word, known, what in [(t, TARGETS, "target") for t in chosen] + [
        (c, compilers.NAMES, "compiler") for c in compiler
    ]:
        if word not in known:
            raise _Failed(f"error: unknown {what} {word!r}; use {', '.join(known)}", 2)
    model = _load(params)

    def say(what: str) -> None:
        click.echo(f"verifying: {what}", err=True)

    report = _shown(
        params,
        lambda: verification.verify_model(model, compiler=compiler, targets=chosen, progress=say, **options),
    )
    for file, text in ((json_file, report.to_json), (junit_file, report.to_junit)):
        if file:
            Path(file).write_text(text(), encoding="utf-8")
    click.echo(report.table())
    if not report.ok:
        raise _Failed("verification failed", 1)


@main.command()
def schema() -> None:
    """Print the JSON Schema of the parameter file.

    Example: hystgen schema > hystgen.schema.json
    """
    import json

    from hystgen import params

    click.echo(json.dumps(params.schema(), indent=2))


if __name__ == "__main__":
    sys.exit(main())
