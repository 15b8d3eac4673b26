"""Codes of converters in and out: the bit-exact reference of `c_runtime/compensator/converter.c`."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from hystgen.arithmetic import Arithmetic
from hystgen.basics.problems import FormatError
from hystgen.basics.quantities import decimal
from hystgen.plays.slots import OP_COMMIT, OP_STEP, OP_UNREAD, Bytes

if TYPE_CHECKING:
    from hystgen.compensator.chain.layout import ChainTables
    from hystgen.compensator.layout import FixedTables, Tables
    from hystgen.parameters.schema import Converter, Converters

Codes: TypeAlias = NDArray[np.int64]
Numbers: TypeAlias = NDArray[np.number]

SUM_BITS = 62
"""[bits] A sum in fixed point stays below 2^62 in magnitude, so that half a unit can be added in 64 bits."""


@dataclass(frozen=True)
class CodeLine:
    """A quantity, linear in its converter's codes `least` .. `most`: `zero` at code 0, and `step` more per code."""

    least: int
    most: int
    zero: Fraction
    step: Fraction

    @classmethod
    def of(cls, one: Converter) -> CodeLine:
        """The line of a converter, exact."""
        codes = 1 << one.bits
        least = -codes // 2 if one.coding == "twos-complement" else 0
        most = least + codes - 1
        low, high = map(decimal, one.range)
        step = (high - low) / (most - least)
        return cls(least, most, low - least * step, step)

    def inside(self, codes: Numbers) -> Codes:
        """The nearest of the converter's codes."""
        return np.clip(np.asarray(codes, dtype=np.int64), self.least, self.most)

    @property
    def largest(self) -> Fraction:
        """Largest magnitude of the quantity."""
        return max(abs(self.zero + code * self.step) for code in (self.least, self.most))


class CodeConversion(ABC):
    """The conversions of a model in an arithmetic.

    `reference`, `drive`: exact lines in the model's numbers, which are physical units or codes of the model;
    `reference_error`, `drive_error`: largest error of a converted code, in these numbers; `code_error`: largest
    distance of a drive from the drive of its code, in converter steps: half a step and rounding.
    """

    reference: CodeLine
    drive: CodeLine
    reference_error: float
    drive_error: float
    code_error: float

    @abstractmethod
    def reference_from_code(self, codes: Numbers) -> Numbers:
        """References (N,) of codes (N,)."""

    @abstractmethod
    def drive_from_code(self, codes: Numbers) -> Numbers:
        """Drives (N,) of codes (N,)."""

    @abstractmethod
    def code_from_drive(self, drives: Numbers) -> Codes:
        """Codes (N,) whose drives are nearest to the drives (N,)."""

    @property
    @abstractmethod
    def macros(self) -> tuple[tuple[str, int | np.floating], ...]:
        """Names, without the model's prefix, and values of the constants in the C."""


class FloatConversion(CodeConversion):
    """In floating point: a product and a sum. Raises FormatError if a drive from one code can come back as another."""

    def __init__(self, both: Converters, arithmetic: Arithmetic) -> None:
        self.real = real = arithmetic.real
        self.reference, self.drive = CodeLine.of(both.reference), CodeLine.of(both.drive)
        self.reference_error, self.drive_error = self._error(self.reference), self._error(self.drive)
        self._numbers = {
            side: (real(float(line.zero)), real(float(line.step)))
            for side, line in (("reference", self.reference), ("drive", self.drive))
        }
        self._codes = real(float(1 / self.drive.step))
        unit, line = float(np.finfo(real).eps) / 2, self.drive
        apart = (abs(line.zero) + line.largest) / abs(line.step)  # rounding of the zero and of the difference
        returned = unit * float(apart + 2 * max(abs(line.least), abs(line.most)) + 1) * (1 + 4 * unit)
        self.code_error = 0.5 + returned
        if returned + self.drive_error / float(abs(line.step)) >= 0.5:
            advice = f"emit with --arithmetic {arithmetic.finer}, or give fewer bits" if arithmetic.finer else (
                "give fewer bits, or a range closer to 0"
            )
            words = (
                f"{arithmetic.name} cannot tell neighbouring codes apart: a step is {float(abs(line.step)):.3g}, and "
                f"drives are rounded by up to {self.drive_error:.2g}; {advice}"
            )
            raise FormatError((("emit", "converter", "drive", "bits"), words))

    def _error(self, line: CodeLine) -> float:
        """Rounding of the zero, the step, their product and their sum."""
        unit, most = float(np.finfo(self.real).eps) / 2, max(abs(line.least), abs(line.most))
        return unit * float(abs(line.zero) + 2 * most * abs(line.step) + line.largest) * (1 + 4 * unit)

    def _quantity(self, side: str, codes: Codes) -> Numbers:
        zero, step = self._numbers[side]
        found: Numbers = zero + codes.astype(self.real) * step
        return found

    def reference_from_code(self, codes: Numbers) -> Numbers:
        return self._quantity("reference", self.reference.inside(codes))

    def drive_from_code(self, codes: Numbers) -> Numbers:
        return self._quantity("drive", self.drive.inside(codes))

    def code_from_drive(self, drives: Numbers) -> Codes:
        line = self.drive
        with np.errstate(over="ignore", invalid="ignore"):
            found = (np.asarray(drives, dtype=self.real) - self._numbers["drive"][0]) * self._codes
        found = np.where(found > line.least, found, self.real(line.least))  # NaN too
        found = np.minimum(found, self.real(line.most))
        whole = np.trunc(found)
        part = found - whole
        nearest: Codes = whole.astype(np.int64) - (part + part < -1) + (part + part >= 1)
        return nearest

    @property
    def macros(self) -> tuple[tuple[str, int | np.floating], ...]:
        (zero, step), (drive_zero, drive_step) = self._numbers["reference"], self._numbers["drive"]
        return (
            ("REFERENCE_AT_ZERO", zero), ("REFERENCE_STEP", step),
            ("DRIVE_AT_ZERO", drive_zero), ("DRIVE_STEP", drive_step), ("CODE_STEP", self._codes),
        )


