"""The emitted files and what calls them, on disk and ready to compile."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

from hystgen.emission import files, module
from hystgen.emission.options import Options
from hystgen.model import Model
from hystgen.plays import slots

CALLS = {"init": slots.OP_INIT, "reset": slots.OP_RESET, "commit": slots.OP_COMMIT}


@dataclass(frozen=True)
class Sources:
    """C files by what they are: the module with its run time, and what the verification adds."""

    name: str
    operators: tuple[str, ...]
    module: tuple[Path, ...]
    harness: Path
    selftest: Path | None = None  # not all that is run is emitted

    @property
    def emitted(self) -> tuple[Path, ...]:
        """What a user gets: the module, and its self-test where there is one."""
        return self.module if self.selftest is None else (*self.module, self.selftest)

    @property
    def all(self) -> tuple[Path, ...]:
        """Every C file."""
        return (*self.emitted, self.harness)


def harness(name: str, operators: tuple[str, ...]) -> str:
    """The C that runs recorded calls of NAME_OP_step and the like."""
    return module.render("harness.c.j2", SimpleNamespace(name=name, operators=operators, calls=CALLS))


def write(folder: Path, model: Model, options: Options) -> Sources:
    """Write the emitted files and the harness into `folder`."""
    name = model.name
    texts = module.files(model.parameters, model.cascade, options)
    operators = tuple(op for op in ("forward", "inverse") if getattr(options, op))
    if options.layout == "single-header":
        texts[f"{name}.c"] = f'#define {name.upper()}_IMPLEMENTATION\n#include "{name}.h"\n'
    texts["hystgen_harness.c"] = harness(name, operators)
    paths = {path.name: path for path in files.write(folder, texts) if path.suffix == ".c"}
    selftest, caller = paths.pop(f"{name}_selftest.c"), paths.pop("hystgen_harness.c")
    return Sources(name, operators, tuple(paths.values()), caller, selftest)
