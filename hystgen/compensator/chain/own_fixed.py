"""Blocks of a user's own effects in fixed point: formats derived from their functions, and roundings.

The functions are the same as in floating point. Signals in a block have enough bits below the chain's to keep the
accumulated roundings of its states below a fraction of the chain's last bit. Table entries are factors; if an argument
has more bits than a product can take, the product drops its last bits.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen.arithmetic.factors import GUARD, LARGEST, STATE_BITS, error, factor, lifted, times
from hystgen.basics.jit import jit
from hystgen.basics.structures import Factor, Struct, UInt8, firsts
from hystgen.compensator.chain import own
from hystgen.compensator.chain.own import Linear, OwnTables
from hystgen.effects.base import Effect, Place
from hystgen.effects.kinds import OwnBlock
from hystgen.effects.own import Instance
from hystgen.effects.part import ChainPart, Coded, FixedSurroundings, Setting, Sought, given
from hystgen.plays.fixed import nearest

Row = tuple[tuple[int, int], int, int]
"""The members of a `FixedNumber`."""


class FixedNumber(Struct):
    """A factor of a user's own block, and the low-order bits that a product omits from its argument and from its
    result."""

    factor: Factor
    drop: UInt8
    lift: UInt8


@dataclass(frozen=True)
class Formats(Coded):
    """A block in fixed point: `table` of its parameters; `bits` of its signals below the chain's; `output` and
    `answer`: roundings of the results of absorb and solve, in units of the chain's signals."""

    linear: Linear
    table: list[Row]
    bits: int
    output: float
    answer: float

    @property
    def one(self) -> Linear:
        """The block in double precision."""
        return self.linear

    @property
    def arrived(self) -> float:
        """Roundings of the output in front of the plays."""
        return self.output

    def led(self, error: float, code: float, same: bool, turning: bool) -> float:  # noqa: ARG002  as in every block
        """Error of the input for an error of the requested output; `code`: rounding of the input."""
        return self._passed(error + self.output, self.answer + code, same)

    def there(self, size: float, signal: float) -> float:  # noqa: ARG002  as in every block
        """Roundings of the output, for signals in units of `signal`."""
        return self.output * signal

    def solved(self, error: float, at: Sought) -> float:
        """Error of the input solved for, given an error of the output."""
        states = at.seen * self.linear.forward.before() + self.output * at.signal
        return self._passed(error + states, self.answer * at.signal, at.same)

    def residual(self, missed: float, same: bool) -> float:
        """The output error that results from an error of the sum of the plays left by the inverse."""
        return self._passed(0.0, missed, same)

    def _passed(self, error: float, own: float, same: bool) -> float:
        """Error of the input for an error of the output, and a rounding `own`."""
        return error / abs(self.linear.forward.d) + own if same else self.linear.passed(error, own)


@dataclass
class _Number:
    """A table entry, and the largest magnitude of its arguments; `exact`: whether its factor counts as exact."""

    value: float
    row: Row
    exact: bool
    seen: float = 0.0

    def __mul__(self, x: _Traced) -> _Traced:
        self.seen = max(self.seen, x.size)
        _, drop, lift = self.row
        scaled = self.value * 2.0 ** (drop - lift)
        wrong = abs(self.value) * (x.error + (2.0**drop if drop else 0.0))
        wrong += 2.0**lift * (0.5 + (0.0 if self.exact else error(scaled) * x.size / 2.0**drop))
        return x.made(abs(self.value) * x.size, wrong)


@dataclass(frozen=True)
class _Traced:
    """An integer of magnitude up to `size`, within `error` of its exact value; `most`: the largest of all sizes."""

    size: float
    error: float
    most: list[float] = field(compare=False)

    def made(self, size: float, error: float) -> _Traced:
        self.most[0] = max(self.most[0], size)
        return _Traced(size, error, self.most)

    def __add__(self, other: _Traced) -> _Traced:
        return self.made(self.size + other.size, self.error + other.error)

    __sub__ = __add__

    def __neg__(self) -> _Traced:
        return self


def _row(value: float, seen: float) -> Row:
    """A table entry for arguments up to `seen`."""
    drop = max(0, math.ceil(math.log2(max(seen, 1.0))) + 1 - (LARGEST.bit_length() - 1))
    lift = lifted(value * 2.0**drop, 0)
    return factor(value * 2.0 ** (drop - lift)), drop, lift