@dataclass(frozen=True)
class Scaled:
    """A line in whole numbers with `bits` fraction bits."""

    zero: int
    step: int
    bits: int

    @classmethod
    def of(cls, zero: Fraction, step: Fraction, most: int) -> Scaled:
        """As many fraction bits as sums over |x| <= `most` allow."""
        largest = abs(zero) + most * abs(step) + 1
        bits = SUM_BITS - 1 - math.ceil(largest).bit_length()
        return cls(round(zero * 2**bits), round(step * 2**bits), bits)

    def at(self, x: Codes) -> Codes:
        """The nearest whole numbers, halves upwards."""
        return (self.zero + x * self.step + (1 << (self.bits - 1))) >> self.bits

    def error(self, most: int) -> float:
        """Largest distance from the exact line."""
        return 0.5 + (most + 1) / 2.0 ** (self.bits + 1)


class FixedConversion(CodeConversion):
    """In fixed point. `drive_lsb`, `output_lsb`: physical units per code of the model; `code_max`: its largest code."""

    def __init__(self, both: Converters, lsb: tuple[Fraction, Fraction], code_max: int) -> None:
        (drive_lsb, output_lsb), self._code_max = lsb, code_max
        self.reference, self.drive = (
            CodeLine(line.least, line.most, line.zero / unit, line.step / unit)
            for line, unit in ((CodeLine.of(both.reference), output_lsb), (CodeLine.of(both.drive), drive_lsb))
        )
        self._scaled = [
            Scaled.of(line.zero, line.step, max(abs(line.least), abs(line.most)))
            for line in (self.reference, self.drive)
        ]
        self._code = Scaled.of(-self.drive.zero / self.drive.step, 1 / self.drive.step, code_max + 1)
        self.reference_error, self.drive_error = (
            scaled.error(max(abs(line.least), abs(line.most)))
            for scaled, line in zip(self._scaled, (self.reference, self.drive), strict=True)
        )
        self.code_error = self._code.error(code_max + 1)

    def _limited(self, codes: Codes) -> Codes:
        return np.clip(codes, -self._code_max, self._code_max)

    def reference_from_code(self, codes: Numbers) -> Numbers:
        return self._limited(self._scaled[0].at(self.reference.inside(codes)))

    def drive_from_code(self, codes: Numbers) -> Numbers:
        return self._limited(self._scaled[1].at(self.drive.inside(codes)))

    def code_from_drive(self, drives: Numbers) -> Codes:
        return self.drive.inside(self._code.at(np.asarray(drives, dtype=np.int64)))

    @property
    def macros(self) -> tuple[tuple[str, int | np.floating], ...]:
        reference, drive = self._scaled
        return (
            ("REFERENCE_AT_ZERO", reference.zero), ("REFERENCE_STEP", reference.step),
            ("REFERENCE_BITS", reference.bits),
            ("DRIVE_AT_ZERO", drive.zero), ("DRIVE_STEP", drive.step), ("DRIVE_STEP_BITS", drive.bits),
            ("CODE_AT_ZERO", self._code.zero), ("CODE_STEP", self._code.step), ("CODE_STEP_BITS", self._code.bits),
        )


def of(both: Converters, arithmetic: Arithmetic, lsb: tuple[Fraction, Fraction] | None) -> CodeConversion:
    """The conversions in an arithmetic; `lsb`: drive and output units per code of the model, None without codes.

    Raises FormatError.
    """
    if lsb is None:
        return FloatConversion(both, arithmetic)
    return FixedConversion(both, lsb, int(np.iinfo(arithmetic.number).max))


def steps(
    t: Tables | FixedTables | ChainTables, conversion: CodeConversion, codes: Numbers, compiled: bool = True
) -> tuple[Codes, Bytes]:
    """Codes of drives (N,) and status bits (N,) of an inverse for codes of references (N,), from its start memory."""
    from hystgen.basics import jit
    from hystgen.compensator import reference

    operations, state = reference.operations(t, True), reference.new_state(t, True)
    references = conversion.reference_from_code(codes).astype(t.threshold.dtype)
    low, high = t.limits.drive[0]
    sent, status = np.zeros(len(references), dtype=np.int64), np.zeros(len(references), dtype=np.uint8)
    step, commit = (np.array([call], dtype=np.uint8) for call in (OP_STEP | OP_UNREAD, OP_COMMIT))
    x, answer, bits = np.zeros(1, t.threshold.dtype), np.zeros(1, t.threshold.dtype), np.zeros(1, np.uint8)
    with jit.plain():  # one pass over the memory is not worth compiling
        operations.init(t, state)
    with jit.for_samples(operations.run, references) if compiled else jit.plain():
        for i, one in enumerate(references):
            x[0] = one
            operations.run(t, state, step, x, answer, bits)
            code = conversion.code_from_drive(answer)
            sent[i] = code[0]
            x[0] = np.clip(conversion.drive_from_code(code), low, high)[0]
            operations.run(t, state, commit, x, answer, bits)
            status[i] = bits[0]
    return sent, status
