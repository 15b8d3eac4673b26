"""Other parameters for an inverse that runs: the bit-exact reference of `c_runtime/compensator/exchange.c`."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from hystgen.basics import jit
from hystgen.compensator import reference
from hystgen.compensator.layout import FixedTables, Tables
from hystgen.plays import loop
from hystgen.plays.slots import OP_CARRY, OP_EXPECTED

if TYPE_CHECKING:
    from hystgen.compensator.chain.layout import ChainTables

AnyTables: TypeAlias = "Tables | FixedTables | ChainTables"


def exchange(old: AnyTables, new: AnyTables, state: Any) -> tuple[Any, Any]:
    """The change of the drive that the tables `new` make for the displacement that an inverse with the tables `old`
    expects now, and the memory (of the same kind as `state`, which is left alone) to go on with if they are taken.

    Both are of engine loop. Each play stays as near to where it is as the one before it allows, beginning with play 0,
    which is at the input for the last drive, and comes to rest there if an effect moves or bends it; states of other
    effects go on. In fixed point, the sizes of codes are equal.
    """
    with jit.plain():
        taken = copy.deepcopy(state)
        step = _plays(old, taken).step
        if step.has_pending[0]:
            _absorbed(old, taken, step.pending[0])
            step.has_pending[0] = 0
        kept = carried(new, copy.deepcopy(taken))
        answered = copy.deepcopy(kept)
        u = _expected(old, taken)
        before = reference.operations(old, True).step(old, taken, u)
        after = reference.operations(new, True).step(new, answered, u)
    jump = after - before
    if old.fixed:
        most = old.limits.code_max[0]
        jump = min(max(jump, -most), most)
    return jump, kept


def carried(t: AnyTables, state: Any) -> Any:
    """The memory of an inverse, carried over to the plays of other tables."""
    step = _plays(t, state).step
    if isinstance(t, Tables | FixedTables):
        loop.project(t, state, reference.front(t).front_forward(t, step.drive[0], step.ascending[0]))
    else:
        _called(t, state, OP_CARRY)
    step.repeated[0] = 0
    return state


def _plays(t: AnyTables, state: Any) -> Any:
    return state if isinstance(t, Tables | FixedTables) else state.plays


def _absorbed(t: AnyTables, state: Any, drive: Any) -> None:
    """Absorb a drive; a step, not this, reports status and compares with the last reference."""
    step = _plays(t, state).step
    last, status = step.last[0], step.status[0]
    reference.operations(t, True).visit(t, state, drive)
    step.last[0], step.status[0] = last, status


def _expected(t: AnyTables, state: Any) -> Any:
    """The displacement that the model expects of the last drive."""
    if isinstance(t, Tables | FixedTables):
        shown = copy.deepcopy(state)
        reference.operations(t, True).visit(t, shown, shown.step.drive[0])
        return shown.step.last[0]
    return _called(t, copy.deepcopy(state), OP_EXPECTED)


def _called(t: ChainTables, state: Any, which: int) -> Any:
    """The answer of a call that only models with effects have."""
    answer, status = np.zeros(1, t.threshold.dtype), np.zeros(1, np.uint8)
    call = np.array([which], np.uint8)
    reference.operations(t, True).run(t, state, call, np.zeros(1, t.threshold.dtype), answer, status)
    return answer[0]
