"""Functions that numba compiles when they are first called, or first needed by another compiled function.

    @jit
    def followed(state, x, r): ...

`followed` then runs compiled, wherever it is called from. Inside `with plain():` it runs as Python instead, as
`followed.interpreted`, which calls other such functions directly; `followed.py_func` is the function as written. Numba
is imported at the first call that needs it; without numba everything runs as Python and gives the same bits.

Compiled code is cached on disk; its cache key contains the source of every function involved, so a change in a helper
can never leave a stale caller behind. The cache saves time but is not required: if no folder is writable, nothing is
cached; unreadable cached files are rebuilt.
"""

from __future__ import annotations

import collections
import contextlib
import contextvars
import functools
import hashlib
import importlib.util
import inspect
import types
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, Generic, ParamSpec, TypeAlias, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

from hystgen.basics import extras

if TYPE_CHECKING:
    from hystgen.basics.packed import Packed

P = ParamSpec("P")
R = TypeVar("R")

Scalar: TypeAlias = float
"""A number given to a function of any arithmetic: a real, or a code in fixed point, since an `int` is a `float` too.
Functions for fixed point alone take and return an `int`."""

Element: TypeAlias = int
"""A number from an array, in the arithmetic of that array. To mypy it is an `int`, which may stand for either a code or
a real."""

N = TypeVar("N", int, float)
"""A number in the same arithmetic as another one."""

Answer: TypeAlias = Callable[..., Scalar]
LimitedAnswer: TypeAlias = Callable[..., tuple[Scalar, int]]
Action: TypeAlias = Callable[..., None]
Check: TypeAlias = Callable[..., bool]
"""Functions of tables, memory and numbers, by what they return: a number; a number and whether it had to be limited;
nothing; yes or no. Tables and memory differ from block to block, so callers cannot name their types."""

# Called once, with a message for the user, before the first function that is missing from the cache is compiled, or run
# as Python if there is no numba
announce: Callable[[str], None] | None = None

ONCE = "compiling Python functions for this machine, once: up to 10 s, or 30 s if the C has effects"
EVERY_TIME = (
    "compiling Python functions for this machine: up to 10 s, or 30 s if the C has effects, and again in every run, "
    "because no cache folder is writable; set NUMBA_CACHE_DIR to one that is"
)


def interpreted() -> str:
    """The message for a machine without numba."""
    return f"computing in plain Python, which is slower than compiled code; for compiled code:  {extras.install('fit')}"


# The functions allocate nothing, so reference counting, which would take most of a sample's time, is disabled
OPTIONS: dict[str, object] = {"error_model": "numpy", "_nrt": False, "nogil": True}

_plain = contextvars.ContextVar("plain", default=False)

SHORT = 10_000
"""[samples] Number that a process handles in Python, per function and data type, before it compiles or loads the
function: 0.3 s for a plain model, whose functions take 2 s to compile, and 0.8 s with many effects, which take 16 s.
Set by: `verify` of `mixed` and `everything` of tests/modelfiles.py, inverse, 0.028 and 0.083 ms a sample."""

_samples: collections.Counter[tuple[object, np.dtype[np.generic]]] = collections.Counter()


@contextlib.contextmanager
def plain() -> Iterator[None]:
    """Context in which functions run as plain Python, for signals too short to be worth compiling or loading code.

    Overflow and NaN raise no warning, as in compiled code.
    """
    before = _plain.set(True)
    try:
        with np.errstate(all="ignore"):
            yield
    finally:
        _plain.reset(before)


def for_samples(
    function: Callable[..., object], samples: NDArray[np.generic], following: int = 0
) -> contextlib.AbstractContextManager[None]:
    """`plain` until `function` has been given `SHORT` samples of this type outside of `plain`, then a null context.

    `following`: number of samples that are known to come next, so that none of them runs as Python if they are too many
    for it altogether.
    """
    if _plain.get():
        return contextlib.nullcontext()
    key = function, samples.dtype
    _samples[key] += len(samples)
    return plain() if _samples[key] + following <= SHORT else contextlib.nullcontext()


