"""`hystgen verify`: the emitted C against the Python reference."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from hystgen.basics import console
from hystgen.cli import common
from hystgen.verification.targets import NAMES as TARGETS

if TYPE_CHECKING:
    from hystgen.model import Model
    from hystgen.verification import Report


@click.command(short_help="Compare the emitted C with the reference, bit by bit.")
@common.several_params_argument
@common.operator_option
@common.arithmetic_option
@common.engine_option
@common.optimize_option
@common.layout_option
@common.tables_option
@common.partial_option
@common.health_option
@common.effects_option
@click.option("--compiler", multiple=True, help="gcc, clang, zig or another command; default: all found")
@click.option(
    "--targets", multiple=True, callback=common.words, default=["host"], metavar="TARGET,..",
    help=f"{', '.join(TARGETS)}; default: host",
)
@click.option("--target-length", type=click.IntRange(min=1), help="calls per record on emulated cores")
@click.option("--json", "json_file", type=click.Path(dir_okay=False), help="write the report as JSON")
@click.option("--junit", "junit_file", type=click.Path(dir_okay=False), help="write the report as JUnit XML")
@common.quiet_option
def verify(
    params: tuple[str, ...], compiler: tuple[str, ...], targets: tuple[str, ...], target_length: int | None,
    json_file: str | None, junit_file: str | None, quiet: bool, effects: tuple[str, ...], **options: object,
) -> None:
    """Compile the emitted C of models, run it and compare it with the Python reference, bit for bit.

    Example: hystgen verify stage_x.yaml --targets host,cortex-m4f

    For several models in one report: hystgen verify stage_x.yaml stage_y.yaml --junit verify.xml

    The exit code is 1 if bits differ or C cannot be built, and 2 if the only problem is a missing tool.
    """
    from hystgen import verification
    from hystgen.basics import arguments, jit, writing

    if quiet:
        jit.announce = None

    for word in targets:
        common.guarded("--targets", partial(arguments.choice, "target", word, TARGETS))
    params = tuple(dict.fromkeys(params))
    common.keep_inputs((json_file, junit_file), params)
    for file in (json_file, junit_file):
        if file:
            common.guarded(file, partial(writing.check_writable, file))
    named = list(zip(params, common.for_each(params, partial(common.load_model, effects=effects)), strict=True))
    common.for_each(named, lambda one: common.guarded(one[0], partial(_check, one[1], options)))

    def verified(one: tuple[str, Model]) -> Report:
        path, model = one
        about = f"{path}: " if len(named) > 1 else ""

        def say(what: str) -> None:
            if not quiet:
                console.note(f"verifying: {about}{what}")

        check = partial(
            verification.verify, model, compiler=compiler, targets=targets, target_length=target_length, progress=say
        )
        return replace(common.guarded(path, partial(check, **options)), file=path)

    report = verification.Reports(common.for_each(named, verified))
    shown = replace(report, reports=[each for each in report.reports if not each.ok]) if quiet else report
    if shown.reports:
        console.say(shown.table())
    if len(report.reports) > 1 and not quiet:
        console.say(f"\n{report.summary()}")
    for file, text in ((json_file, report.to_json), (junit_file, report.to_junit)):
        if file:
            common.guarded(file, partial(writing.write_atomically, file, text()))
    if report.wrong:
        raise common.Failed("verification failed", 1)
    if not report.ok:
        raise common.Failed("could not verify everything: tools are missing on this machine", 2)


def _check(model: Model, options: Mapping[str, Any]) -> None:
    """Raise any emission error now, before time is spent on other models."""
    from hystgen.emission.calls import emit_options, emitted_model

    chosen = emit_options(model, **options)
    emitted_model(model, chosen).tables(chosen.arithmetic, chosen.engine, chosen.operator)
