"""One instance of an emitted operator, compiled for this machine and called sample by sample."""

from __future__ import annotations

import cffi

from hystgen.arithmetic import ARITHMETICS
from hystgen.basics import writing
from hystgen.emission.options import Options
from hystgen.model import Model
from hystgen.verification import compilers, sources
from hystgen.verification.loading import load


class CompiledInstance:
    """An instance driven by NAME_OP_init and NAME_OP_step in a model's C, with values in the form that the C takes.

    `options`: those of `emit`, for a single operator. `compiler`: `gcc`, `clang` or `zig`; by default, the first that
    is installed. It is called as users call it, in its default dialect. The files are in a temporary folder. Raises
    LoadError, CompileError (also if there is no compiler), and ValueError for any other name.
    """

    def __init__(self, model: Model, options: Options, compiler: str | None = None) -> None:
        if compiler is not None and compiler not in compilers.NAMES:
            raise ValueError(f"compiler {compiler!r} is not one of {', '.join(compilers.NAMES)}")
        chosen = compilers.find(compiler) if compiler else next(iter(compilers.available()), None)
        if chosen is None:
            raise compilers.missing(compiler) if compiler else compilers.none_found()
        name, op = model.name, options.operator
        real = ARITHMETICS[options.arithmetic].c_type
        self._ffi = cffi.FFI()
        self._ffi.cdef(
            f"size_t hystgen_harness_{op}_size(void); void {name}_{op}_init(void *);"
            f"{real} {name}_{op}_step(void *, {real});"
            f"void {name}_{op}_set_influence(void *, unsigned int, {real});"
        )
        # A loaded library survives without its file; only Windows keeps the file while it is loaded
        with writing.temporary() as folder:
            library = folder / "instance.so"
            written = sources.write(folder, model, options)
            chosen.shared_library([*written.module, written.harness], library, compilers.USER)
            self._library = load(library, self._ffi.dlopen)
        size = getattr(self._library, f"hystgen_harness_{op}_size")()
        self._context = self._ffi.new("long long[]", size // 8 + 1)
        self._init = getattr(self._library, f"{name}_{op}_init")
        self._step = getattr(self._library, f"{name}_{op}_step")
        self._set_influence = f"{name}_{op}_set_influence"
        self.reset()

    def reset(self) -> None:
        """Return to the start memory of the parameter file."""
        self._init(self._context)

    def set_influence(self, i: int, value: float) -> None:
        """Set column i, for a model that follows one."""
        getattr(self._library, self._set_influence)(self._context, i, value)

    def step(self, x: float) -> float:
        """One sample."""
        answer: float = self._step(self._context, x)
        return answer