@dataclass(frozen=True)
class _Trace:
    """The sizes and errors in the functions of a block, for inputs up to `given` and outputs up to `asked`."""

    linear: Linear
    given: float
    asked: float

    def run(
        self, rows: Sequence[Row], bits: int, exact: bool
    ) -> tuple[list[float], float, float, float]:
        """The largest argument of each table entry, the largest magnitude of all, and the roundings of absorb and of
        solve, with `bits` more bits for signals; `exact`: without the errors of factors, which are proportional to the
        signals and which more bits do not reduce."""
        most = [0.0]
        pairs = zip(self.linear.numbers.tolist(), rows, strict=True)
        numbers = [_Number(value, row, exact) for value, row in pairs]

        def signal(size: float) -> _Traced:
            return _Traced(0.0, 0.0, most).made(size * 2.0**bits, 0.0)

        def state() -> NDArray[np.object_]:
            return np.array([signal(size) for size in (self.given * self.linear.sizes()).tolist()], dtype=object)

        given, asked = signal(self.given), signal(self.asked)

        block = self.linear.effect.block
        assert block is not None
        begun, moved = state(), state()
        rest, now = block.rest(numbers, begun, given), block.absorb(numbers, moved, given)
        started, lost = (np.array([each.error for each in states]) for states in (begun, moved))
        back = [block.solve(numbers, state(), asked), block.resting(numbers, asked)]
        forward = self.linear.forward
        output = max(rest.error, now.error) + float(forward.after() @ lost + forward.once() @ started)
        return [each.seen for each in numbers], most[0], output, max(each.error for each in back)


def formats(linear: Linear, given: float, asked: float, code: int) -> Formats:
    """A block for inputs up to `given` and outputs up to `asked`, in signals of the chain.

    The chain's signals have `code` bits below a code. Raises OverflowError if numbers do not fit or states would stall.
    """
    trace = _Trace(linear, given, asked)
    values = linear.numbers.tolist()
    seen, most, noise, _ = trace.run([_row(value, 0.0) for value in values], 0, True)
    wanted = max(math.ceil(math.log2(max(noise, 1.0))), 0) + GUARD
    bits = min(wanted, STATE_BITS - math.ceil(math.log2(most)))
    if bits < 0 or bits + code < wanted - GUARD + 1:
        raise OverflowError("no room")
    rows = [_row(value, size * 2.0**bits) for value, size in zip(values, seen, strict=True)]
    _, _, output, answer = trace.run(rows, bits, False)
    return Formats(linear, rows, bits, output / 2.0**bits + 0.5, answer / 2.0**bits + 0.5)


def build(rows: Sequence[Formats]) -> OwnTables:
    """The tables of the blocks on one side of the plays."""
    return OwnTables(
        firsts(len(each.table) for each in rows),
        FixedNumber.of([number for each in rows for number in each.table]),
        firsts(len(each.linear.settled) for each in rows),
        np.array([each.bits for each in rows], dtype=np.int64),
    )


# ---------------------------------------------------------------- product_fixed.c, and the glue around a block


@jit
def product(number: Any, x: int) -> int:
    """A table entry times x, rounded to the nearest integer."""
    found: int = times(x >> number["drop"], number["factor"]["mantissa"], number["factor"]["shift"]) << number["lift"]
    return found


@jit
def entered(t: OwnTables, j: int, x: int) -> int:
    """A signal of the chain as one of block j."""
    return x << t.bits[j]


@jit
def left(t: OwnTables, j: int, x: int) -> int:
    """A signal of block j as one of the chain."""
    return nearest(x, t.bits[j])


def part(name: str, place: Place, blocks: Sequence[OwnBlock] = (), effects: Sequence[type[Effect]] = ()) -> ChainPart:
    """Blocks on one side of the plays as a part of the chain."""
    ahead = place is Place.DRIVE

    def format_of(one: Linear, about: FixedSurroundings, size: float, asked: float) -> Formats:
        bits = 0 if ahead else about.bits  # sizes in front of the plays are given in units of signals
        return formats(one, size * 2.0**bits, asked * 2.0**bits, bits)

    def problems(effect: Effect, at: Setting) -> Iterator[str]:
        yield from own.problems(effect, at.seconds, at.whole)
        if ahead and effect in at.slewed:
            limit = at.slewed[-1]
            order = f"give it an order: ClassVar[int] above that of {limit.name}, {limit.order}"
            yield f"in front of the slew limit; {order}"

    return ChainPart(
        name, "effects in front of the plays" if ahead else "", place, given(place),
        lambda effect, seconds, _: own.linear(effect, seconds),
        own.arithmetic(blocks, effects, own.GLUE, 1, lambda every, about: own.build(every, about.reals)),
        lambda: own.arithmetic(blocks, effects, (product, entered, left), 2, lambda rows, _: build(rows), format_of),
        joined=True, problems=problems, uneven=Instance, counted=lambda *_: (),
    )
