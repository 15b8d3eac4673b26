"""Running a model over sampled signals: in double precision, or as the bit reference of an arithmetic."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystgen import arguments, compiled, fixed, reference, tables
from hystgen.models import Cascade
from hystgen.reference import Bytes

if TYPE_CHECKING:
    from hystgen.api import Model
    from hystgen.records import Record


class Session:
    """One instance of an operator, run over records that follow one another.

    `operator`: 'forward' or 'inverse'. Without `arithmetic` it computes in double precision and limits nothing unless
    `clamp`; with one it is the bit reference of the emitted C, which clamps, in codes of `lsb` (drive and output, None
    for the finest) where it is fixed point. Raises NotInvertibleError and FormatError.
    """

    def __init__(
        self,
        cascade: Cascade,
        operator: str = "forward",
        arithmetic: str | None = None,
        engine: str = "corners",
        clamp: bool = False,
        lsb: tuple[float | None, float | None] = (None, None),
    ) -> None:
        arguments.choice("operator", operator, ("forward", "inverse"))
        self._inverse = int(operator == "inverse")
        if self._inverse:
            cascade.inverse()
        limited = clamp or arithmetic is not None
        if engine == "corners" and min(cascade.pi.weights) < 0:  # outputs that fall in a rising move have no corners
            engine = "loop"
        self._build = functools.partial(
            tables.build, cascade, arithmetic or "float64", engine, limited, lsb, bool(self._inverse)
        )
        self.tables = self._build()
        self._range, self._cascade = cascade.input_range, cascade
        self._code = compiled.reference(self.tables)
        self.state = self._code.new_state(self.tables)
        self.init()

    def init(self) -> None:
        """Back to the start memory."""
        self._code.init(self.tables, self.state, self._inverse)

    @property
    def drive_range(self) -> tuple[float, float]:
        """`input_range` in what the operator takes: physical units, or codes in fixed point."""
        if self.tables.threshold.dtype.kind == "i":
            low, high = self.tables.limits[reference.DRIVE_MIN : reference.DRIVE_MAX + 1]
            return float(low), float(high)
        return self._range

    def visit(self, drives: Iterable[float]) -> None:
        """Let the actuator see these drive values, in range or not, after `init` and before what comes next."""
        seen = self._samples(list(drives))
        if self.tables.threshold.dtype.kind == "f":
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
        return self.operate(np.full(len(samples), reference.OP_STEP, dtype=np.uint8), samples)

    def _samples(self, x: ArrayLike) -> NDArray[Any]:
        given = arguments.signal("u" if self._inverse else "v", x)
        with np.errstate(invalid="ignore"):  # what is no code is found below
            samples = np.ascontiguousarray(given, dtype=self.tables.threshold.dtype)
        if samples.dtype.kind == "i":
            most = int(self.tables.limits[fixed.CODE_MAX])
            if np.any(given != samples) or np.any(samples < -most - 1) or np.any(samples > most):
                raise ValueError(f"fixed point takes codes, whole numbers from {-most - 1} to {most}")
        return samples

    def operate(self, op: Bytes, x: NDArray[Any]) -> tuple[NDArray[Any], Bytes]:
        """A sequence of init, reset, step and commit with their arguments; answers are those of the steps."""
        answers = np.zeros_like(x)
        status = np.zeros(len(x), dtype=np.uint8)
        self._code.run(self.tables, self.state, self._inverse, op, x, answers, status)
        return answers, status


def simulate(cascade: Cascade, v: ArrayLike, clamp: bool = False) -> NDArray[np.float64]:
    """Output (N,) for the drive samples `v` (N,) from the start memory, in double precision."""
    return Session(cascade, "forward", clamp=clamp).run(v)[0]


def simulate_inverse(cascade: Cascade, u: ArrayLike, clamp: bool = False) -> NDArray[np.float64]:
    """Drive (N,) for the reference samples `u` (N,) from the start memory, in double precision."""
    return Session(cascade, "inverse", clamp=clamp).run(u)[0]


def simulate_records(
    model: Model,
    records: Sequence[Record],
    operator: str = "forward",
    arithmetic: str | None = None,
    engine: str | None = None,
    history: Sequence[float] = (),
    rest: float = 0.0,
) -> list[tuple[NDArray[Any], list[str]]]:
    """Answers of the model (column v) or its inverse (column u) for records that are one session, each with remarks.

    `history`: drives visited before the first record; `rest`: seconds of pause before every record, which effects
    alone see. The forward model is not limited to `input_range`, the inverse and every `arithmetic` are. Raises
    NotInvertibleError, FormatError, EffectsError and UnsupportedEffectsError.
    """
    if operator == "inverse":
        model.inverse()
    if model.effects and arithmetic is None:
        runs = [model.run(record.v, record.t, record.extra, rest=rest) for record in records]
        answers = model.chain.simulate(runs, history)
        ends = model.cascade.input_range
        return [(y, _outside(r.name, ends, r.v, False)) for r, y in zip(records, answers, strict=True)]
    session = model.session(operator, arithmetic, engine, clamp=operator == "inverse")
    if history:
        session.visit(history)
    found = []
    for record in records:
        signal = record.columns()["v" if operator == "forward" else "u"]
        samples, status = session.run(signal)
        found.append((samples, _remarks(record.name, session, operator, signal, status)))
    return found


def _outside(name: str, ends: tuple[float, float], signal: NDArray[np.float64], limited: bool) -> list[str]:
    """A sentence about drives outside the range, if there are any."""
    outside = int(np.count_nonzero((signal < ends[0]) | (signal > ends[1])))
    how = "limited to it" if limited else "extrapolated, not limited"
    said = f"{name}: {outside} of {len(signal)} samples lie outside input_range {ends[0]:g} to {ends[1]:g}, {how}"
    return [said] if outside else []


def _remarks(
    name: str, session: Session, operator: str, signal: NDArray[np.float64], status: Bytes
) -> list[str]:
    """What a user should know about a simulated record, one sentence each."""
    if operator == "forward":
        limited = bool(np.any(status & reference.INPUT_CLAMPED))
        return _outside(name, session.drive_range, signal, limited)
    said = []
    for bit, what in (
        (reference.INPUT_CLAMPED, "references lie outside the output range and were limited"),
        (reference.OUTPUT_CLAMPED, "drives were limited to input_range"),
    ):
        count = int(np.count_nonzero(status & bit))
        if count:
            said.append(f"{name}: {count} of {len(signal)} {what}")
    return said
