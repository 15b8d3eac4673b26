"""The files of `c_runtime/` as they stand, in one unit with the numbers of a model: nothing is renamed or picked.

The model is called `hystgen`, so that its macros and tables have the names that the files use.
"""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

from modelfiles import BRAKED, CALM, CHAINS, LED, STEADY
from mutants import MODELS

from hystgen.emission import module, runtime
from hystgen.emission.options import Options
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters

RUNTIME = runtime.data_folder("c_runtime")

DEFINES = {
    "float32": [],
    "float64": ["-DHYSTGEN_REAL_IS_DOUBLE"],
    "q31": ["-DHYSTGEN_FIXED"],
    "q15": ["-DHYSTGEN_FIXED", "-DHYSTGEN_REAL_IS_SHORT"],
}
"""What `hystgen_runtime.h` asks a build for."""

FLAGS = ["-ffp-contract=off", "-Wno-unused-function", "-Wno-unused-parameter"]
"""A file has functions and parameters for every model; emission leaves out those that one model has no use for."""

UNITS = (
    ("two_branches", "float32", "loop"),
    ("two_branches", "q15", "loop"),
    ("two_branches", "float32", "corners"),
    ("listed", "float64", "loop"),
    ("bent", "q31", "loop"),
    ("bent", "q31", "corners"),
    ("bent", "float64", "corners"),
    ("plain", "float32", "corners"),
    ("plain", "q15", "corners"),
    ("above", "q31", "corners"),
    ("far_low", "q15", "loop"),
    ("lagging", "float32", "loop"),
    ("quick", "float64", "loop"),
    ("warm", "float32", "loop"),
    ("aged", "float32", "loop"),
    ("viscous", "float32", "loop"),
    ("dilated", "float64", "loop"),
    ("dashpot", "float32", "loop"),
    ("bumpy", "float32", "loop"),
    ("viscous_twin", "float32", "loop"),
    ("everything", "float32", "loop"),
    ("everything", "q31", "loop"),
    ("relaxing", "float32", "loop"),
    ("lagging", "q15", "loop"),
    ("quick", "q31", "loop"),
    ("warm", "q31", "loop"),
    ("worn", "q15", "loop"),
    ("straight", "q31", "loop"),
    ("relaxing", "q15", "loop"),
    ("wider", "q31", "loop"),
    ("viscous_twin", "q15", "loop"),
    ("bumpy", "q15", "loop"),
    ("soft_dashpot", "q31", "loop"),
    ("dilated", "q15", "loop"),
    ("drifting", "float32", "loop"),
    ("drifting_late", "q15", "loop"),
    ("heated", "float64", "loop"),
    ("rubbed", "float32", "loop"),
    ("rubbed", "q15", "loop"),
    ("heated", "q31", "loop"),
    ("calm", "float32", "loop"),
    ("calm", "q15", "loop"),
    ("braked", "q31", "loop"),
    ("steady", "float32", "loop"),
    ("steady", "q15", "loop"),
    ("creeping", "float32", "corners"),
    ("led", "q31", "corners"),
)
"""Every file of `c_runtime/` is in one of them."""


def model(name: str) -> Model:
    """The model of a parameter file under the name of the run time."""
    text = {**MODELS, **CHAINS, **LED, "calm": CALM, "braked": BRAKED, "steady": STEADY}[name]
    return Model(parse_parameters(text, f"{name}.yaml").model_copy(update={"name": "hystgen"}))


def files(name: str, arithmetic: str, engine: str) -> set[str]:
    """The files that a unit is made of."""
    values = _values(name, arithmetic, engine)
    return {*values.variant.sources(), *values.family.kernel_files, *_states(values), *_blocks(values)}


def _values(name: str, arithmetic: str, engine: str) -> SimpleNamespace:
    one = model(name)
    return module.values_of(one.parameters, one.cascade, Options("both", arithmetic, engine, "self-contained"))


def _states(values: SimpleNamespace) -> list[str]:
    """The headers with the memory of an instance, or of the blocks that it is made of."""
    if values.instances:
        return [values.family.chain_types[1]] * values.variant.chain
    return [values.variant.state(op) for op in ("forward", "inverse")]


def _blocks(values: SimpleNamespace) -> list[str]:
    """The files of blocks, without those of a preview, a delay, a quiet drive and two branches where there are none."""
    if not values.variant.chain:
        return []
    blocks = runtime.FIXED_CHAIN_BLOCKS if values.fixed else runtime.CHAIN_BLOCKS
    t = values.numbers
    missing = {
        "preview": not len(t.tap), "delay": not t.delay.samples, "quiet": not t.quiet, "lag_steady": not t.turning,
    }  # fmt: skip
    left_out = tuple(name for name, absent in missing.items() if absent)
    return [file for file in blocks if not file.startswith(left_out)]


def write(folder: Path, name: str, arithmetic: str, engine: str) -> Path:
    """The unit of both operators of a model, with its kernels."""
    values = _values(name, arithmetic, engine)
    operators = ("forward", "inverse")
    apis = [f"hystgen_{op}_api.h" for op in operators]
    chain, loop = values.variant.chain, values.family.loop
    headers = [*_states(values), *([] if values.instances else apis)]
    more = [f"hystgen_chain_{op}_api.h" for op in operators] * chain
    types = [] if not values.instances else [
        *([f'#include "{values.family.chain_types[0]}"'] * chain), *values.instances.values(),
        *(f'#include "{header}"' for header in (*apis, *more)),
    ]  # fmt: skip
    text = "\n".join(
        [
            *["#define HYSTGEN_CHAIN"] * chain,
            *["#define HYSTGEN_LOOP", "#define HYSTGEN_STATUS_SLEW_LIMITED 16u /* never set */"] * loop,
            '#include "hystgen_runtime.h"',
            f"#define HYSTGEN_CORNERS {values.corners}",
            *values.limits,
            *values.status,
            *(f"#define HYSTGEN_{macro} {value}" for macro, value, _ in values.constants),
            *(f'#include "{header}"' for header in headers),
            *types,
            *(f'#include "{file}"' for file in values.family.kernel_files),
            *values.every,
            *(f'#include "{file}"' for file in _blocks(values)),
            values.functions,
            *(f'#include "{file}"' for file in values.variant.sources()),
        ]
    )
    source = folder / f"unit_{name}_{arithmetic}_{engine}.c"
    source.write_text(text + "\n")
    return source
