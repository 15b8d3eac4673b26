"""Structures of named numbers: as attributes in Python and in compiled code, and what they refuse."""

from __future__ import annotations

import copy
import pickle
from typing import Any, NamedTuple

import numpy as np
import pytest

from hystgen.basics.jit import jit, plain
from hystgen.basics.structures import Count, Factor, FourInt32, Real, Struct, memory_of


class Inner(Struct):
    """The part that `Outer` begins with."""

    high: Real


class Outer(Inner):
    """One number of each kind."""

    n: Count
    rate: Factor
    c: FourInt32


class Both(NamedTuple):
    """Tables, or memory, of two lengths."""

    one: Inner
    other: Outer


@jit
def stepped(s: Both, j: int, x: Any) -> Any:
    """Change a number of each kind of structure `j`."""
    s.other.high[j] = s.other.high[j] + x
    s.other.rate.shift[j] = s.other.n[j]
    s.other.c[j, 2] = 7
    s.one.high[0] = s.one.high[0] + s.other.c.shape[0] * s.other.c.shape[1]  # not the width of the structure
    return s.other.rate.mantissa[j] + s.one.high[0]


ROWS = [(0.1, 1, (2, 3), (4, 5, 6, 7)), (0.2, 8, (9, 10), (11, 12, 13, 14))]


@pytest.mark.parametrize("real", [np.float32, np.float64])
def test_compiled_code_and_python_change_the_same_numbers(real: type[np.floating[Any]]) -> None:
    found = []
    for compiled in (True, False):
        s = Both(Inner.of([(0.5,)], real), Outer.of(ROWS, real))
        if compiled:
            answer = stepped(s, 1, real(0.1))
        else:
            with plain():
                answer = stepped(s, 1, real(0.1))
        found.append((answer, s.other.tobytes()))
    assert found[0] == found[1]
    wanted = [ROWS[0], (real(0.2) + real(0.1), 8, (9, 8), (11, 12, 7, 14))]
    assert found[0] == (9 + 0.5 + 2 * 4, np.array(wanted, Outer.of([], real).dtype).tobytes())


def test_members_come_in_order_and_share_memory() -> None:
    assert list(Outer.members()) == ["high", "n", "rate", "c"]
    s = Outer.of(ROWS, np.float32)
    assert [s.high.dtype, s.n.dtype, s.c.shape] == [np.float32, np.int64, (2, 4)]
    for each in (s, s[1:], s.copy(), copy.deepcopy(s), pickle.loads(pickle.dumps(s))):
        each.rate.mantissa[-1] = 20
        assert each[-1]["rate"]["mantissa"] == 20
        assert isinstance(each.rate, Factor)
    assert s.rate.mantissa.tolist() == [2, 20]


def test_memory_is_as_long_as_the_tables() -> None:
    assert len(memory_of(Inner)(Outer.of(ROWS), np.float64)) == 2
    found = memory_of(Both)(Both(Inner.of([(1.0,)] * 3), Outer.of(ROWS)), np.float32)
    assert [len(found.one), len(found.other)] == [3, 2]
    assert found.one.high.dtype == np.float32
    assert not found.other.tobytes().strip(b"\0")


def test_a_name_of_arrays_is_refused() -> None:
    class Wrong(Struct):
        high: Real
        base: Real

    with pytest.raises(AssertionError, match="base"):
        Wrong.zeros(1)
