"""The files of `c_runtime/` as they stand, in one unit with the numbers of a model: nothing is renamed or picked.

The model is called `hystgen`, so that its macros and tables have the names that the files use.
"""

from __future__ import annotations

from pathlib import Path

from modelfiles import FILES

from hystgen.emission import module, runtime
from hystgen.emission.calls import emit_options
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

FLAGS = ["-ffp-contract=off", "-Wno-unused-function"]
"""A file has functions for every model; emission leaves out those that one model does not call."""

UNITS = [
    (name, arithmetic, engine)
    for name in ("plain", "listed", "bent", "two_branches", "linear")
    for arithmetic in DEFINES
    for engine in ("corners", "loop")
]
"""Plays alone, a list to start from, one branch and two; without a play."""


def model(name: str) -> Model:
    """The model of a parameter file under the name of the run time."""
    return Model(parse_parameters(FILES[name], f"{name}.yaml").model_copy(update={"name": "hystgen"}))


def write(folder: Path, name: str, arithmetic: str, engine: str) -> Path:
    """The unit of both operators of a model, with its kernels."""
    one = model(name)
    options = emit_options(one, operator="both", arithmetic=arithmetic, engine=engine, layout="self-contained")
    values = module.values_of(one.parameters, one.cascade, options)
    operators = ("forward", "inverse")
    headers = [*map(values.variant.state, operators), *(f"hystgen_{op}_api.h" for op in operators)]
    family = values.family
    kernels = family.kernel_files
    text = "\n".join(
        [
            '#include "hystgen_runtime.h"',
            f"#define HYSTGEN_CORNERS {values.corners}",
            *values.limits,
            *values.status,
            *(f"#define HYSTGEN_{macro} {value}" for macro, value, _ in values.constants),
            *(f'#include "{header}"' for header in headers),
            *(f'#include "{file}"' for file in kernels),
            *values.arrays,
            *values.beside,
            values.glue,
            *(f'#include "{file}"' for file in values.variant.sources()),
        ]
    )
    source = folder / f"unit_{name}_{arithmetic}_{engine}.c"
    source.write_text(text + "\n")
    return source
