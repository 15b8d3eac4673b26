"""The bit-exact reference, which repeats the emitted C operation by operation, and sessions, which run it, or the same
operator in double precision, over sampled signals."""

from __future__ import annotations

import functools
import importlib
from collections.abc import Iterable
from types import ModuleType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystgen.arithmetic import ARITHMETICS
from hystgen.basics import arguments, jit
from hystgen.basics.problems import NotInvertibleError
from hystgen.chain.static import StaticModel
from hystgen.compensator import step_float, tables
from hystgen.compensator.corners import forward, inverse, inverse_front
from hystgen.compensator.layout import FixedTables, Tables
from hystgen.compensator.step import Operations
from hystgen.front import compensator
from hystgen.plays import loop
from hystgen.plays.slots import LOOP, OP_STEP, Bytes

if TYPE_CHECKING:
    from hystgen.compensator.chain.layout import ChainTables, Contents
    from hystgen.effects.kinds import OwnBlock


class Engines(NamedTuple):
    """One kind of arithmetic: the functions of its memoryless part, and its forward and inverse operators in the loop
    engine and in the corner engine, the latter without and with a memoryless part; `chain`: the module of its models
    with effects."""

    chain: str
    front: ModuleType
    loop: tuple[Operations, Operations]
    corners: tuple[tuple[Operations, Operations], tuple[Operations, Operations]]


def _engines(t: Tables | FixedTables | ChainTables) -> Engines:
    """The engines of the arithmetic of the tables."""
    return _engines_of(t.fixed)


@functools.cache
def _engines_of(fixed: bool) -> Engines:
    """The engines in floating point or in fixed point, imported only when a model needs them."""
    if not fixed:
        corners = (forward.OPERATIONS, inverse.OPERATIONS), (forward.OPERATIONS, inverse_front.OPERATIONS)
        return Engines("step_float", compensator, step_float.OPERATIONS, corners)
    from hystgen.compensator import step_fixed
    from hystgen.compensator.corners import forward_fixed, inverse_fixed, inverse_front_fixed
    from hystgen.front import curve

    forwards = forward_fixed.OPERATIONS
    corners = (forwards, inverse_fixed.OPERATIONS), (forwards, inverse_front_fixed.OPERATIONS)
    return Engines("step_fixed", curve, step_fixed.OPERATIONS, corners)


def front(t: Tables | FixedTables | ChainTables) -> ModuleType:
    """The module with the functions of the memoryless part, in the arithmetic of the tables."""
    return _engines(t).front


def operations(t: Tables | FixedTables | ChainTables, inverse: bool) -> Operations:
    """The functions of one operator in the bit-exact reference, for the arithmetic and engine of the tables."""
    found = _engines(t)
    if isinstance(t, Tables | FixedTables):
        return (found.loop if t.engine == LOOP else found.corners[t.has_front])[inverse]
    from hystgen.compensator.chain.layout import OwnChainTables

    drives, outputs = t.own_blocks if isinstance(t, OwnChainTables) else ((), ())
    return _chain_operations(found.chain, t.plays.engine == LOOP, t.contents(inverse), drives, outputs)


@functools.cache
def _chain_operations(
    module: str, loops: bool, contents: Contents, drives: tuple[OwnBlock, ...], outputs: tuple[OwnBlock, ...]
) -> Operations:
    from hystgen.compensator.chain import step as chain_step

    own = importlib.import_module(f"hystgen.compensator.chain.{module}")
    return chain_step.made_of(own.BLOCKS if loops else own.CORNERS, own.CODES, contents, drives, outputs)


def new_state(t: Tables | FixedTables | ChainTables, inverse: bool) -> Any:
    """Memory for one instance of an operator; its `init` operation sets the values."""
    if not isinstance(t, Tables | FixedTables):
        from hystgen.compensator.chain import step as chain_step

        return chain_step.new_state(t, inverse)
    if t.engine == LOOP:
        return loop.new_state(t)
    return t.new_corners()


def samples(t: Tables | FixedTables | ChainTables, x: NDArray[Any]) -> NDArray[Any]:
    """Samples in the operators' type. In fixed point, raises ValueError for numbers that are not codes."""
    with np.errstate(invalid="ignore"):  # numbers that are not codes are found below
        found = np.ascontiguousarray(x, dtype=t.threshold.dtype)
    if found.dtype.kind == "f":
        return found
    most = int(t.limits.code_max[0])
    if np.any(x != found) or np.any(found < -most - 1) or np.any(found > most):
        raise ValueError(f"fixed point takes codes, integers from {-most - 1} to {most}")
    return found


