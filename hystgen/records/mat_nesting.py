"""Nesting depth of structs and cells in a MATLAB v5 file, from its headers alone.

scipy reads structs and cells by recursion in C, so a file of a few hundred kilobytes can crash the process. The
elements are therefore walked here first, in the order in which scipy reads them, with an explicit stack.
"""

from __future__ import annotations

import contextlib
import math
import struct
import zlib
from collections.abc import Callable, Iterator
from typing import IO

MOST = 32
"""[levels] Nesting limit for structs and cells: ControlDesk and Simulink save up to five levels. scipy 1.17 reads 1000,
and crashes the process at 5000 with an 8 MB stack. Set by: tests/test_record_formats.py TestNesting."""

MANY = 10_000_000
"""[structs or cells in one array] Limit: scipy allocates as many as the header says, and visits them all before it
notices that they are missing; 2^31 structs without fields take minutes."""

HEADER = 128
"""Bytes before the first variable; the last two give the byte order."""

MATRIX, COMPRESSED = 14, 15
"""Types of elements."""

CELL, STRUCT, OBJECT, CHAR, SPARSE, FUNCTION, OPAQUE = 1, 2, 3, 4, 5, 16, 17
"""Classes of arrays; all others are numeric."""

COMPLEX = 0x800
"""Flag of an array with an imaginary part."""

DAMAGED = (EOFError, ValueError, ZeroDivisionError, zlib.error)
"""Raised where an element is truncated or damaged."""

PIECE = 1 << 16
"""[bytes] Amount read or unpacked at a time."""


def problem(stream: IO[bytes]) -> str:
    """The reason why a file must not be passed to scipy; empty if it is safe.

    An element that is truncated or not an array stops the walk; scipy stops there as well, with a message.
    """
    for elements in _variables(stream):
        try:
            if any(depth > MOST for depth in elements.depths()):
                return f"structs or cells nested more than {MOST} deep"
        except OverflowError:
            return f"an array of more than {MANY} structs or cells"
        except DAMAGED:
            pass
    return ""


def objects(stream: IO[bytes]) -> dict[str, str]:
    """The variables that are objects, by name with their classes; the walk stops as in `problem`."""
    found: dict[str, str] = {}
    for elements in _variables(stream):
        with contextlib.suppress(*DAMAGED):
            found |= elements.named_object()
    return found


def _variables(stream: IO[bytes]) -> Iterator[_Elements]:
    """The elements of each variable of a file, unpacked; none of a file of version 4, which holds only numbers."""
    stream.seek(0)
    head = stream.read(HEADER)
    if len(head) < HEADER or 0 in head[:4]:
        return
    order = "<" if head[126:127] == b"I" else ">"
    place = HEADER
    while len(tag := stream.read(8)) == 8:
        kind, size = struct.unpack(f"{order}II", tag)
        place += 8 + size
        elements = _Elements(stream if kind != COMPRESSED else _Unpacked(stream, size), order)
        sound = True
        if kind == COMPRESSED:
            try:
                elements.matrix()
            except DAMAGED:
                sound = False
        if sound:
            yield elements
        stream.seek(place)


class _Unpacked:
    """The content of a compressed element."""

    def __init__(self, stream: IO[bytes], size: int) -> None:
        self._stream, self._left = stream, size
        self._unpack = zlib.decompressobj()
        self._packed = b""

    def read(self, size: int) -> bytes:
        """The next `size` bytes, or fewer at the end."""
        found = b""
        while len(found) < size and not self._unpack.eof:
            if not self._packed:
                self._packed = self._stream.read(min(PIECE, self._left))
                self._left -= len(self._packed)
                if not self._packed:
                    break
            found += self._unpack.decompress(self._packed, size - len(found))
            self._packed = self._unpack.unconsumed_tail
        return found


class _Elements:
    """The elements of one variable, one by one."""

    def __init__(self, stream: IO[bytes] | _Unpacked, order: str) -> None:
        self._stream, self._order = stream, order
        self._seek: Callable[[int, int], int] | None = getattr(stream, "seek", None)

    def _bytes(self, size: int) -> bytes:
        found = self._stream.read(size)
        if len(found) < size:
            raise EOFError
        return found

    def _skip(self, size: int) -> None:
        if self._seek is not None:
            self._seek(size, 1)
            return
        for start in range(0, size, PIECE):
            self._bytes(min(PIECE, size - start))

    def _tag(self) -> tuple[int, int, bytes | None]:
        """Type and size of an element, and its content if it is stored in the tag itself."""
        raw = self._bytes(8)
        kind, size = struct.unpack(f"{self._order}II", raw)
        return (kind & 0xFFFF, kind >> 16, raw[4 : 4 + (kind >> 16)]) if kind >> 16 else (kind, size, None)

    def _element(self) -> int:
        """Skip an element and return its size."""
        _, size, inside = self._tag()
        if inside is None:
            self._skip(size + -size % 8)
        return size

    def _integers(self) -> tuple[int, ...]:
        _, size, inside = self._tag()
        if size > PIECE:
            raise ValueError
        data = self._bytes(size + -size % 8)[:size] if inside is None else inside
        return struct.unpack(f"{self._order}{len(data) // 4}i", data)

    def matrix(self) -> int:
        """Read the tag of an array and return its size; the array's header comes next."""
        kind, size, inside = self._tag()
        if kind != MATRIX or inside is not None:
            raise ValueError
        return size

    def named_object(self) -> dict[str, str]:
        """Name and class of an object, after the tag of the variable; nothing for any other variable."""
        self._bytes(8)
        (flags, _) = struct.unpack(f"{self._order}II", self._bytes(8))
        if flags & 0xFF != OPAQUE:
            return {}
        name, _, kind = (self._text() for _ in range(3))
        return {name: kind} if name else {}

    def _text(self) -> str:
        _, size, inside = self._tag()
        if size > PIECE:
            raise ValueError
        data = self._bytes(size + -size % 8)[:size] if inside is None else inside
        return data.decode("latin-1")

    def depths(self) -> Iterator[int]:
        """Depth of each array in a variable, starting after the tag of the variable itself."""
        open_ = [1]
        top = True
        while open_:
            open_[-1] -= 1
            if top or self.matrix():
                yield len(open_)
                open_.append(self._inside(top))
            top = False
            while open_ and open_[-1] <= 0:
                open_.pop()

    def _inside(self, top: bool) -> int:
        """Number of arrays inside an array; its other content is skipped."""
        self._bytes(8)
        (flags, _) = struct.unpack(f"{self._order}II", self._bytes(8))
        sort = flags & 0xFF
        count = 0
        if sort != OPAQUE:
            count = math.prod(self._integers())
            self._element()
        if sort in (CELL, STRUCT, OBJECT) and count > MANY:
            raise OverflowError
        if top and sort not in (CELL, STRUCT, OBJECT, FUNCTION, OPAQUE):
            return 0
        if sort == CELL:
            return count
        if sort in (FUNCTION, OPAQUE):
            for _ in range(3 if sort == OPAQUE else 0):
                self._element()
            return 1
        if sort in (STRUCT, OBJECT):
            if sort == OBJECT:
                self._element()
            (length,) = self._integers()
            return count * (self._element() // length)
        for _ in range((3 if sort == SPARSE else 1) + (flags & COMPLEX != 0)):
            self._element()
        return 0
