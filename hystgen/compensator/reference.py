"""The bit reference: the emitted C, operation for operation, of the functions for the tables it is given."""

from __future__ import annotations

import functools
import types
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.jit import bind_together, compile_together
from hystgen.compensator.layout import FixedTables, Tables


def reference(t: Tables | FixedTables, compiled: bool = True) -> types.SimpleNamespace:
    """The bit reference of the tables' arithmetic and engine, compiled or plain Python.

    It has `new_state`, and of the functions it is made of `init`, `visit` and `run` are what a session needs.
    """
    fixed_point = type(t).__name__ == "FixedTables"
    front = bool(t.fronts) if fixed_point else len(t.stage_kind) > 0  # type: ignore[union-attr]
    return _reference(fixed_point, t.engine == 0, front, compiled)


@functools.cache
def _reference(fixed_point: bool, corners: bool, front: bool, compiled: bool) -> types.SimpleNamespace:
    from hystgen.compensator import step, step_fixed
    from hystgen.compensator.corners import (
        forward,
        forward_fixed,
        forward_front,
        inverse,
        inverse_fixed,
        inverse_front,
        inverse_front_fixed,
        run,
    )
    from hystgen.front import compensator
    from hystgen.front.tanh import kernels
    from hystgen.plays import loop
    from hystgen.plays.corners import corners_fixed, corners_float  # fmt: skip
    from hystgen.plays.corners.memory import new_fixed_memory, new_memory

    functions: list[Callable[..., Any]]
    inlined: set[Callable[..., Any]]
    new_state: Callable[..., Any] = loop.new_state
    if not corners:
        functions = step_fixed.COMPILED if fixed_point else [kernels.tanh, kernels.atanh, *step.COMPILED]
        inlined = step_fixed.INLINED if fixed_point else step.INLINED
    else:
        modules: tuple[Any, ...]
        if fixed_point:
            functions = list(step_fixed.SHARED)
            modules = (corners_fixed, forward_fixed, inverse_front_fixed if front else inverse_fixed)
        else:
            functions = [kernels.tanh, kernels.atanh, *compensator.FRONT]
            modules = (corners_float, *((forward_front, inverse_front) if front else (forward, inverse)))
        inlined = set()
        for module in modules:
            functions += [function for function in module.COMPILED if function not in functions]
            inlined |= module.INLINED
        functions += run.COMPILED
        memory = new_fixed_memory if fixed_point else new_memory

        def new_state(t: Any) -> Any:
            return memory(len(t.threshold) - 1, t.threshold.dtype)

    made = compile_together(functions, inlined) if compiled else bind_together(functions)
    made.new_state = new_state
    return made


def answers(
    t: Tables | FixedTables, inverse: bool, call: Any, x: Any, compiled: bool = True
) -> tuple[NDArray[Any], NDArray[np.uint8]]:
    """What the bit reference makes of operations `call` with arguments `x` from the start on, and its status."""
    code = reference(t, compiled)
    state = code.new_state(t)
    code.init(t, state, int(inverse))
    x = np.asarray(x).astype(t.threshold.dtype)
    found, status = np.zeros_like(x), np.zeros(len(x), dtype=np.uint8)
    code.run(t, state, int(inverse), np.asarray(call, dtype=np.uint8), x, found, status)
    return found, status
