"""`hystgen fmu`: a model as a co-simulation unit."""

from __future__ import annotations

from functools import partial

import click

from hystgen.basics import console
from hystgen.cli import common


@click.command(short_help="Write a co-simulation unit (FMI).")
@common.params_argument
@click.option("-o", "output", type=click.Path(dir_okay=False), required=True, metavar="NAME.fmu", help="file to write")
@click.option("--fmi", type=click.Choice(["2", "3"]), default="2", show_default=True, help="version of FMI")
@common.operator_option
@common.arithmetic_option
@common.engine_option
@common.optimize_option
@common.partial_option
@common.effects_option
def fmu(params: str, output: str, fmi: str, effects: tuple[str, ...], **options: object) -> None:
    """Write a model as a co-simulation unit of FMI 2.0 or 3.0, for Simulink, Modelica tools and others.

    Example: hystgen fmu stage_x.yaml -o stage_x.fmu --operator inverse

    Variables are u and v (inverse) or v and y (forward), in the model's units; the step size is sample_time. Binaries
    for Linux, Windows and macOS are inside. The extra `zig` installs the compiler.
    """
    from hystgen.distribution import fmu as units

    model = common.load_model(params, effects)
    common.keep_inputs((output,), (params,))
    write = partial(units.fmu, model, output, int(fmi), progress=True)
    path = common.compiled(params, partial(write, **options))
    console.say(str(path))
