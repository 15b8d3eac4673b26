"""`hystgen blob`: blocks that carry the parameters of units to a module that loads them."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hystgen.basics import console
from hystgen.cli import common

if TYPE_CHECKING:
    from hystgen.model import Model


@click.command(short_help="Write a unit's parameters for --tables runtime.")
@click.argument("params", nargs=-1, type=click.Path(), callback=common.matched)
@click.option("-o", "output", type=click.Path(), help="file to write, or with several PARAMS the folder of NAME.bin")
@click.option("--show", "shown", type=click.Path(dir_okay=False), metavar="UNIT.bin",
              help="print what a block contains; with PARAMS, also its numbers")
@click.option("--json", "as_json", is_flag=True, help="with --show: print JSON")
@click.option("--module", "header", type=click.Path(dir_okay=False), metavar="NAME.h",
              help="header of the module: takes its options and checks that the unit fits")
@common.operator_option
@common.arithmetic_option
@common.engine_option
@common.optimize_option
@common.quiet_option
@common.partial_option
@common.effects_option
def blob(
    params: tuple[str, ...], output: str | None, shown: str | None, as_json: bool, header: str | None,
    effects: tuple[str, ...], quiet: bool, **options: Any,
) -> None:
    """Write the block that carries a unit's parameters to a module emitted with --tables runtime.

    Example: hystgen blob unit_17.yaml -o unit_17.bin --module firmware/stage.h

    For a fleet, one block for each file: hystgen blob fleet/*.yaml -o blocks/ --module firmware/stage.h

    What a block contains: hystgen blob --show unit_17.bin
    """
    from hystgen.basics import writing
    from hystgen.emission import units

    if shown is not None:
        _show(shown, params, as_json, effects, {**options, "header": header})
        return
    if not params or output is None or as_json:
        raise common.Failed("error: give PARAMS and -o, or --show UNIT.bin, with --json if you like", 2)
    params = tuple(dict.fromkeys(params))
    models = common.for_each(params, partial(common.load_model, effects=effects))
    common.keep_inputs((output,), params)

    def made(one: tuple[str, Model]) -> bytes:
        path, model = one
        return common.guarded(path, lambda: units.parameters(model, header, **options).block())

    blocks = common.for_each(list(zip(params, models, strict=True)), made)
    folder = Path(output)
    if len(params) == 1 and not folder.is_dir():
        common.guarded(output, partial(writing.write_atomically, output, blocks[0]))
        paths = [folder]
    else:
        names = [Path(path).stem for path in params]
        if twice := sorted({name for name in names if names.count(name) > 1}):
            raise common.Failed(f"error: two of PARAMS are called {twice[0]}; rename one", 2)
        files = {f"{name}.bin": each for name, each in zip(names, blocks, strict=True)}
        paths = common.guarded(output, partial(writing.write_files, folder, files))
    for path in () if quiet else paths:
        console.say(str(path))


def _show(
    path: str, params: tuple[str, ...], as_json: bool, effects: tuple[str, ...], options: dict[str, Any]
) -> None:
    """Print what a block contains. Exit code 1 if it is damaged."""
    from hystgen.emission import units

    if len(params) > 1:
        raise common.Failed("error: --show takes one of PARAMS at most", 2)
    data = common.guarded(path, lambda: Path(path).read_bytes())
    model = common.load_model(params[0], effects) if params else None
    found = common.guarded(params[0] if params else path, lambda: units.show_blob(data, model, **options))
    if as_json:
        console.say(json.dumps(found, indent=2))
    else:
        for key, value in found.items():
            if key != "numbers":
                console.say(f"{key:<11} {value or 'none'}")
        for name, numbers in found.get("numbers", {}).items():
            console.say(f"{name} = {', '.join(format(each, '.9g') for each in numbers)}")
    if found["damage"]:
        raise common.Failed("", 1)
