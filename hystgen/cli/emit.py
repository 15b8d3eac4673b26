"""`hystgen emit`: the C files of models."""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hystgen.basics import console
from hystgen.basics.problems import counted
from hystgen.cli import common
from hystgen.emission.options import INTEGRATIONS

if TYPE_CHECKING:
    from hystgen.emission import stale
    from hystgen.emission.options import Options
    from hystgen.model import Model


@dataclass(frozen=True)
class Emitted:
    """A model with its parameter file, the folder of its C, its C files (name to text) and the s it took to emit."""

    parameters: str
    model: Model
    folder: Path
    files: Mapping[str, str]
    seconds: float


@click.command()
@common.several_params_argument
@click.option(
    "-o", "output", type=click.Path(file_okay=False),
    help="folder to write to; default: emit.output of each file, else the current folder",
)
@common.operator_option
@common.arithmetic_option
@common.engine_option
@common.optimize_option
@common.layout_option
@common.tables_option
@click.option(
    "--integration", multiple=True, callback=common.words, metavar="TOOL,..",
    help="also write a folder NAME/ for build tools: " + ", ".join(INTEGRATIONS),
)
@click.option(
    "--check", is_flag=True, help="write nothing; exit 1 and list the files that differ or that none of PARAMS writes"
)
@click.option("--junit", "junit_file", type=click.Path(dir_okay=False), help="with --check: write a JUnit XML report")
@common.quiet_option
@common.partial_option
@common.effects_option
@click.option("--manifest", is_flag=True, help="also write NAME_manifest.json: hashes, bounds, figures, deviations")
@common.health_option
@click.option("--list-outputs", is_flag=True, help="write nothing; print the paths")
def emit(
    params: tuple[str, ...], output: str | None, check: bool, junit_file: str | None, effects: tuple[str, ...],
    list_outputs: bool, quiet: bool, integration: tuple[str, ...], **options: object,
) -> None:
    """Write the C files of models.

    Example: hystgen emit stage_x.yaml stage_y.yaml -o firmware/ --operator inverse --arithmetic float32

    To keep all emitted files of a folder up to date: hystgen emit stage_x.yaml stage_y.yaml -o firmware/ --check

    Ready for build tools: hystgen emit stage_x.yaml -o lib/ --integration platformio,cmake

    With an effect of your own: hystgen emit diagnosis/params.yaml -o firmware/ --effects my_effect/
    """
    from hystgen.basics import arguments, writing
    from hystgen.emission import calls

    params = tuple(dict.fromkeys(params))
    if check and list_outputs:
        raise common.Failed("error: --check compares files and --list-outputs only names them; give one of the two", 2)
    if junit_file:
        if not check:
            raise common.Failed("error: --junit reports what --check finds; add --check", 2)
        common.keep_inputs([junit_file], params)
        common.guarded(junit_file, partial(writing.check_writable, junit_file))
    options["integration"] = integration
    for tool in integration:
        common.guarded(output or ".", partial(arguments.choice, "integration", tool, INTEGRATIONS))
    models = common.for_each(params, partial(common.load_model, effects=effects))
    folders = [_folder(path, model, output) for path, model in zip(params, models, strict=True)]
    for folder in dict.fromkeys(folders):
        together = {path: model for path, model, own in zip(params, models, folders, strict=True) if own == folder}
        common.guarded(str(folder), partial(calls.check_names, list(together.values()), list(together)))

    def emitted(one: tuple[str, Model, Path]) -> Emitted:
        path, model, folder = one
        begun = time.perf_counter()
        files = common.guarded(path, lambda: calls.emitted_files(model, **options))
        return Emitted(path, model, folder, files, time.perf_counter() - begun)

    made = common.for_each(list(zip(params, models, folders, strict=True)), emitted)
    if check:
        _check(made, output, options, effects, junit_file)
        if not quiet:
            files, sources = sum(len(one.files) for one in made), counted(len(made), "model")
            console.note(f"up to date: {counted(files, 'file')} of {sources}")
        return

    def written(folder: Path) -> list[Path]:
        files = {name: text for one in made if one.folder == folder for name, text in one.files.items()}
        if list_outputs:
            return [folder / name for name in files]
        return common.guarded(str(folder), partial(calls.write, folder, files))

    for paths in common.for_each(list(dict.fromkeys(folders)), written):
        for path in paths if list_outputs or not quiet else ():
            console.say(str(path))


