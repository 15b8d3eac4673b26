"""The sequence of drives that erases the memory, as tables and macros of the C."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from hystgen.arithmetic import ARITHMETICS
from hystgen.basics.problems import FormatError, PlanError
from hystgen.emission.compensator import Macro, Numbers, Writer
from hystgen.emission.runtime import Field, Piece, declared_type
from hystgen.emission.text import operand
from hystgen.model import Model

if TYPE_CHECKING:
    from hystgen.degaussing import Degauss

ROOTS = ("hystgen_degauss_t",)


def of(model: Model, arithmetic: str) -> Degauss:
    """The sequence of a model. Raises FormatError if there is none."""
    from hystgen import degaussing  # which loads effects, and a plain model has none

    try:
        return degaussing.of(model, arithmetic)
    except PlanError as error:
        raise FormatError(*((("emit", "degauss"), problem) for problem in error.problems)) from None


def instance() -> Piece:
    """The type of a sequence under way."""
    words = "/* A sequence of drives that erases the memory. Plain data, owned by the caller. */"
    return declared_type("degauss_t", words, [
        Field("real_t", "drive", "last returned"),
        Field("uint_least16_t", "turn", "index of the next one"),
        Field("uint32_t", "left", "samples for which the drive stays"),
    ])


def with_sequence(numbers: Numbers, one: Degauss, writer: Writer) -> Numbers:
    """The numbers of a model with those of the sequence."""
    tables = (
        writer.own.array("real_t", "degauss_turn", one.turns),
        writer.own.array("real_t", "degauss_move", [one.step]),
        writer.own.array("uint32_t", "degauss_rest", [one.hold, one.rest]),
    )
    count = ("DEGAUSS_TURN_COUNT", f"{len(one.turns)}u", "")
    return replace(numbers, macros=(*numbers.macros, count), beside=(*numbers.beside, *tables))


def macros(one: Degauss, output: str) -> list[Macro]:
    """Macros of the header; `output`: its unit after a comma, or nothing."""
    real = ARITHMETICS[one.arithmetic].real
    return [
        ("DEGAUSS_SAMPLES", f"{one.samples}u", "steps until the memory is erased, at most"),
        ("DEGAUSS_END", operand(one.turns[-1]), "drive at the end"),
        ("DEGAUSS_RESIDUAL", operand(real(one.residual)), f"left in the displacement by earlier drives{output}"),
    ]
