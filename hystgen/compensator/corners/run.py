"""Calls of both operators one after another, whatever they are made of."""

from __future__ import annotations

from types import ModuleType
from typing import Any

from hystgen.basics.jit import jit
from hystgen.compensator.step import Operations
from hystgen.plays.corners.memory import STATUS, Reals
from hystgen.plays.slots import OP_COMMIT, OP_INIT, OP_RESET, ZERO, Bytes


def made_of(forward: ModuleType, inverting: ModuleType, front_forward: Any, front_inverse: Any) -> Operations:
    """The operations of an operator each, from a module of this package that has its functions, and of the front."""
    forward_init, forward_reset, forward_step = forward.forward_init, forward.forward_reset, forward.forward_step
    inverse_init, inverse_reset, inverse_step = inverting.inverse_init, inverting.inverse_reset, inverting.inverse_step
    forward_visit, inverse_visit = forward.forward_visit, inverting.inverse_visit
    inverse_commit = inverting.inverse_commit

    @jit
    def init(t: Any, m: Any, inverse: int) -> None:
        """Start memory of the parameter file."""
        if inverse:
            inverse_init(t, m)
        else:
            forward_init(t, m)

    @jit
    def visit(t: Any, m: Any, inverse: int, v: Any) -> None:
        """Let the actuator be at drive v before the next sample."""
        if inverse:
            inverse_visit(t, m, v)
        else:
            forward_visit(t, m, v)

    @jit
    def run(t: Any, m: Any, inverse: int, op: Bytes, x: Reals, answers: Reals, status: Bytes) -> None:
        """Operations op[i] with argument x[i]; answers[i] is that of a step, else 0; status[i] is read and cleared."""
        for i in range(len(op)):
            answers[i] = t.limits[ZERO]
            if op[i] == OP_INIT:
                init(t, m, inverse)
            elif op[i] == OP_COMMIT:
                inverse_commit(t, m, x[i])
            elif inverse:
                if op[i] == OP_RESET:
                    inverse_reset(t, m, x[i])
                else:
                    answers[i] = inverse_step(t, m, x[i])
            elif op[i] == OP_RESET:
                forward_reset(t, m, x[i])
            else:
                answers[i] = forward_step(t, m, x[i])
            status[i] = m.counts[STATUS]
            m.counts[STATUS] = 0

    return Operations(init, visit, run, forward_step, inverse_step, front_forward, front_inverse)
