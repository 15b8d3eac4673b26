"""The emitted files and their harness, on disk and ready to compile."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from hystgen.arithmetic import ARITHMETICS, FLOAT32, Arithmetic
from hystgen.basics import writing
from hystgen.compensator.chain.layout import TRAVEL_BITS, VERIFIED_SHARE
from hystgen.emission import block, module, runtime
from hystgen.emission.chain import settings
from hystgen.emission.options import Options
from hystgen.model import Model
from hystgen.plays import slots

if TYPE_CHECKING:
    from hystgen.compensator.health import Watch

CALLS = {"init": slots.OP_INIT, "reset": slots.OP_RESET, "commit": slots.OP_COMMIT}
@dataclass(frozen=True)
class Sources:
    """C files by role: the module with its run time, and the files that the verification adds.

    `sha256`: of the files that `emit` writes, by name.
    """

    name: str
    operators: tuple[str, ...]
    module: tuple[Path, ...]
    harness: Path
    selftest: Path | None = None  # code that is not emitted has none
    sha256: Mapping[str, str] = field(default_factory=dict)
    coded: bool = False  # whether the inverse steps from code to code
    watched: bool = False  # whether the error of the model is watched

    @property
    def emitted(self) -> tuple[Path, ...]:
        """The files that a user gets: the module and, if it has one, its self-test."""
        return self.module if self.selftest is None else (*self.module, self.selftest)

    @property
    def all(self) -> tuple[Path, ...]:
        """Every C file."""
        return (*self.emitted, self.harness)


def harness(
    name: str,
    operators: tuple[str, ...],
    more: Mapping[str, Sequence[str]] = MappingProxyType({}),
    arithmetic: Arithmetic = FLOAT32,
    coded: bool = False,
    columns: int = 0,
    watch: Watch | None = None,
    block: Sequence[str] = (),
) -> str:
    """The C that runs recorded calls of NAME_OP_step and the like; `more`: further calls of this model, by operator;
    `coded`: whether the inverse steps from code to code; `columns`: number of those that are set; `watch`: of the
    model's error; `block`: bytes of its parameters, if it loads them."""
    chain = {op: list(_chain_calls(name, op, more.get(op, ()), arithmetic, columns)) for op in operators}
    return runtime.template(
        "harness.c.j2", name=name, operators=operators, calls=CALLS, call_bits=slots.OP_CALL, unread=slots.OP_UNREAD,
        chain=chain, coded=coded, watch=watch, block=block,
    )


def _chain_calls(
    name: str, op: str, more: Sequence[str], arithmetic: Arithmetic, columns: int
) -> Iterator[tuple[int, str]]:
    """The number and the statement of each call that only models with effects have.

    In fixed point, travels have more bits than codes: those set are multiples of 2^TRAVEL_BITS, and the low bits are
    compared.
    """
    own = f"{name}_{op}"
    for number, call, given in settings(more, columns):
        wide = arithmetic.travels > 1 and call == "set_travel"
        travel = f" * ((int64_t)1 << {TRAVEL_BITS})" if wide else ""
        yield number, f"{own}_{call}(&self, {given}x[i]{travel})"
    if "travel" in more:
        yield slots.OP_TRAVELLED, f"answer[i] = ({name}_real_t){own}_travel(&self)"
    if "expected" in more:
        share = arithmetic.share(VERIFIED_SHARE)
        yield slots.OP_EXPECTED, f"answer[i] = {own}_expected(&self)"
        yield slots.OP_CORRECT, f"{own}_correct(&self, x[i], ({name}_real_t){share})"


def write(folder: Path, model: Model, options: Options, parameters: str = "") -> Sources:
    """Write the emitted files and the harness into `folder`; `parameters`: hash of those in the file, by default of the
    model's."""
    name = model.name
    emitted = module.of(model, options, parameters)
    texts, calls, coded = module.files(emitted), emitted.compensator.calls, emitted.compensator.variant.coded
    watch = emitted.compensator.watch
    sha256 = {file: hashlib.sha256(text.encode("ascii")).hexdigest() for file, text in texts.items()}
    if options.layout == "single-header":
        texts[f"{name}.c"] = f'#define {name.upper()}_IMPLEMENTATION\n#include "{name}.h"\n'
    arithmetic, words = ARITHMETICS[options.arithmetic], block.words(emitted.parameters)
    columns = len(emitted.compensator.columns)
    texts["hystgen_harness.c"] = harness(name, options.operators, calls, arithmetic, coded, columns, watch, words)
    paths = {path.name: path for path in writing.write_files(folder, texts) if path.suffix == ".c"}
    selftest, caller = paths.pop(f"{name}_selftest.c"), paths.pop("hystgen_harness.c")
    return Sources(name, options.operators, tuple(paths.values()), caller, selftest, sha256, coded, watch is not None)
