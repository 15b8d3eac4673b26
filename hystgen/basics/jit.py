"""Numba-compiled twins of plain Python functions, made when they are first needed.

The functions of the bit reference and of the operators run as ordinary Python (short signals, no start-up cost) and,
unchanged, compiled (long signals). Compiled code is cached on disk; its cache key contains the source of every
function that takes part, so that a change in a helper can never leave a stale caller behind. The cache saves time and
is never needed: where no folder can be written to there is none, and files of it that cannot be read are made again.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import inspect
import types
from collections.abc import Callable, Collection, Sequence
from typing import Any

# Called once, before the first function is compiled that is not in the cache, with a word to the user
announce: Callable[[str], None] | None = None

ONCE = "compiling for this machine, once: about 20 s"
EVERY_TIME = (
    "compiling for this machine: about 20 s, every time, since no folder for the result can be written to; set "
    "NUMBA_CACHE_DIR to one that can"
)

# The functions allocate nothing, so that counting references, which would take most of a sample's time, is left out
OPTIONS: dict[str, Any] = {"error_model": "numpy", "_nrt": False, "nogil": True}


def bind_together(functions: Sequence[Callable[..., Any]]) -> types.SimpleNamespace:
    """Copies of `functions`, given callees first, that call each other by name whatever module they are from."""
    return _bound(functions, lambda _, twin: twin)


def compile_together(
    functions: Sequence[Callable[..., Any]], inlined: Collection[Callable[..., Any]] = ()
) -> types.SimpleNamespace:
    """Compile `functions`, given callees first, so that they call each other's compiled form by name.

    Those in `inlined` become part of their callers: handing over a model's many tables costs more than they compute.
    """
    import numba

    _listen()
    sources = "".join(inspect.getsource(function) for function in functions) + _constants(functions) + repr(OPTIONS)
    mark = hashlib.sha256(sources.encode()).hexdigest()[:12]

    def compiled(function: Callable[..., Any], twin: types.FunctionType) -> Any:
        twin.__qualname__ = f"{twin.__name__}_{mark}"
        how = {**OPTIONS, "inline": "always" if function in inlined else "never"}
        made = numba.njit(**how)(twin)
        with contextlib.suppress(RuntimeError):  # no folder that can be written to
            made._cache = _cache_class()(twin)  # as its enable_caching does with numba's own class
        return made

    return _bound(functions, compiled)


@functools.cache
def _cache_class() -> Any:
    """Numba's cache of a function, which takes a file that it cannot read or write for one that is not there."""
    from numba.core.caching import FunctionCache

    class Cache(FunctionCache):
        def load_overload(self, sig: Any, target_context: Any) -> Any:
            try:
                return super().load_overload(sig, target_context)  # type: ignore[no-untyped-call]
            except Exception:  # whatever unpickling half a file ends in
                with contextlib.suppress(OSError):
                    self.flush()  # type: ignore[no-untyped-call]
                return None

        def save_overload(self, sig: Any, data: Any) -> None:
            with contextlib.suppress(OSError):
                super().save_overload(sig, data)  # type: ignore[no-untyped-call]

    return Cache


def _bound(
    functions: Sequence[Callable[..., Any]], finish: Callable[[Callable[..., Any], types.FunctionType], Any]
) -> types.SimpleNamespace:
    made: dict[str, Any] = {}
    for function in functions:
        assert isinstance(function, types.FunctionType)
        scope = {**function.__globals__, **made}
        twin = types.FunctionType(function.__code__, scope, function.__name__, function.__defaults__)
        twin.__module__ = function.__module__
        made[function.__name__] = finish(function, twin)
    return types.SimpleNamespace(**made)


def _constants(functions: Sequence[Callable[..., Any]]) -> str:
    """The module constants that the functions read; numba freezes them into the compiled code."""
    seen: dict[str, str] = {}
    for function in functions:
        scope = function.__globals__
        for name in function.__code__.co_names:
            if isinstance(scope.get(name), int | float | tuple):
                seen[name] = repr(scope[name])
    return repr(sorted(seen.items()))


def _cache_folder() -> str | None:
    """Where compiled code of this package is kept; None where no folder can be written to."""
    try:
        return str(_cache_class()(_cache_folder).cache_path)
    except RuntimeError:
        return None


@functools.cache
def _listen() -> None:
    """Have `announce` called when numba starts to compile."""
    from numba.core import event

    class FirstCompilation(event.Listener):
        def on_start(self, _: Any) -> None:
            global announce
            if announce:
                announce(ONCE if _cache_folder() else EVERY_TIME)
                announce = None

        def on_end(self, _: Any) -> None:
            pass

    register: Callable[[str, event.Listener], None] = event.register
    register("numba:compile", FirstCompilation())
