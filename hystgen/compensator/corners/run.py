"""Calls of both operators one after another, whatever they are made of."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from hystgen.compensator.corners.forward import forward_init, forward_reset, forward_step, forward_visit
from hystgen.compensator.corners.inverse import inverse_commit, inverse_init, inverse_reset, inverse_step, inverse_visit
from hystgen.compensator.layout import Tables
from hystgen.plays.corners.memory import STATUS, Memory, Reals
from hystgen.plays.slots import OP_COMMIT, OP_INIT, OP_RESET, ZERO, Bytes


def init(t: Tables, m: Memory, inverse: int) -> None:
    """Start memory of the parameter file."""
    if inverse:
        inverse_init(t, m)
    else:
        forward_init(t, m)


def visit(t: Tables, m: Memory, inverse: int, v: Any) -> None:
    """Let the actuator be at drive v before the next sample."""
    if inverse:
        inverse_visit(t, m, v)
    else:
        forward_visit(t, m, v)


def run(t: Tables, m: Memory, inverse: int, op: Bytes, x: Reals, answers: Reals, status: Bytes) -> None:
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


COMPILED: list[Callable[..., Any]] = [init, visit, run]