class Jit(Generic[P, R]):
    """A function that runs compiled; `py_func` is the original in Python."""

    def __init__(self, function: Callable[P, R], inline: bool) -> None:
        functools.update_wrapper(self, function)
        self.py_func = function
        self.targetoptions = {**OPTIONS, "inline": "always" if inline else "never"}
        """numba's options, which numba reads when another function calls this one"""
        self._packed: dict[int, Packed] = {}

    def __call__(self, *given: P.args, **named: P.kwargs) -> R:
        if _plain.get():
            return self.interpreted(*given, **named)
        if _has_numba():
            passed = [self._passed(k, x) if isinstance(x, tuple) else x for k, x in enumerate(given)]
            return self.entry(*passed, **named)  # type: ignore[no-any-return]
        _announce(interpreted)
        with plain():
            return self.interpreted(*given, **named)

    def _passed(self, place: int, given: tuple[object, ...]) -> object:
        """An argument as compiled code takes it. A call for each sample passes the same tables and memory, whose words
        take ten times as long to write as a sample to compute; they are kept until others come."""
        if not hasattr(given, "_fields"):
            return given
        from hystgen.basics.packed import Packed

        last = self._packed.get(place)
        if last is None or last.kept[0] is not given:
            last = self._packed[place] = Packed(given)
        return last

    @functools.cached_property
    def interpreted(self) -> Callable[P, R]:
        """A copy of `py_func` that calls the same kind of copy of other jitted functions. This halves the time that a
        record takes, since a step makes some hundred calls, each of which would have to decide how to run."""
        made: list[types.FunctionType] = []
        todo = [self]
        for one in todo:  # grows in the loop
            if "interpreted" not in one.__dict__:
                made.append(_copy(one.py_func, dict(one.py_func.__globals__)))
                one.__dict__["interpreted"] = made[-1]
                parts = [*made[-1].__globals__.values(), *(cell.cell_contents for cell in made[-1].__closure__ or ())]
                todo += [each for each in parts if isinstance(each, Jit)]
        for function in made:
            names = function.__globals__
            names.update({key: each.interpreted for key, each in names.items() if isinstance(each, Jit)})
            for cell in function.__closure__ or ():
                if isinstance(cell.cell_contents, Jit):
                    cell.cell_contents = cell.cell_contents.interpreted
        return self.__dict__["interpreted"]  # type: ignore[no-any-return]

    @functools.cached_property
    def entry(self) -> Any:
        """The function compiled by numba, to be called from Python."""
        return self._dispatcher("entry", self.targetoptions)

    @functools.cached_property
    def inner(self) -> Any:
        """The function compiled by numba, to be called from compiled code only, without wrappers for other callers."""
        return self._dispatcher("inner", {**self.targetoptions, "no_cpython_wrapper": True, "no_cfunc_wrapper": True})

    def _dispatcher(self, kind: str, options: dict[str, Any]) -> Any:
        import numba

        _listen()
        twin = _copy(self.py_func, self.py_func.__globals__)
        twin.__qualname__ = f"{twin.__name__}_{kind}_{self.mark}"
        made: Any = numba.njit(**options)(twin)
        with contextlib.suppress(RuntimeError):  # no folder is writable
            made._cache = _cache_class()(twin)  # what its enable_caching does with numba's own class
        return made

    @property
    def _numba_type_(self) -> object:
        """Numba's type of the function when another one calls it."""
        from hystgen.basics.packed import Callee

        return Callee(self.inner)

    @functools.cached_property
    def mark(self) -> str:
        """A hash of everything the compiled code depends on: constants, and the source of `packed`, of the function and
        of all functions it calls."""
        from hystgen.basics import packed

        text, functions = repr(OPTIONS) + _source(packed), [self]
        for function in functions:
            text += _source(function.py_func.__code__) + repr(function.targetoptions)
            names = inspect.getclosurevars(function.py_func)
            for name, value in sorted({**names.globals, **names.nonlocals}.items()):
                if isinstance(value, int | float | tuple):  # numba freezes them into the compiled code
                    text += f"{name} = {value!r}\n"
                elif isinstance(value, Jit) and not any(value is each for each in functions):
                    functions.append(value)
        return hashlib.sha256(text.encode()).hexdigest()[:12]


@functools.cache
def _source(of: types.ModuleType | types.CodeType) -> str:
    """The source text, cached, since a function is in the marks of all that call it."""
    return inspect.getsource(of)


def _copy(function: Callable[..., object], names: dict[str, object]) -> types.FunctionType:
    """A copy of the function with these globals, and with new closure cells that hold the same values."""
    assert isinstance(function, types.FunctionType)
    cells = tuple(types.CellType(cell.cell_contents) for cell in function.__closure__ or ())
    made = types.FunctionType(function.__code__, names, function.__name__, function.__defaults__, cells or None)
    made.__module__ = function.__module__
    return made


@overload
def jit(function: Callable[P, R], /) -> Jit[P, R]: ...
@overload
def jit(*, inline: bool) -> Callable[[Callable[P, R]], Jit[P, R]]: ...
def jit(function: Callable[..., object] | None = None, /, *, inline: bool = False) -> Any:
    """Compile a function; `inline` inlines it into its callers, as suits a short one and one with a single caller:
    compiling each function by itself takes 0.1 s, and its code is optimized again in every caller."""
    if function is None:
        return functools.partial(Jit, inline=inline)
    return Jit(function, inline)


@functools.cache
def _cache_class() -> Any:
    """Numba's cache of a function, changed to treat a file that it cannot read or write as missing."""
    from numba.core.caching import FunctionCache

    class Cache(FunctionCache):
        def _index_key(self, sig: Any, codegen: Any) -> Any:
            # The name contains the hash of everything the code depends on; numba would pickle the closure's contents
            return sig, codegen.magic_tuple(), self._py_func.__qualname__

        def load_overload(self, sig: object, target_context: object) -> object:
            try:
                return super().load_overload(sig, target_context)  # type: ignore[no-untyped-call]
            except Exception:  # unpickling half a file may raise anything
                with contextlib.suppress(OSError):
                    self.flush()  # type: ignore[no-untyped-call]
                return None

        def save_overload(self, sig: object, data: object) -> None:
            with contextlib.suppress(OSError):
                super().save_overload(sig, data)  # type: ignore[no-untyped-call]

    return Cache


def _cache_folder() -> str | None:
    """Folder in which this package's compiled code is cached; None if no folder is writable."""
    try:
        return str(_cache_class()(_cache_folder).cache_path)
    except RuntimeError:
        return None


@functools.cache
def _has_numba() -> bool:
    return importlib.util.find_spec("numba") is not None


def _announce(text: Callable[[], str]) -> None:
    global announce
    if announce:
        announce(text())
        announce = None


@functools.cache
def _listen() -> None:
    """Call `announce` when numba starts to compile."""
    from numba.core import event

    class FirstCompilation(event.Listener):
        def on_start(self, _: object) -> None:
            _announce(lambda: ONCE if _cache_folder() else EVERY_TIME)

        def on_end(self, _: object) -> None:
            pass

    register: Callable[[str, event.Listener], None] = event.register
    register("numba:compile", FirstCompilation())


@jit(inline=True)
def inside(x: N, least: N, most: N) -> N:
    """x within limits."""
    return least if x < least else most if x > most else x


@jit(inline=True)
def zero(x: N) -> N:
    """0 in the type of x, which is finite."""
    return x - x
