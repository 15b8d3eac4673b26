"""The bit reference: the emitted C, operation for operation, of the functions for the tables it is given."""

from __future__ import annotations

import contextlib
import functools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen.basics import jit
from hystgen.compensator import step, step_fixed, step_float
from hystgen.compensator.chain import step as chain_step
from hystgen.compensator.chain import step_fixed as chain_step_fixed
from hystgen.compensator.chain import step_float as chain_step_float
from hystgen.compensator.chain.layout import ChainTables, OwnChainTables
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
from hystgen.compensator.layout import FixedTables, Tables
from hystgen.compensator.step import Operations
from hystgen.effects.kinds import OwnBlock
from hystgen.front import compensator, curve
from hystgen.plays import loop
from hystgen.plays.corners.memory import new_fixed_memory, new_memory
from hystgen.plays.slots import CODE_MAX, LOOP


def operations(t: Tables | FixedTables | ChainTables) -> Operations:
    """What the bit reference is made of for the arithmetic and the engine of these tables."""
    if isinstance(t, ChainTables):
        drives, outputs = t.own_blocks if isinstance(t, OwnChainTables) else ((), ())
        return _chain_operations(t.fixed, drives, outputs)
    return _operations(t.engine == LOOP, t.fixed, t.has_front)


@functools.cache
def _operations(loops: bool, fixed: bool, front: bool) -> Operations:
    ends = (curve if fixed else compensator).front_forward, (curve if fixed else compensator).front_inverse
    if loops:
        own = step_fixed if fixed else step_float
        return step.made_of(*ends, own.output, own.inverse_solve, own.finite)
    if fixed:
        return run.made_of(forward_fixed, inverse_front_fixed if front else inverse_fixed, *ends)
    return run.made_of(forward_front, inverse_front, *ends) if front else run.made_of(forward, inverse, *ends)


@functools.cache
def _chain_operations(
    fixed: bool, drives: tuple[OwnBlock, ...], outputs: tuple[OwnBlock, ...]
) -> Operations:
    own = chain_step_fixed if fixed else chain_step_float
    return chain_step.made_of(own.BLOCKS, own.CODES, drives, outputs)


def new_state(t: Tables | FixedTables | ChainTables, inverse: bool) -> Any:
    """Memory for one instance of an operator; `init` of its operations gives it its values."""
    if isinstance(t, ChainTables):
        return chain_step.new_state(t, inverse)
    if t.engine == LOOP:
        return loop.new_state(t)
    memory = new_fixed_memory if t.fixed else new_memory
    return memory(len(t.threshold) - 1, t.threshold.dtype)


def codes(t: Tables | FixedTables | ChainTables, x: NDArray[Any]) -> NDArray[Any]:
    """Samples as fixed point takes them. Raises ValueError for what is no code."""
    with np.errstate(invalid="ignore"):  # what is no code is found below
        found = np.ascontiguousarray(x, dtype=t.threshold.dtype)
    most = int(t.limits[CODE_MAX])
    if np.any(x != found) or np.any(found < -most - 1) or np.any(found > most):
        raise ValueError(f"fixed point takes codes, whole numbers from {-most - 1} to {most}")
    return found


def answers(
    t: Tables | FixedTables | ChainTables, inverse: bool, call: Any, x: Any, compiled: bool = True
) -> tuple[NDArray[Any], NDArray[np.uint8]]:
    """What the bit reference makes of operations `call` with arguments `x` from the start on, and its status."""
    code, state = operations(t), new_state(t, inverse)
    x = np.asarray(x).astype(t.threshold.dtype)
    found, status = np.zeros_like(x), np.zeros(len(x), dtype=np.uint8)
    with contextlib.nullcontext() if compiled else jit.plain():
        code.init(t, state, int(inverse))
        code.run(t, state, int(inverse), np.asarray(call, dtype=np.uint8), x, found, status)
    return found, status
