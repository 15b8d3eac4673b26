"""The C files of `c_runtime/` and of effects as they are, in one unit with the numbers of a model.

Nothing is renamed, and only conditions on the model select code; files for either operator appear once for each.

The model is called `hystgen`, so that its macros and tables have the names that the files use.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from modelfiles import BRAKED, CALM, CHAINS, LED, PUSHED, SERVED, STEADY
from mutants import MODELS

from hystgen.emission import degauss, interface, module, runtime
from hystgen.emission.compensator import EmittedModel
from hystgen.emission.options import Options
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters

RUNTIME = runtime.data_folder("c_runtime")
EFFECTS = runtime.data_folder("hystgen") / "effects"
INCLUDES = [f"-I{RUNTIME}", f"-I{EFFECTS.parent}"]
"""Folders in which files look for each other."""

DEFINES = {
    "float32": [],
    "float64": ["-DHYSTGEN_REAL_IS_DOUBLE"],
    "q31": ["-DHYSTGEN_FIXED"],
    "q15": ["-DHYSTGEN_FIXED", "-DHYSTGEN_REAL_IS_SHORT"],
}
"""Macros that `hystgen_runtime.h` expects from a build."""

FLAGS = ["-ffp-contract=off", "-Wno-unused-function", "-Wno-unused-parameter"]
"""A file has functions and parameters for every model; emission leaves out those that a model does not use."""

ANALYSED = (
    ("two_branches", "q15", "loop"),
    ("two_branches", "float32", "corners"),
    ("listed", "float64", "loop"),
    ("bent", "q31", "corners"),
    ("plain", "float32", "corners"),
    ("plain", "q15", "corners"),
    ("above", "q31", "corners"),
    ("far_low", "q15", "loop"),
    ("quick", "float64", "loop"),
    ("viscous", "float32", "loop"),
    ("viscous_twin", "float32", "loop"),
    ("dilated", "float64", "loop"),
    ("dashpot", "float32", "loop"),
    ("bumpy", "float32", "loop"),
    ("everything", "float32", "loop"),
    ("everything", "q31", "loop"),
    ("relaxing", "float32", "loop"),
    ("quick", "q31", "loop"),
    ("relaxing", "q15", "loop"),
    ("bumpy", "q15", "loop"),
    ("soft_dashpot", "q31", "loop"),
    ("dilated", "q15", "loop"),
    ("calm", "float32", "loop"),
    ("calm", "q15", "loop"),
    ("braked", "q31", "loop"),
    ("creeping", "float32", "corners"),
    ("led", "q31", "corners"),
    ("forgetful", "float32", "loop"),
    ("forgetful", "q31", "loop"),
    ("gliding", "q15", "loop"),
    ("sloping", "float32", "loop"),
    ("sloping", "q31", "loop"),
    ("coded", "float32", "corners"),
    ("coded", "q31", "corners"),
    ("pushed", "float32", "loop"),
    ("pushed", "q15", "loop"),
    ("served", "float32", "loop"),
    ("served", "q31", "loop"),
    ("served_bent", "float32", "corners"),
    ("served_bent", "q15", "corners"),
    ("served_moved", "q31", "loop"),
)
"""Every line of `c_runtime/` and of the C of effects is in one of them, and in one of either kind of arithmetic if any
of `UNITS` has it there."""

UNITS = (
    *ANALYSED,
    ("gliding", "float32", "loop"),
    ("viscous_twin", "q15", "loop"),
    ("two_branches", "float32", "loop"),
    ("bent", "q31", "loop"),
    ("bent", "float64", "corners"),
    ("lagging", "float32", "loop"),
    ("warm", "float32", "loop"),
    ("aged", "float32", "loop"),
    ("lagging", "q15", "loop"),
    ("warm", "q31", "loop"),
    ("worn", "q15", "loop"),
    ("straight", "q31", "loop"),
    ("wider", "q31", "loop"),
    ("drifting", "float32", "loop"),
    ("drifting_late", "q15", "loop"),
    ("heated", "float64", "loop"),
    ("rubbed", "float32", "loop"),
    ("rubbed", "q15", "loop"),
    ("heated", "q31", "loop"),
    ("steady", "float32", "loop"),
    ("steady", "q15", "loop"),
)
"""Also every effect by itself, in floating point and in fixed point."""


GUARDS = ("compensator/within.c", "compensator/block.c")
"""Functions that emission calls in a module that loads its parameters: in its steps, and to read and write bytes."""


def model(name: str) -> Model:
    """The model of a parameter file under the name of the run time."""
    more = {"calm": CALM, "braked": BRAKED, "steady": STEADY, "pushed": PUSHED}
    text = {**MODELS, **CHAINS, **LED, **SERVED, **more}[name]
    return Model(parse_parameters(text, f"{name}.yaml").model_copy(update={"name": "hystgen"}))


def standing() -> list[Path]:
    """All C files and headers."""
    return [path for folder in (RUNTIME, EFFECTS) for path in sorted(folder.rglob("*.[ch]"))]


def relative(path: Path) -> str:
    """The name of a file as other files include it."""
    return path.relative_to(EFFECTS.parent if path.is_relative_to(EFFECTS) else RUNTIME).as_posix()


def lines(name: str, arithmetic: str, engine: str) -> set[tuple[str, int]]:
    """The files that a unit is made of, each with the numbers of the lines that are compiled for its model."""
    one = _compensator(name, arithmetic, engine)
    found = set()
    guards = GUARDS * (name in SERVED)
    for file in {*one.variant.sources(), *one.family.kernel_files, *_states(one), *_blocks(one), *guards}:
        folder = EFFECTS.parent if file.startswith("effects/") else RUNTIME
        text = (folder / file).read_text(encoding="utf-8").splitlines()
        numbered = "".join(f"{line}\n" if line.startswith("#") else f"{n}\n" for n, line in enumerate(text, 1))
        own = numbered + "hystgen_operator_t\n" * any("hystgen_operator_t" in line for line in text)
        facts = one.family.facts | one.variant.facts | _kernel_facts(one)
        chosen = "".join(runtime.forms(own, facts)).splitlines()
        found |= {(file, int(line)) for line in chosen if line.isdecimal()}
    return found


def _compensator(name: str, arithmetic: str, engine: str) -> EmittedModel:
    """With the types that models share, from which nothing is left out; models in service have all that service
    needs, with constant numbers: emission hands those of a unit through."""
    one, served = model(name), name in SERVED
    return module.compensator(
        one,
        Options(
            "both", arithmetic, engine, "shared-runtime", health=served, tables="runtime" if served else "constant"
        ),
    )


def _kernel_facts(one: EmittedModel) -> frozenset[str]:
    """What kernels know that models do not share."""
    return replace(one, options=replace(one.options, layout="self-contained")).kernel_facts


def _states(one: EmittedModel) -> list[str]:
    """The headers with the memory of an instance, or of the blocks that it is made of."""
    if one.glue:
        return [runtime.CHAIN_TYPES] * one.variant.chain
    return [runtime.CORNER_STATE]


def _blocks(one: EmittedModel) -> list[str]:
    """The files of blocks, without those of a preview, a delay, a quiet drive and two branches that the model lacks."""
    if not one.compiled:
        return []
    t = one.compiled.tables
    missing = {
        "delay/preview": not len(t.tap), "delay/delay": not t.number_of("wait"), "lag/quiet": not t.quiet,
        "lag/steady": not t.turning,
    }  # fmt: skip
    left_out = tuple(f"effects/{name}" for name, absent in missing.items() if absent)
    return [file for file in one.family.chain_blocks if not file.startswith(left_out)]


def _included(file: str, facts: frozenset[str], absent: frozenset[str] = frozenset()) -> list[str]:
    """Lines that put a file into a unit; a file for either operator appears in the form of each, as in emission, and
    without the functions that are absent."""
    text = ((EFFECTS.parent if file.startswith("effects/") else RUNTIME) / file).read_text(encoding="utf-8")
    forms = runtime.forms(text, facts)
    if len(forms) == 1:
        return [f'#include "{file}"']
    pieces = {piece.name: piece.text for form in forms for piece in runtime.split_pieces(form)}
    return [text for name, text in pieces.items() if name not in absent]


def write(folder: Path, name: str, arithmetic: str, engine: str) -> Path:
    """The unit of both operators of a model, with its kernels."""
    one = _compensator(name, arithmetic, engine)
    chain, loop = one.variant.chain, one.family.loop
    facts = one.family.facts | one.variant.facts | _kernel_facts(one)
    types = [state.text for state in one.glue.states.values()] if one.glue else []
    if name in SERVED:
        types += [
            '#include "compensator/health.h"', degauss.instance().text,
            "typedef struct {\n    int unit;\n} hystgen_parameters_t;",
        ]
    api = ["compensator/api.h", *["compensator/chain/api.h"] * chain]
    absent = runtime.DRIVEN - {*runtime.own_calls(one.variant)}
    text = "\n".join(
        [
            "#define HYSTGEN_CONFIGURED",
            *["#define HYSTGEN_CHAIN"] * chain,
            *["#define HYSTGEN_LOOP", "#define HYSTGEN_STATUS_SLEW_LIMITED 16u /* never set */"] * loop,
            *(f"#define {fact}" for fact in sorted(one.variant.facts | _kernel_facts(one))),
            '#include "hystgen_runtime.h"',
            f"#define HYSTGEN_CORNERS {one.corners}",
            *interface.defined(one, interface.limits(one)),
            *interface.status(one),
            *(f"#define HYSTGEN_{macro} {value}" for macro, value, _ in one.numbers.macros),
            *(f'#include "{header}"' for header in _states(one)),
            *types,
            *(line for header in api for line in _included(header, facts, absent)),
            *(f'#include "{file}"' for file in one.family.kernel_files),
            *(table.text for table in (*one.numbers.plays, *one.numbers.beside)),
            *(f'#include "{file}"' for file in _blocks(one)),
            module.front(one),
            *(line for file in (*one.variant.sources(), *GUARDS * (name in SERVED)) for line in _included(file, facts)),
        ]
    )
    own = text.replace(f"{one.names.rt}_", "hystgen_").replace(f"{one.names.RT}_", "HYSTGEN_")
    source = folder / f"unit_{name}_{arithmetic}_{engine}.c"
    source.write_text(own + "\n")
    return source
