"""`hystgen verify`: the emitted C against the Python reference."""

from __future__ import annotations

from functools import partial
from typing import Any

import click

from hystgen.basics import console
from hystgen.cli.common import (
    Failed,
    arithmetic_option,
    effects_option,
    engine_option,
    guarded,
    keep_inputs,
    layout_option,
    load_model,
    operator_option,
    optimize_option,
    params_argument,
    partial_option,
)
from hystgen.verification.targets import NAMES as TARGETS


@click.command(short_help="Compare the emitted C with the reference, bit by bit.")
@params_argument
@operator_option
@arithmetic_option
@engine_option
@optimize_option
@layout_option
@partial_option
@effects_option
@click.option("--compiler", multiple=True, help="gcc, clang, zig or another command; default: all found")
@click.option("--targets", default="host", show_default=True, help="comma separated: " + ", ".join(TARGETS))
@click.option("--target-length", type=click.IntRange(min=1), help="calls of a record on emulated cores")
@click.option("--json", "json_file", type=click.Path(dir_okay=False), help="write the report for programs")
@click.option("--junit", "junit_file", type=click.Path(dir_okay=False), help="write the report as JUnit XML")
def verify(
    params: str, compiler: tuple[str, ...], targets: str, json_file: str | None, junit_file: str | None,
    effects: tuple[str, ...], **options: Any,
) -> None:
    """Compile the emitted C, run it and compare it with the Python reference, bit for bit.

    Example: hystgen verify stage_x.yaml --targets host,cortex-m4f
    """
    from hystgen import verification
    from hystgen.basics import writing

    chosen = tuple(targets.split(","))
    for word in chosen:
        if word not in TARGETS:
            raise Failed(f"error: unknown target {word!r}; use {', '.join(TARGETS)}", 2)
    keep_inputs((json_file, junit_file), [params])
    for file in (json_file, junit_file):
        if file:
            guarded(file, partial(writing.check_writable, file))
    model = load_model(params, effects)

    def say(what: str) -> None:
        console.note(f"verifying: {what}")

    report = guarded(
        params,
        lambda: verification.verify(model, compiler=compiler, targets=chosen, progress=say, **options),
    )
    console.say(report.table())
    for file, text in ((json_file, report.to_json), (junit_file, report.to_junit)):
        if file:
            guarded(file, partial(writing.write_atomically, file, text()))
    if not report.ok:
        raise Failed("verification failed", 1)
