"""`hystgen emit`: the C files of models."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hystgen.basics import console
from hystgen.cli import common
from hystgen.emission.options import INTEGRATIONS

if TYPE_CHECKING:
    from hystgen.model import Model


@click.command()
@click.argument("params", nargs=-1, required=True, type=click.Path())
@click.option("-o", "output", type=click.Path(file_okay=False), default=".", help="folder to write to")
@common.operator_option
@common.arithmetic_option
@common.engine_option
@common.optimize_option
@common.layout_option
@click.option(
    "--integration", metavar="TOOL,..", help="also write a folder NAME/ for build tools: " + ", ".join(INTEGRATIONS)
)
@click.option(
    "--check", is_flag=True, help="write nothing; exit 1 and list the files that differ or that none of PARAMS writes"
)
@common.partial_option
@common.effects_option
@click.option("--list-outputs", is_flag=True, help="write nothing; print the paths")
def emit(
    params: tuple[str, ...], output: str, check: bool, effects: tuple[str, ...], list_outputs: bool,
    integration: str | None, **options: object,
) -> None:
    """Write the C files of models.

    Example: hystgen emit stage_x.yaml stage_y.yaml -o firmware/ --operator inverse --arithmetic float32

    To keep all emitted files of a folder up to date: hystgen emit stage_x.yaml stage_y.yaml -o firmware/ --check

    Ready for build tools: hystgen emit stage_x.yaml -o lib/ --integration platformio,cmake

    With an effect of your own: hystgen emit diagnosis/params.yaml -o firmware/ --effects my_effect/
    """
    from hystgen.basics import arguments
    from hystgen.emission import calls

    params = tuple(dict.fromkeys(params))
    tools = options["integration"] = tuple(integration.split(",")) if integration is not None else ()
    for tool in tools:
        common.guarded(output, partial(arguments.choice, "integration", tool, INTEGRATIONS))
    models = common.for_each(params, partial(common.load_model, effects=effects))
    common.guarded(output, lambda: calls.check_names(models))
    named = list(zip(params, models, strict=True))
    texts = common.for_each(named, lambda one: common.guarded(one[0], lambda: calls.emitted_files(one[1], **options)))
    made = {name: text for each in texts for name, text in each.items()}
    if check:
        _check(named, texts, output, options, effects)
    elif list_outputs:
        for name in made:
            console.say(str(Path(output) / name))
    else:
        for path in common.guarded(output, lambda: calls.write(Path(output), made)):
            console.say(str(path))


def _check(
    models: Sequence[tuple[str, Model]], texts: Sequence[Mapping[str, str]], output: str, options: Mapping[str, Any],
    effects: Sequence[str],
) -> None:
    """Exit with code 1 if files on disk are stale; print the differences and the commands that update the files."""
    from hystgen.emission import calls, stale
    from hystgen.emission.options import OPTIONS

    folder = Path(output)
    given = {
        key: ",".join(value) if key == "integration" else value
        for key, value in options.items() if value and (key, value) != ("layout", "self-contained")
    }
    differing = []
    for (path, model), files in zip(models, texts, strict=True):
        found = common.guarded(path, partial(stale.find, folder, files))
        if not found:
            continue
        chosen = calls.emit_options(model, **options)
        wanted = {key: getattr(chosen, key) for key in OPTIONS} | {
            key: value for key, value in given.items() if key in ("allow_partial", "integration")
        }

        def again(
            other: Mapping[str, str], model: Model = model, found: Sequence[stale.Difference] = found
        ) -> list[stale.Difference]:
            try:
                with warnings.catch_warnings(action="ignore"):  # already given for the files themselves
                    unsealed = {key: options[key] for key in ("allow_partial", "integration")}
                    made = calls.emitted_files(model, **other, **unsealed)
                    return stale.find(folder, made)
            except ValueError:  # the model no longer exists
                return list(found)

        differing.append(stale.Stale(path, found, wanted, again))
    written = {name for files in texts for name in files}
    unwritten = common.guarded(output, lambda: stale.orphans(folder, written, [model.name for _, model in models]))
    if differing or unwritten:
        wrong = [*(each for one in differing for each in one.differences), *unwritten]
        problems = dict.fromkeys(f"error: {each.sentence()}" for each in wrong)
        raise common.Failed("\n".join([*problems, *stale.advice(differing, unwritten, output, given, effects)]), 1)
