"""Running a model over sampled signals: in double precision, or as the bit reference of an arithmetic."""

from __future__ import annotations

import functools
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystgen.basics import arguments
from hystgen.basics.problems import NotInvertibleError
from hystgen.chain.static import StaticModel
from hystgen.compensator import reference, tables
from hystgen.plays import slots
from hystgen.plays.slots import Bytes


class Session:
    """One instance of an operator, run over records that follow one another.

    `operator`: 'forward' or 'inverse'. Without `arithmetic` it computes in double precision and limits nothing unless
    `clamp`; with one it is the bit reference of the emitted C, which clamps, in codes of `lsb` (drive and output, None
    for the finest) where it is fixed point. Raises NotInvertibleError and FormatError.
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
        self._inverse = int(operator == "inverse")
        if self._inverse:
            problems = cascade.inverse_problems()
            if problems:
                raise NotInvertibleError(problems)
        limited = clamp or arithmetic is not None
        if engine == "corners" and min(cascade.pi.weights) < 0:  # outputs that fall in a rising move have no corners
            engine = "loop"
        self._build = functools.partial(
            tables.build, cascade, arithmetic or "float64", engine, limited, lsb, bool(self._inverse)
        )
        self.tables = self._build()
        self._range, self._cascade = cascade.input_range, cascade
        self._code = reference.operations(self.tables)
        self.state = reference.new_state(self.tables, bool(self._inverse))
        self.init()

    def init(self) -> None:
        """Back to the start memory."""
        self._code.init(self.tables, self.state, self._inverse)

    @property
    def drive_range(self) -> tuple[float, float]:
        """`input_range` in what the operator takes: physical units, or codes in fixed point."""
        if self.tables.fixed:
            low, high = self.tables.limits[slots.DRIVE_MIN : slots.DRIVE_MAX + 1]
            return float(low), float(high)
        return self._range

    def visit(self, drives: Iterable[float]) -> None:
        """Let the actuator see these drive values, in range or not, after `init` and before what comes next."""
        seen = self._samples(list(drives))
        if not self.tables.fixed:
            inputs = [self._cascade.front(float(v), up) for v in seen for up in (True, False)]
            self.tables = self._build(visited=[float(w) for w in inputs])
            self.init()
        for drive in seen:
            self._code.visit(self.tables, self.state, self._inverse, drive)

    def run(self, x: ArrayLike) -> tuple[NDArray[Any], Bytes]:
        """Answers (N,) for the input samples (N,), and the status bits of each sample.

        Fixed point takes and gives codes. Raises ValueError for numbers that are none and for another shape, TypeError
        for what is no array of numbers.
        """
        samples = self._samples(x)
        return self.operate(np.full(len(samples), slots.OP_STEP, dtype=np.uint8), samples)

    def _samples(self, x: ArrayLike) -> NDArray[Any]:
        given = arguments.signal("u" if self._inverse else "v", x)
        if self.tables.fixed:
            return reference.codes(self.tables, given)
        return np.ascontiguousarray(given, dtype=self.tables.threshold.dtype)

    def operate(self, op: Bytes, x: NDArray[Any]) -> tuple[NDArray[Any], Bytes]:
        """A sequence of init, reset, step and commit with their arguments; answers are those of the steps."""
        answers = np.zeros_like(x)
        status = np.zeros(len(x), dtype=np.uint8)
        self._code.run(self.tables, self.state, self._inverse, op, x, answers, status)
        return answers, status