def _folder(path: str, model: Model, output: str | None) -> Path:
    """The folder for a model's C: the one on the command line, else the parameter file's, else the current one."""
    own = model.parameters.emit.output
    if output is None and own is not None:
        return Path(os.path.normpath(Path(path).parent / own))
    return Path(output or ".")


def _check(
    made: Sequence[Emitted], output: str | None, options: Mapping[str, Any], effects: Sequence[str],
    junit_file: str | None,
) -> None:
    """Exit with code 1 if files on disk are stale; print the differences and the commands that update the files."""
    from hystgen.basics import junit, writing
    from hystgen.emission import calls, stale
    from hystgen.parameters.files import parameters_sha256

    differing, unwritten, suites = [], [], []
    for one in made:
        found = common.guarded(one.parameters, partial(stale.find, one.folder, one.files))
        sha256 = parameters_sha256(one.model.parameters)
        suites.append(
            stale.suite(one.parameters, one.model.name, one.folder, one.files, found, one.seconds, sha256)
        )
        if found:
            chosen = calls.emit_options(one.model, **options)
            differing.append(_stale(one, found, chosen, {key: options[key] for key in UNSEALED if options[key]}))
    for folder in dict.fromkeys(one.folder for one in made):
        own = [one for one in made if one.folder == folder]
        written = {name for one in own for name in one.files}
        here = [one.model.name for one in own]
        elsewhere = {
            one.model.name: f"to {one.folder}{os.sep}: see emit.output in {one.parameters}" for one in made
        }
        left = common.guarded(str(folder), partial(stale.orphans, folder, written, here, elsewhere))
        unwritten += left
        suites += [stale.orphan_suite(folder, left)] if left else []
    if junit_file:
        text = junit.document("hystgen emit --check", suites)
        common.guarded(junit_file, partial(writing.write_atomically, junit_file, text))
    if differing or unwritten:
        wrong = [*(each for one in differing for each in one.differences), *unwritten]
        problems = dict.fromkeys(f"error: {each.sentence()}" for each in wrong)
        given = {
            key: _word(value)
            for key, value in options.items() if value and (key, value) != ("layout", "self-contained")
        }
        raise common.Failed("\n".join([*problems, *stale.advice(differing, unwritten, output, given, effects)]), 1)


def _word(value: object) -> str | bool:
    """An option's value on a command line; True for a flag."""
    return ",".join(value) if isinstance(value, tuple) else value if isinstance(value, str) else True


UNSEALED = ("allow_partial", "manifest", "integration", "health")
"""Options that a banner does not contain."""


def _stale(
    one: Emitted, found: list[stale.Difference], chosen: Options, unsealed: Mapping[str, object]
) -> stale.Stale:
    """A model whose files differ, with the options chosen for it; `unsealed`: those that a banner does not contain."""
    from hystgen.emission import calls, stale
    from hystgen.emission.options import OPTIONS

    def again(other: Mapping[str, str]) -> list[stale.Difference]:
        try:
            with warnings.catch_warnings(action="ignore"):  # already given for the files themselves
                files = calls.emitted_files(one.model, **other, **unsealed)
                return stale.find(one.folder, files)
        except ValueError:  # the model no longer exists
            return list(found)

    more = {key: _word(value) for key, value in unsealed.items()}
    wanted = {key: getattr(chosen, key) for key in OPTIONS} | more
    return stale.Stale(one.parameters, found, wanted, again)
