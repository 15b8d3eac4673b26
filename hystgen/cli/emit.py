"""`hystgen emit`: the C files of models."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hystgen.basics import console
from hystgen.cli.common import (
    Failed,
    arithmetic_option,
    effects_option,
    engine_option,
    for_each,
    guarded,
    layout_option,
    load_model,
    operator_option,
    optimize_option,
    partial_option,
)

if TYPE_CHECKING:
    from hystgen.model import Model


@click.command()
@click.argument("params", nargs=-1, required=True, type=click.Path())
@click.option("-o", "output", type=click.Path(file_okay=False), default=".", help="folder to write to")
@operator_option
@arithmetic_option
@engine_option
@optimize_option
@layout_option
@click.option("--check", is_flag=True, help="write nothing; exit 1 if what is in the folder differs, and say in what")
@partial_option
@effects_option
@click.option("--list-outputs", is_flag=True, help="write nothing; print the paths")
def emit(
    params: tuple[str, ...], output: str, check: bool, effects: tuple[str, ...], list_outputs: bool, **options: Any
) -> None:
    """Write the C files of models.

    Example: hystgen emit stage_x.yaml stage_y.yaml -o firmware/ --operator inverse --arithmetic float32

    With an effect of your own: hystgen emit diagnosis/params.yaml -o firmware/ --effects my_effect/
    """
    from hystgen.basics import writing
    from hystgen.emission import calls

    params = tuple(dict.fromkeys(params))
    models = for_each(params, partial(load_model, effects=effects))
    guarded(output, lambda: calls.check_names(models))
    named = list(zip(params, models, strict=True))
    texts = for_each(named, lambda one: guarded(one[0], lambda: calls.emitted_files(one[1], **options)))
    made = {name: text for each in texts for name, text in each.items()}
    if check:
        _check(named, output, options, effects)
    elif list_outputs:
        for name in made:
            console.say(str(Path(output) / name))
    else:
        for path in guarded(output, lambda: writing.write_files(Path(output), made)):
            console.say(str(path))


def _check(
    models: Sequence[tuple[str, Model]], output: str, options: Mapping[str, Any], effects: Sequence[str]
) -> None:
    """Exit with code 1; says how the files on disk differ and which commands bring them up to date."""
    from hystgen.emission import calls, stale
    from hystgen.emission.options import OPTIONS

    problems, advice = [], []
    for path, model in models:
        found = guarded(path, partial(calls.stale_files, model, output, **options))
        if not found:
            continue
        given = {key: value for key, value in options.items() if value and (key, value) != ("layout", "self-contained")}
        partial_too = {"allow_partial": True} if options["allow_partial"] else {}
        chosen = calls.emit_options(model, **options)
        wanted = {key: getattr(chosen, key) for key in OPTIONS} | partial_too
        problems += [f"error: {each.sentence()}" for each in found]

        def again(other: Mapping[str, str], model: Model = model, found: Any = found) -> list[stale.Difference]:
            try:
                return calls.stale_files(model, output, **other, allow_partial=options["allow_partial"])
            except ValueError:  # no such model any more
                return list(found)

        advice += stale.advice(found, path, output, given, wanted, again, effects)
    if problems:
        raise Failed("\n".join(dict.fromkeys([*problems, *advice])), 1)