def nearest(t: Tables | FixedTables | ChainTables, x: ArrayLike) -> NDArray[Any]:
    """The given numbers, rounded to the nearest that a call accepts as arguments."""
    if t.threshold.dtype.kind == "i":
        most = int(t.limits.code_max[0])
        x = np.clip(np.rint(x), -most - 1, most)
    return np.array(x, dtype=t.threshold.dtype)


def answers(
    t: Tables | FixedTables | ChainTables, inverse: bool, call: ArrayLike, x: ArrayLike, compiled: bool = True,
    following: int = 0,
) -> tuple[NDArray[Any], NDArray[np.uint8]]:
    """Answers and status of the bit-exact reference for calls `call` with arguments `x`, from the start memory on;
    `following`: as in `jit.for_samples`."""
    code, state = operations(t, inverse), new_state(t, inverse)
    x = np.asarray(x).astype(t.threshold.dtype)
    found, status = np.zeros_like(x), np.zeros(len(x), dtype=np.uint8)
    with jit.plain():  # one pass over the memory is not worth compiling
        code.init(t, state)
    with jit.for_samples(code.run, x, following) if compiled else jit.plain():
        code.run(t, state, np.asarray(call, dtype=np.uint8), x, found, status)
    return found, status


class Session:
    """One instance of an operator, run over consecutive records.

    `operator`: 'forward' or 'inverse'. Without `arithmetic` it computes in double precision and limits nothing unless
    `clamp` is set; with it, it is the bit-exact reference of the emitted C, which clamps. `lsb`: drive and output units
    per code in fixed point, None for the finest. Raises NotInvertibleError and FormatError.
    """

    def __init__(
        self,
        cascade: StaticModel,
        operator: str = "forward",
        arithmetic: str | None = None,
        engine: str = "corners",
        clamp: bool = False,
        lsb: tuple[float | None, float | None] = (None, None),
    ) -> None:
        arguments.choice("operator", operator, ("forward", "inverse"))
        self.inverse = operator == "inverse"
        if self.inverse:
            problems = cascade.inverse_problems()
            if problems:
                raise NotInvertibleError(problems)
        limited = clamp or arithmetic is not None
        if engine == "corners" and min(cascade.pi.weights) < 0:  # its output must rise with the drive
            engine = "loop"
        self._build = functools.partial(
            tables.build, cascade, arithmetic or "float64", engine, limited, lsb, self.inverse
        )
        self._fixed = ARITHMETICS[arithmetic or "float64"].fixed
        self.tables = self._build()
        self._range, self._cascade = cascade.input_range, cascade
        self._code = operations(self.tables, self.inverse)
        self.state = new_state(self.tables, self.inverse)
        self.init()

    def init(self) -> None:
        """Return to the start memory."""
        with jit.plain():  # as in `answers`
            self._code.init(self.tables, self.state)

    @property
    def drive_range(self) -> tuple[float, float]:
        """`input_range` in the operator's own numbers: physical units, or codes in fixed point."""
        if self._fixed:
            low, high = self.tables.limits.drive[0]
            return float(low), float(high)
        return self._range

    def visit(self, drives: Iterable[float]) -> None:
        """Apply these drives to the actuator, in range or not, after `init` and before the next samples."""
        seen = self._samples(list(drives))
        if not self._fixed:
            inputs = [self._cascade.front(float(v), up) for v in seen for up in (True, False)]
            self.tables = self._build(visited=[float(w) for w in inputs])
            self.init()
        with jit.for_samples(self._code.visit, seen):
            for drive in seen:
                self._code.visit(self.tables, self.state, drive)

    def run(self, x: ArrayLike) -> tuple[NDArray[Any], Bytes]:
        """Answers (N,) for the input samples (N,), and the status bits of each sample.

        Fixed point takes and returns codes. Raises ValueError for numbers that are not codes and for arrays of another
        shape, TypeError for anything but an array of numbers.
        """
        samples = self._samples(x)
        return self.operate(np.full(len(samples), OP_STEP, dtype=np.uint8), samples)

    def _samples(self, x: ArrayLike) -> NDArray[Any]:
        return samples(self.tables, arguments.signal("u" if self.inverse else "v", x))

    def operate(self, op: Bytes, x: NDArray[Any]) -> tuple[NDArray[Any], Bytes]:
        """Run a sequence of init, reset, step and commit with arguments; returns the steps' answers and status bits."""
        answers = np.zeros_like(x)
        status = np.zeros(len(x), dtype=np.uint8)
        with jit.for_samples(self._code.run, x):
            self._code.run(self.tables, self.state, op, x, answers, status)
        return answers, status
