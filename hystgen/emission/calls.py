"""The public calls for emission: they write models as C files into a folder, or report how the files there differ."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

from hystgen.arithmetic import ARITHMETICS, FIXED
from hystgen.basics import arguments, writing
from hystgen.basics.problems import FormatError, NotInvertibleError
from hystgen.basics.problems import Path as Key
from hystgen.compensator import engines
from hystgen.effects import CATALOGUE, shapes
from hystgen.emission import module
from hystgen.emission.options import INTEGRATIONS, LAYOUTS, OPERATORS, TABLES, Options
from hystgen.model import Model, ModelSource, as_model, check_arithmetic
from hystgen.parameters.files import parameters_sha256

Sources: TypeAlias = "ModelSource | Iterable[ModelSource]"


def _models(source: Sources) -> list[Model]:
    """The models of one source or several."""
    if isinstance(source, list | tuple | Iterator):
        return [as_model(each) for each in source]
    return [as_model(source)]  # type: ignore[arg-type]


def emit_options(
    model: Model,
    operator: str | None = None,
    arithmetic: str | None = None,
    engine: str | None = None,
    layout: str = "self-contained",
    optimize: str | None = None,
    allow_partial: bool = False,
    manifest: bool = False,
    integration: Sequence[str] = (),
    health: bool = False,
    tables: str = "constant",
) -> Options:
    """The options to emit with: the arguments given, else the parameter file's `emit` section.

    `allow_partial`: effects that the C cannot include are left out, and named in its banner; `manifest`: whether to
    write a manifest too; `integration`: the tools for which to write packages; `health`: whether the C watches the
    model's error; `tables`: constant or runtime.
    """
    defaults = model.parameters.emit
    operator, arithmetic = operator or defaults.operator, arithmetic or defaults.arithmetic
    check_arithmetic(arithmetic)
    arguments.choice("operator", operator, OPERATORS)
    arguments.choice("engine", engine or "auto", ("auto", *engines.ENGINES))
    arguments.choice("optimize", optimize or "auto", engines.OPTIMIZE)
    arguments.choice("layout", layout, LAYOUTS)
    arguments.choice("tables", tables, TABLES)
    tools = tuple(dict.fromkeys(arguments.words("integration", integration, "cmake")))
    for tool in tools:
        arguments.choice("integration", tool, INTEGRATIONS)
    left_out: tuple[str, ...] = ()
    if allow_partial and (refused := model.refusals(operator, arithmetic)):
        from hystgen.emission import worth

        left_out = tuple(worth.sentence(model, effect, reason) for effect, reason in refused)
        model = model.without([effect for effect, _ in refused])
    _check_codes(model, arithmetic, operator)
    model.need_compensated(arithmetic, operator)
    if operator != "forward" and model.cascade.inverse_problems():
        raise NotInvertibleError(model.cascade.inverse_problems())
    engine = model.engine(engine, operator, arithmetic, optimize, tables == "runtime")
    return Options(operator, arithmetic, engine, layout, left_out, manifest, health, tools, tables)


def _check_codes(model: Model, arithmetic: str, operator: str) -> None:
    """Raise FormatError for code sizes in floating point, where only a quiet drive needs one: that of its converter."""
    emit = model.parameters.emit
    quiet = emit.compensation.quiet and bool(model.effects) and operator != "forward"
    fixed = " or ".join(FIXED)
    words = f"is the size of a code, and {arithmetic} has no codes; remove it, or emit with --arithmetic {fixed}"
    problems: list[tuple[Key, str]] = [
        (("emit", key), words)
        for key in ARITHMETICS[arithmetic].unused
        if getattr(emit, key) is not None and not (quiet and key == "drive_lsb")
    ]
    if problems:
        raise FormatError(*problems)


def emitted_model(model: Model, options: Options) -> Model:
    """The model that the C implements: without the effects that `options` leave out."""
    if not options.left_out:
        return model
    return model.without([effect for effect, _ in model.refusals(options.operator, options.arithmetic)])


@arguments.taking(emit_options, "emit")
def emitted_files(source: Sources, **options: Any) -> dict[str, str]:
    """Names and text of the files for one or several models; options as for `emit`. Nothing is written.

    Raises the same errors as `emit`, and ValueError if two models make files with the same name.
    """
    models = _models(source)
    check_names(models)
    made: dict[str, str] = {}
    for model in models:
        chosen = emit_options(model, **options)
        kept = emitted_model(model, chosen)
        whole = module.of(kept, chosen, parameters_sha256(model.parameters))
        for doubt in (*doubts(model), *whole.doubts):
            warnings.warn(f"{model.name}: {doubt}", stacklevel=3)
        code = module.files(whole)
        made |= code
        if chosen.manifest:
            from hystgen.emission import manifest

            made |= manifest.file(whole, code)
        if chosen.integration:
            from hystgen.emission import integration

            made |= integration.files(whole, code)
    return made


def doubts(model: Model) -> list[str]:
    """Possible faults in an inverse: the diagnosis cannot separate stage and sensor, or the drive may not come to
    rest."""
    advice = "Record wide and nested loops, or use another sensor, and diagnose again"
    present = {*(effect.name for effect in model.effects), *["asymmetry"] * bool(model.cascade.stages)}
    found = []
    for taken, other in model.parameters.not_separable:
        for name, fault, which in ((other, taken, 0), (taken, other, 1)):
            if taken in present and name in CATALOGUE and (doubt := shapes(name)[0].mistaken.get(fault)):
                found.append(f"{doubt[which]} {advice}")
    if model.effects and (reach := _swing(model)):
        found.append(
            "an effect of your own gives the drive a lead in front of two branches of the memoryless part, so at rest "
            f"it may swing between them, by up to {reach:.3g} {model.parameters.units.input}".rstrip()
            + "; make the effect a lag, or give both branches the same parameters"
        )
    return found


def _swing(model: Model) -> float:
    """Amplitude by which the drive of a model with effects can swing at rest, in drive units."""
    from hystgen.compensator.chain.bounds import swing
    from hystgen.compensator.chain.parts import Parts

    seconds = model.parameters.sample_time
    return swing(model.cascade, Parts.of(model.effects), seconds) if seconds else 0.0


def check_names(models: Sequence[Model], parameters: Sequence[str] = ()) -> None:
    """Raise ValueError if two models make files with the same name; `parameters`: their files, for the message."""
    names = [model.name.lower() for model in models]  # macros and some file systems ignore case
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        files = ", ".join(file for name, file in zip(names, parameters, strict=False) if name == twice[0])
        raise ValueError(
            f"two models are called {twice[0]}{files and f' ({files})'}, so their files would overwrite each other; "
            "rename one"
        )


@arguments.taking(emit_options, "emit")
def emit(source: Sources, output: str | os.PathLike[str] = ".", **options: Any) -> list[Path]:
    """Write the C files of one or several models into folder `output` and return their paths.

    `source`: a model, a parameter file, a result of `identify` or `diagnose`, or a list of these.

    Options: `operator` inverse, forward or both; `arithmetic` float32, float64, q31 or q15; `engine` auto, corners or
    loop; `optimize` auto, speed or size, the goal of `engine` auto; `layout` self-contained, shared-runtime or
    single-header; `allow_partial` leaves out effects that the C cannot include; `manifest` writes NAME_manifest.json as
    well; `integration`: tools for which to write a folder NAME/, among cmake, meson, conan, platformio, arduino, zephyr
    and espidf; `health` adds a watch over the model's error. Missing options come from the file. Existing files with
    the same bytes are left alone. Raises ParameterError, NotInvertibleError, FormatError and UnsupportedEffectsError,
    before anything is written;
    FileExistsError if a package would replace a file of another origin.
    """
    return write(Path(arguments.path("output", output)), emitted_files(source, **options))


def write(folder: Path, files: Mapping[str, str]) -> list[Path]:
    """Write emitted files (name to text) and return their paths. Raises FileExistsError, before anything is written, if
    a package would replace a file of another origin."""
    if any("/" in name for name in files):
        from hystgen.emission import integration

        integration.check_replaced(folder, files)
    return writing.write_files(folder, files)


@arguments.taking(emit_options, "emit")
def differences(source: Sources, output: str | os.PathLike[str] = ".", **options: Any) -> list[str]:
    """The files in folder `output` that are missing or differ from what `emit` would write, one sentence per file.

    The sentence names the difference: options, parameters, version of hystgen, edits by hand, line endings. The list
    includes emitted files that none of the models writes, so give all models of a folder together.
    """
    from hystgen.emission import stale

    folder, models = Path(arguments.path("output", output)), _models(source)
    files = emitted_files(models, **options)
    found = [*stale.find(folder, files), *stale.orphans(folder, files, [model.name for model in models])]
    return [each.sentence() for each in found]
