"""`hystgen build`: shared libraries of the emitted C."""

from __future__ import annotations

from functools import partial

import click

from hystgen.basics import console
from hystgen.cli import common
from hystgen.distribution.platforms import PLATFORMS


@click.command(short_help="Compile the C into shared libraries.")
@common.params_argument
@click.option(
    "--target", multiple=True, callback=common.words, metavar="TARGET,..", help=f"{', '.join(PLATFORMS)}; default: all"
)
@click.option(
    "-o", "output", type=click.Path(file_okay=False), default=".", help="folder to write to; default: the current one"
)
@common.operator_option
@common.arithmetic_option
@common.engine_option
@common.optimize_option
@common.partial_option
@common.effects_option
def build(params: str, target: tuple[str, ...], output: str, effects: tuple[str, ...], **options: object) -> None:
    """Compile the C of a model into shared libraries for LabVIEW, Python, C# and others, with zig.

    Example: hystgen build stage_x.yaml --target x86_64-windows,x86_64-linux -o libraries/

    Writes TARGET/NAME.so, .dll, .dylib or .wasm and TARGET/NAME.h, and prints what the libraries export. They need no
    C library. The extra `zig` installs the compiler.
    """
    from hystgen.distribution import libraries

    targets = target or tuple(PLATFORMS)
    model = common.load_model(params, effects)
    write = partial(libraries.build, model, output, targets, progress=True)
    made = common.compiled(params, partial(write, **options))
    for path in made.paths:
        console.say(str(path))
    console.say("exported:")
    for prototype in made.exports:
        console.say(f"    {prototype}")
    if "wasm32" in targets:
        console.say("    memory and __heap_base (wasm32): instances may lie from __heap_base on")
